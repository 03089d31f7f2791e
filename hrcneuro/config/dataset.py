"""What a BIDS data set tells of a study, so that nobody has to write it down again: its name, and who took part."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError, DataError, HrcError
from hrcneuro.sources import bids_events, bids_layout
from hrcneuro.sources.layout import foreign_files

# With more conditions than this, which of them are to be compared is for the study to say.
_FEW = 4
_NAMED = 12


def complete(parts: dict[str, Any], origins: Mapping[str, str]) -> tuple[str, ...]:
    """Fill in what nobody has set from the data set, in place; return what to know of it, a sentence each.

    Name and subjects are the data set's; nobody is excluded and nothing is split, as the paper's study is. Contrasts
    and decoding problems are the pairs of the conditions, where those are few.

    Args:
        parts: The options, by section.
        origins: Where each value that somebody has set comes from.

    Raises:
        DataError: Nobody has named subjects, and there is no such data set, or none with EEG.
    """
    given = {key.partition(".")[0] for key in origins} | set(origins)
    path, ours = parts["acquire"].path, False
    notes: tuple[str, ...] = ()
    found: dict[str, Any] = {"exclude": ()}
    # Where everything is set, results can be looked at while the data set is away.
    if path and not {"study.subjects", "study.name", "study.split"} <= given:
        root = bids_layout.root_of(path)
        ours = bids_layout.is_ours(root)
        found["name"] = bids_layout.name_of(root) or root.resolve().name
        if "study.subjects" not in given:
            found["subjects"] = bids_layout.subjects(root)
            notes = _dropped(root, found["subjects"])
    # The paper's study is split by its scenarios, which an export of it has.
    found["split"] = "scenario" if ours and "conditions" not in given else ""
    unset = {name: value for name, value in found.items() if f"study.{name}" not in given}
    parts["study"] = dataclasses.replace(parts["study"], **unset)
    conditions = parts["shared"].conditions
    if "conditions" in given:
        pairs = {f"{one}-{two}": (one, two) for one, two in itertools.combinations(conditions, 2)}
        pairs = pairs if len(conditions) <= _FEW else {}
        tables = {name: pairs for name in ("contrasts", "problems") if name not in given}
        parts["shared"] = dataclasses.replace(parts["shared"], **tables)
    return notes


def _dropped(root: Path, have: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence on the subjects that the data set lists and that are left out, as they have no EEG."""
    lacking = bids_layout.without_eeg(root, have)
    if not lacking:
        return ()
    named = ", ".join(lacking[:_NAMED]) + (f" … ({len(lacking)})" if len(lacking) > _NAMED else "")
    return (f"participants.tsv lists subjects that have no EEG here and are left out: {named}",)


def refuse(settings: Any, subjects: Iterable[str]) -> None:
    """Refuse a data set that lacks what some of these subjects need, before anything is computed of the others.

    Args:
        settings: The configuration.
        subjects: Those whose recordings are to be read.

    Raises:
        DataError, ConfigError: With all that is found, a line a subject.
    """
    found: dict[str, HrcError] = {}
    tables: dict[str, list[Path]] = {}
    for subject in subjects:
        options = settings.section("acquire", subject)
        try:
            if options.source == "bids":
                files = foreign_files(options, subject)
                if not options.event_column:
                    tables[subject] = bids_layout.events_of(files)
        except HrcError as error:
            found[subject] = error
    if not found:
        _refuse_two_columns(tables)
        return
    first = next(iter(found.values()))
    kind = ConfigError if all(isinstance(error, ConfigError) for error in found.values()) else DataError
    alike: dict[str, list[str]] = {}
    for subject, one in found.items():
        alike.setdefault(one.problem, []).append(subject)
    raise kind("\n  ".join(f"{', '.join(ones)}: {problem}" for problem, ones in alike.items()), cure=first.cure)


def _refuse_two_columns(tables: Mapping[str, Sequence[Path]]) -> None:
    """Refuse subjects whose events are named by different columns, where nobody has said so.

    Args:
        tables: Subject -> its tables of events.
    """
    columns = {subject: bids_events.naming_column(ones) for subject, ones in tables.items()}
    first = next(iter(columns), "")
    other = next((subject for subject, column in columns.items() if column != columns[first]), "")
    if not other:
        return
    raise ConfigError(
        f"{first} names its events by {columns[first]} ({tables[first][0].name}), {other} by {columns[other]} "
        f"({tables[other][0].name}): trials of one kind would have two names",
        cure="say which column names them, acquire.event_column = 'COLUMN'; where one subject's differs and is meant, "
        f"[acquire.subjects.{other}] event_column = '{columns[other]}'",
    )
