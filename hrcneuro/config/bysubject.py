"""Options of a subject's own, ``[STAGE.subjects.NAME]``: on top of those of all, and below what is typed for all."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hrcneuro import stages
from hrcneuro.config.reader import Reader
from hrcneuro.errors import did_you_mean

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings

_SUBJECTS = "subjects"


@dataclass(frozen=True)
class Own:
    """A subject's own options of a stage, as a source has them."""

    reader: Reader
    stage: str
    subject: str
    values: Any


def taken_out(reader: Reader, values: dict[str, Any]) -> list[Own]:
    """Take the tables ``[STAGE.subjects.NAME]`` out of a source's values and return them."""
    found = []
    for name in stages.NAMES:
        section = values.get(name)
        if not isinstance(section, Mapping) or _SUBJECTS not in section or not stages.load(name).by_subject:
            continue
        values[name] = {key: value for key, value in section.items() if key != _SUBJECTS}
        tables = section[_SUBJECTS]
        if isinstance(tables, Mapping):
            found += [Own(reader, name, str(subject), table) for subject, table in tables.items()]
        else:
            reader.mistakes.append(f"{reader.source}: {name}.subjects = {tables!r}; write [{name}.subjects.NAME]")
    return found


def applied(settings: Settings, given: Sequence[Own], typed: tuple[Reader, Mapping[str, Any]]) -> Settings:
    """Return the configuration with the subjects' own options, on top of those of all.

    What the command line gives for all subjects is ``typed``: it goes on top of what a file has for one, since a person
    who types a value means it now.
    """
    own: dict[str, dict[str, Any]] = {}
    origins = dict(settings.origins)
    changed: dict[str, dict[str, list[str]]] = {}
    setter, values = typed
    for one in given:
        where, subjects = f"{one.stage}.subjects.{one.subject}", settings.study.subjects
        if one.subject not in subjects:
            hint = did_you_mean(one.subject, subjects)
            one.reader.mistakes.append(f"{one.reader.source}: [{where}]{hint}: no such subject in study.subjects")
        elif not isinstance(one.values, Mapping):
            one.reader.mistakes.append(f"{one.reader.source}: {where} = {one.values!r} is no table; write [{where}]")
        else:
            of_stage = own.setdefault(one.stage, {})
            base = of_stage.get(one.subject, settings.sections[one.stage])
            allowed = stages.load(one.stage).by_subject
            of_stage[one.subject], keys = one.reader.record(base, one.values, where, only=allowed)
            origins |= keys
            of_all = values.get(one.stage, {})
            if one.reader is not setter and isinstance(of_all, Mapping):
                again = {key: of_all[key] for key in of_all if f"{where}.{key}" in keys}
                # Mistakes in these values are told already.
                reader = dataclasses.replace(setter, mistakes=[])
                of_stage[one.subject], keys = reader.record(of_stage[one.subject], again, where, only=allowed)
                origins |= keys
                for key in again:
                    changed.setdefault(one.stage, {}).setdefault(key, []).append(one.subject)
    return dataclasses.replace(settings, own=own, origins=origins, remarks=_told(changed))


def _told(changed: Mapping[str, Mapping[str, Sequence[str]]]) -> dict[str, tuple[str, ...]]:
    """Return stage -> sentences on the options (stage -> key -> subjects) that the command line gives to all."""
    return {
        stage: tuple(
            f"--set {stage}.{key} is for all subjects: it changes the value that {', '.join(subjects)} had in "
            f"[{stage}.subjects.{subjects[0]}], too; --set {stage}.subjects.{subjects[0]}.{key}=… is for one"
            for key, subjects in keys.items()
        )
        for stage, keys in changed.items()
    }
