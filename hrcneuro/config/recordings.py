"""A configuration beside the recordings that it names, where they are here: does what it asks for occur in them?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hrcneuro.config import dataset
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, DataError

NOWHERE_CURE = "correct it or leave it out; hrcneuro acquire SUBJECT --inspect lists what a recording has"


def check(settings: Settings) -> list[str]:
    """Return what to know of the recordings, a sentence each; nothing where none is read from files.

    Raises:
        ConfigError: A mapped marker or a condition occurs in no subject's recording, or the options do not fit one.
        DataError: A BIDS data set lacks what a subject needs.
    """
    if settings.sections["acquire"].moves:
        return []
    from hrcneuro.analyses import conditions
    from hrcneuro.stages import acquire

    dataset.refuse(settings, settings.included)
    notes: list[str] = []
    looked: dict[str, dict[str, str]] = {}
    for subject in settings.included:
        try:
            absent, trials = acquire.look(settings.section("acquire", subject), subject)
        except DataError as error:
            notes.append(f"{subject} was not looked at: {error.problem}")
            continue
        members = conditions.matching(trials, settings.shared.conditions)
        looked[subject] = absent | conditions.absent(trials, settings.shared.conditions, members)
    if mistakes := nowhere(looked):
        raise ConfigError(f"{', '.join(looked)}: no recording has {' or '.join(mistakes)}", cure=NOWHERE_CURE)
    lacking: dict[str, list[str]] = {}
    for subject, absent in looked.items():
        for text in dict.fromkeys(absent.values()):
            lacking.setdefault(text, []).append(subject)
    return notes + [f"{', '.join(subjects)}: the recording has not {text}" for text, subjects in lacking.items()]


def without_trials(settings: Settings, tables: Mapping[str, Path]) -> list[str]:
    """Return a sentence for each condition that occurs in no trial of some subject, with the nearest spelling.

    Args:
        settings: The configuration.
        tables: Subject -> trial table.
    """
    from hrcneuro.analyses import conditions
    from hrcneuro.io.tables import read_table

    texts: dict[str, str] = {}
    lacking: dict[str, list[str]] = {}
    for subject, path in tables.items():
        trials = read_table(path)
        try:
            members = conditions.matching(trials, settings.shared.conditions)
        except ConfigError as error:
            return [f"{subject}: {error.problem}; {error.cure}"]
        for name, text in conditions.absent(trials, settings.shared.conditions, members).items():
            texts.setdefault(name, text)
            lacking.setdefault(name, []).append(subject)
    return [f"{', '.join(subjects)}: no trial is of {texts[name]}" for name, subjects in lacking.items()]


def nowhere(absent: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Return what no subject has, in the words of the first one.

    Args:
        absent: Subject -> what it lacks: name of the option -> words for people.
    """
    first = next(iter(absent.values()), {})
    return [text for name, text in first.items() if all(name in one for one in absent.values())]
