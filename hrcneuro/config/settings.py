"""The configuration of a study: TOML -> the stages' frozen Config dataclasses, with every mistake reported at once."""

from __future__ import annotations

import dataclasses
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro import published, stages
from hrcneuro.config import bysubject, dataset, shipped
from hrcneuro.config.reader import Added, Reader
from hrcneuro.config.sections import SECTIONS
from hrcneuro.config.tomlfile import parse_toml, unreadable
from hrcneuro.contract import option
from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.paradigm.design import CONDITIONS, CONTRASTS, PROBLEMS


@dataclass(frozen=True)
class StudyOptions:
    """Who took part, and how the study is divided."""

    name: str = option("ehrlich2023", "name of the study, for the report")
    subjects: tuple[str, ...] = option(tuple(f"s{i:02d}" for i in range(1, 13)), "the units of the subject stages")
    exclude: tuple[str, ...] = option(
        published.EXCLUDED.value, "subjects left out of everything after epoch (paper 2.5.1)"
    )
    split: str = option("scenario", "trial column that splits every analysis; empty for none")
    stages: tuple[str, ...] = option(
        (),
        "what the study consists of; none named: every stage that its data allow, but rerp, transfer and calibrate",
        choices=stages.NAMES,
    )


@dataclass(frozen=True)
class Shared:
    """Tables that several stages read."""

    conditions: dict[str, str] = option(CONDITIONS, "condition -> pandas query on the trial table")
    contrasts: dict[str, tuple[str, ...]] = option(CONTRASTS, "contrast -> [plus, minus], names of conditions")
    problems: dict[str, tuple[str, ...]] = option(PROBLEMS, "decoding problem -> [class 1, class 2 (takeover)]")


@dataclass(frozen=True)
class Settings:
    """The effective configuration, and where each value came from.

    Attributes:
        study, shared: Who took part; the tables that several stages read.
        sections: Stage -> its options.
        origins: Key -> file or command line.
        warnings: What is allowed but worth knowing.
        own: Stage -> subject -> the options of a subject that has values of its own.
        remarks: Stage -> what to know before it runs: of subjects' own values that the command line has replaced, of
            subjects that a data set lists and lacks.
        live: Command of the live side, or ``cluster`` -> its options.
        last_sources: (stage, unit) -> label -> digest of the files that a result was last made from, where it is asked
            for as it was then.
    """

    study: StudyOptions
    shared: Shared
    sections: Mapping[str, Any]
    origins: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    own: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    remarks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    live: Mapping[str, Any] = field(default_factory=dict)
    last_sources: Mapping[tuple[str, str], Mapping[str, str]] = field(default_factory=dict)

    @property
    def included(self) -> tuple[str, ...]:
        """Subjects that enter the analyses."""
        return tuple(s for s in self.study.subjects if s not in self.study.exclude)

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages of the study, in their order: those that it names, or all that need no asking for."""
        asked = {name for name in stages.NAMES if stages.load(name).on_demand}
        named = self.study.stages or set(stages.NAMES) - set(self.left_out) - asked
        return tuple(name for name in stages.NAMES if name in named)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Stages that nobody named and that are about moves on the grid, of which this study's data have none."""
        if self.study.stages or self.sections["acquire"].moves:
            return ()
        return tuple(name for name in stages.NAMES if stages.load(name).moves)

    def section(self, stage: str, unit: str) -> Any:
        """Return a stage's options for a unit: a subject's own, or those of all."""
        return self.own.get(stage, {}).get(unit, self.sections[stage])


def load(
    path: Path | None = None,
    assignments: Sequence[str] = (),
    *,
    others: Mapping[str, Sequence[str]] | None = None,
    mistakes: Sequence[str] = (),
    folder: Path | None = None,
) -> Settings:
    """Return the configuration of a file (None: ./hrcneuro.toml, else the paper's) with ``--set`` assignments on top.

    A bare name is that of a configuration that comes with the program.

    ``others`` has the assignments that another option stands for, by its name, which mistakes are then told with;
    ``mistakes`` were found on the way to the assignments, and are told with those found here.

    Raises:
        ConfigError: Anything unknown, of a wrong type, out of range or contradictory; all of it at once.
        DataError: The disk fails on the file, or there is no data set at the place that is to name the subjects.
    """
    folder = folder or Path.cwd()
    # Also a folder of that name, or a link that leads nowhere: else the paper's values would take its place unseen.
    if path is None and os.path.lexists(folder / "hrcneuro.toml"):
        path = folder / "hrcneuro.toml"
    layers: list[tuple[Reader, dict[str, Any]]] = []
    if path is not None:
        path = shipped.find(path, shipped.CONFIGURATIONS)
        layers.append((Reader(str(path), path.parent), _read_toml(path)))
    others = others or {}
    named = {text.partition("=")[0].strip(): option for option, texts in others.items() for text in texts}
    setter = Reader("--set", folder, from_text=True, options=named)
    every = [*assignments, *(text for texts in others.values() for text in texts)]
    layers.append((setter, _read_assignments(every, setter)))

    parts: dict[str, Any] = {"study": StudyOptions(), "shared": Shared()}
    parts |= {name: stages.load(name).config() for name in stages.NAMES}
    parts |= {name: section.options() for name, section in SECTIONS.items()}
    origins: dict[str, str] = {}
    own: list[bysubject.Own] = []
    for reader, values in layers:
        own += bysubject.taken_out(reader, values)
        _apply(reader, values, parts, origins)
    of_data = dataset.complete(parts, origins) if parts["acquire"].source == "bids" else ()
    settings = bysubject.applied(_fill(parts, origins), own, layers[-1])
    if of_data:
        remarks = {**settings.remarks, "acquire": (*of_data, *settings.remarks.get("acquire", ()))}
        settings = dataclasses.replace(settings, remarks=remarks)
    found = [*mistakes, *(m for reader, _ in layers for m in reader.mistakes)]
    if not found:
        found, warnings = _consistency(settings)
        settings = dataclasses.replace(settings, warnings=tuple(warnings))
    if found:
        raise ConfigError(
            f"{len(found)} mistake{'s' * (len(found) > 1)} in the configuration:\n"
            + "\n".join(f"  - {m}" for m in found),
            cure="correct them; 'hrcneuro config show' prints every key with its value, range and origin",
        )
    return settings


def _apply(reader: Reader, values: Mapping[str, Any], parts: dict[str, Any], origins: dict[str, str]) -> None:
    tables = [f.name for f in dataclasses.fields(Shared)]
    allowed = ["study", *tables, *stages.NAMES, *SECTIONS]
    for name, table in values.items():
        if name not in allowed:
            hint = did_you_mean(name, allowed) or f"; allowed: {', '.join(allowed)}"
            reader.mistakes.append(f"{reader.source}: unknown section [{name}]{hint}")
        elif not isinstance(table, Mapping):
            reader.mistakes.append(f"{reader.source}: {name} = {table!r} is no table; write [{name}]")
        elif name in tables:
            parts["shared"], given = reader.record(parts["shared"], {name: table}, "")
            origins |= {key.lstrip("."): source for key, source in given.items()}
        else:
            parts[name], given = reader.record(parts[name], table, name)
            origins |= given


def _fill(parts: dict[str, Any], origins: dict[str, str]) -> Settings:
    """Put the shared tables into the stages' fields that ask for them."""
    common = {f.name: getattr(parts["shared"], f.name) for f in dataclasses.fields(Shared)}
    common["split"] = parts["study"].split
    sections = {}
    for name in stages.NAMES:
        asked = {f.name: f.metadata["shared"] for f in dataclasses.fields(parts[name]) if f.metadata.get("shared")}
        sections[name] = dataclasses.replace(parts[name], **{key: common[table] for key, table in asked.items()})
    around = {name: parts[name] for name in SECTIONS}
    return Settings(parts["study"], parts["shared"], sections, origins, live=around)


def _consistency(settings: Settings) -> tuple[list[str], list[str]]:
    from hrcneuro.config import crosschecks

    mistakes = [f"[{name}] {m}" for name in stages.NAMES for m in stages.load(name).check(settings.sections[name])]
    for name, subjects in settings.own.items():
        common = set(stages.load(name).check(settings.sections[name]))
        for subject, section in subjects.items():
            mistakes += [
                f"[{name}.subjects.{subject}] {m}" for m in stages.load(name).check(section) if m not in common
            ]
    mistakes += [f"[{name}] {m}" for name, section in SECTIONS.items() for m in section.check(settings.live[name])]
    mistakes += crosschecks.errors(settings)
    return mistakes, crosschecks.warnings(settings)


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return parse_toml(path)
    except FileNotFoundError as error:
        raise ConfigError(
            f"the configuration file {path} does not exist",
            cure="name an existing file, --config study.toml, or one that comes with the program, --config paper",
        ) from error
    except OSError as error:
        raise unreadable(path, error) from error


def _read_assignments(assignments: Sequence[str], reader: Reader) -> dict[str, Any]:
    values: dict[str, Any] = {}
    tables = [f.name for f in dataclasses.fields(Shared)]
    for text in assignments:
        name, equals, value = text.partition("=")
        keys = _keys(name.strip())
        least = 1 if keys[0] in tables else 2
        if not equals or len(keys) < least or not all(keys):
            reader.mistakes.append(f"--set {text!r} is no assignment; allowed: --set stage.key=value")
            continue
        table = values
        for key in keys[:-1]:
            inner = table.setdefault(key, Added())
            table = inner if isinstance(inner, dict) else Added()
        table[keys[-1]] = _toml_value(value.strip())
    reader.mistakes += _given_twice([text.partition("=")[0].strip() for text in assignments])
    return values


def _keys(name: str) -> list[str]:
    """Return the parts of a dotted name; one with a point or a space in it stands in quotes, as in TOML."""
    try:
        parts, table = [], tomllib.loads(f"{name} = 0")
        while isinstance(table, dict):
            ((key, table),) = table.items()
            parts.append(key)
        return parts
    except (tomllib.TOMLDecodeError, RecursionError):
        # A bare word may hold more here than in TOML.
        return name.split(".")


def _given_twice(names: Sequence[str]) -> list[str]:
    """Return the entries of a table of lists, such as the axes of a sweep, that more than one assignment gives.

    Of other options the last assignment holds.
    """
    mistakes = []
    for stage in stages.NAMES:
        options = dataclasses.fields(stages.load(stage).config)
        for table in (f"{stage}.{one.name}" for one in options if one.metadata.get("keys")):
            inside = [name for name in names if name == table or name.startswith(f"{table}.")]
            twice = [name for name in dict.fromkeys(inside) if inside.count(name) > 1]
            if table in inside and len(inside) > 1:
                twice = [table]
            mistakes += [f"{name} is given twice on the command line; allowed: each axis once" for name in twice]
    return mistakes


def _toml_value(text: str) -> Any:
    # A bare word or a path is no TOML value: it is the string itself.
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text
