"""What a stage is, what a drawing is, and how both declare their options: all that the pipeline asks of either.

A stage (``hrcneuro/stages/NAME.py``) computes numbers; its file ends with ``STAGE = Stage(...)``. A drawing
(``hrcneuro/drawings/NAME.py``) makes pictures from artifacts alone, so that another colour computes nothing; its file
ends with ``DRAWINGS = Drawings(...)``. Both are handed the files that they declare, and nothing else.
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from hrcneuro.errors import DataError

GROUP = "group"
SWEEP = "sweep"
EVIDENCE = "evidence"
OF_ALL = (GROUP, SWEEP, EVIDENCE)
"""Units that are no subject: what is computed once, for all."""
ASKED_BY = {GROUP: "", SWEEP: " --sweep AXIS=VALUES", EVIDENCE: " --evidence FOLDER"}
"""What follows a stage's name on the command line that computes such a unit."""

Summary = dict[str, Any]


def is_piece(unit: str) -> bool:
    """Return whether a unit is a piece of a sweep, by its name, whatever the configuration asks for."""
    return unit.startswith(f"{SWEEP}-")


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    open_low: bool = False,
    choices: tuple[str, ...] = (),
    share: bool = False,
    keys: Mapping[str, Mapping[str, Any]] | None = None,
    path: bool = False,
    keyed: bool = True,
    recordings: bool = False,
    drawing: bool = False,
    private: bool = False,
    keyed_as: Callable[[Any], Any] | None = None,
    shared: str = "",
) -> Any:
    """Return a dataclass field with its limits.

    Args:
        default: The value without configuration. Lists are given as tuples, tables as dicts.
        help: One line for ``config show`` and the documentation.
        unit: Unit of a number, for people. Where it is %, a value of at most 1 is taken for a slip: a share was meant.
        low, high: Inclusive limits of a number, or of each number in a tuple.
        open_low: ``low`` itself is not allowed.
        choices: The allowed strings.
        share: A number of which 1 is the whole; what is given in percent is asked about.
        keys: Of a table of lists of numbers: key -> ``low``, ``high``, ``unit``, ``whole`` of its values. Other keys
            are mistakes, and so are a list without values and a value given twice.
        path: A file or folder; a relative one is taken from the folder of the file that names it.
        keyed: Whether it decides results. What only says where or how, as an address does, stays out of the cache key.
        recordings: Where that is written which nobody can make again: it may not lie in the cache.
        drawing: Only drawings read it: it is part of their keys and of no stage's.
        private: What tells of a lab, as an address does: neither it nor a hash, which could be guessed, is in a key, a
            record or a report.
        keyed_as: Of what is private: returns what stands for it in the key, of which nobody can be found out.
        shared: Name of a top-level table of the configuration from which this field is filled.
    """
    meta = dict(
        help=help, unit=unit, low=low, high=high, open_low=open_low, choices=choices, share=share, keys=keys, path=path,
        keyed=keyed, recordings=recordings, drawing=drawing, private=private, keyed_as=keyed_as, shared=shared,
    )  # fmt: skip
    if isinstance(default, dict):
        return field(default_factory=lambda: dict(default), metadata=meta)
    return field(default=default, metadata=meta)


def params(config: Any) -> dict[str, Any]:
    """Return the fields of a frozen Config that decide numbers, as JSON-able values."""
    return {f.name: _in_key(config, f) for f in dataclasses.fields(config) if _decides_numbers(f)}


def _in_key(config: Any, f: dataclasses.Field[Any]) -> Any:
    stands_for = f.metadata.get("keyed_as") or plain
    return stands_for(getattr(config, f.name))


def _decides_numbers(f: dataclasses.Field[Any]) -> bool:
    hidden = f.metadata.get("private") and not f.metadata.get("keyed_as")
    return bool(f.metadata.get("keyed", True)) and not f.metadata.get("drawing") and not hidden


def plain(value: Any) -> Any:
    """Return ``value`` as JSON-able types: dataclasses and mappings become dicts, tuples become lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return params(value)
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return str(value) if isinstance(value, Path) else value


def chosen(sections: Mapping[str, Any], names: tuple[str, ...]) -> SimpleNamespace:
    """Return the named options, ``"erp.channel"`` as ``.erp.channel``; any other one is not there to be read."""
    options: dict[str, dict[str, Any]] = {}
    for name in names:
        section, _, key = name.partition(".")
        options.setdefault(section, {})[key] = getattr(sections[section], key)
    return SimpleNamespace(**{section: SimpleNamespace(**values) for section, values in options.items()})


class Of(enum.Enum):
    """Whose entries a unit reads."""

    OWN = "own"  # the unit's own
    GROUP = "group"
    INCLUDED = "included"  # every subject's that enters the analyses
    EVERYONE = "everyone"  # excluded subjects', too


@dataclass(frozen=True)
class Read:
    """Files that a stage or a drawing reads of other entries.

    Attributes:
        stage: Who wrote them.
        files: Patterns of their names.
        of: Whose they are.
        required: Whether there is nothing to do where they are missing; else what is there is read.
    """

    stage: str
    files: tuple[str, ...]
    of: Of = Of.OWN
    required: bool = True


Reads = tuple[Read, ...]


class Sessions(enum.Enum):
    """How many units of a stage may run at a time."""

    SIDE_BY_SIDE = "side by side"
    ONE_AT_A_TIME = "one at a time"  # in real time, in the process that hears Ctrl-C
    ONE_A_COMMAND = "one a command"  # on something that is there only once: after a stop, nothing may move it again


@dataclass(frozen=True)
class Work:
    """What a stage computes for a unit.

    Attributes:
        run: ``run(config, files, out)`` writes the artifacts into the folder ``out`` and returns the JSON summary.
        reads: Which files of other entries it is handed; a function of the Config where that depends on it.
    """

    run: Callable[[Any, Inputs, Path], Summary]
    reads: Reads | Callable[[Any], Reads] = ()

    def needed(self, config: Any) -> Reads:
        """Return the files that it is handed with this configuration."""
        return self.reads(config) if callable(self.reads) else self.reads


@dataclass(frozen=True)
class SideResult:
    """A result of a stage that is there only where an option asks for it: a unit of its own beside the group.

    Attributes:
        unit: Its name: ``sweep``, ``evidence``.
        asked: Whether the configuration asks for it.
        run: Computes it, from the files of its pieces where it has some, which it reads under its own stage.
        options: Names of the options that it alone reads; no other unit of the stage does.
        place: The one of them that names what it is made from, where it is made from files of other people.
        parts: Names of the pieces into which it is cut, units of their own.
        run_part: Computes one piece, without inputs.
    """

    unit: str
    asked: Callable[[Any], bool]
    run: Callable[[Any, Inputs, Path], Summary]
    options: tuple[str, ...]
    place: str = ""
    parts: Callable[[Any], tuple[str, ...]] = lambda config: ()
    run_part: Callable[[Any, Inputs, Path], Summary] | None = None

    def owns(self, config: Any, unit: str) -> bool:
        """Return whether a unit is this result, or a piece of it."""
        return unit == self.unit or unit in self.parts(config)

    def work(self, unit: str) -> Callable[[Any, Inputs, Path], Summary]:
        """Return what computes this result, or a piece of it."""
        return self.run if unit == self.unit or self.run_part is None else self.run_part


@dataclass(frozen=True)
class Stage:
    """A stage.

    Attributes:
        name: Of its section in the configuration, its command and its folder in the cache.
        title: Of its chapter in the report.
        config: A frozen dataclass of :func:`option` fields.
        libraries: Distributions whose major.minor version decides the result.
        check: Returns sentences that say which values contradict each other.
        subject, group: What is computed for a subject, and for the group; one of them may be absent.
        sides: What is computed beside the group where an option asks for it.
        sources: Label -> external file that decides a unit's result.
        packages: Distributions of other people's code that the configuration names; their exact version decides the
            result.
        by_subject: Options of which a subject may have values of its own, under ``[STAGE.subjects.NAME]``.
        sessions: How many units may run at a time.
        notes: Returns what a person should know before anything of it runs.
        ready: Raises ConfigError where other people's code that the configuration names cannot be used, DataError where
            other people's data cannot; before anything runs, and where the configuration is checked.
        moves: Whether it is about moves on the grid, so that a study without any has no use for it.
        on_demand: Whether a study consists of it only where it names it (study.stages); its command runs it anyway.
    """

    name: str
    title: str
    config: type
    libraries: tuple[str, ...]
    check: Callable[[Any], list[str]]
    subject: Work | None = None
    group: Work | None = None
    sides: tuple[SideResult, ...] = ()
    sources: Callable[[Any, str], Mapping[str, Path]] = lambda config, unit: {}
    packages: Callable[[Any], tuple[str, ...]] = lambda config: ()
    by_subject: tuple[str, ...] = ()
    sessions: Callable[[Any], Sessions] = lambda config: Sessions.SIDE_BY_SIDE
    notes: Callable[[Any], list[str]] = lambda config: []
    ready: Callable[[Any], None] = lambda config: None
    moves: bool = False
    on_demand: bool = False

    def side(self, config: Any, unit: str) -> SideResult | None:
        """Return the result on the side that a unit is, or is a piece of; None for a subject and the group."""
        return next((one for one in self.sides if one.owns(config, unit)), None)

    def side_of(self, unit: str) -> SideResult | None:
        """Return the same by the unit's name, whatever the configuration asks for."""
        name = unit.partition("-")[0]
        return next((one for one in self.sides if one.unit == name), None)


@dataclass(frozen=True)
class Caption:
    """What is said of a picture.

    Attributes:
        text: What it shows.
        title: How a table of contents names it; empty for one that no table of contents names.
    """

    text: str
    title: str = ""


@dataclass(frozen=True)
class Drawing:
    """Pictures of a unit.

    Attributes:
        captions: File -> caption, in the order in which people see them; one that has no data is not written.
        reads: The files that it is handed: of its own entry, and of others where it joins stages.
        options: Names of the options that it may read, ``"erp.channel"``; they are its key's parameters.
        draw: ``draw(config, files, out)`` writes PNG and PDF into ``out``; ``config.erp.channel`` is an option. It may
            return ``{"warnings": [...]}``: what a person should know of the pictures.
    """

    captions: Mapping[str, Caption]
    reads: Reads
    options: tuple[str, ...]
    draw: Callable[[Any, Inputs, Path], Summary | None]


@dataclass(frozen=True)
class Drawings:
    """The drawings of a stage, or of several that a picture joins.

    Attributes:
        name: The stage's; a name of its own where it joins several.
        libraries: Distributions whose major.minor version decides the pictures.
        subject, group: What is drawn for a subject, and for the group.
        sides: Unit -> what is drawn for a result on the side, such as a sweep.
        chapter: The stage in whose chapter of the report they stand; their own where nothing is said.
    """

    name: str
    libraries: tuple[str, ...]
    subject: Drawing | None = None
    group: Drawing | None = None
    sides: Mapping[str, Drawing] = field(default_factory=dict)
    chapter: str = ""

    def of(self, unit: str) -> Drawing | None:
        """Return what is drawn for a unit."""
        return {GROUP: self.group, **self.sides}.get(unit, self.subject)


@dataclass(frozen=True)
class Inputs:
    """The files that one unit of work may read."""

    unit: str
    files: Mapping[str, Mapping[str, Mapping[str, Path]]]  # stage -> unit -> file name -> path

    @classmethod
    def of(cls, unit: str, **folders: Path | Mapping[str, Path]) -> Inputs:
        """Return the inputs found in folders: ``Inputs.of("s01", epoch=DIR)`` or ``of("group", erp={"s01": DIR})``."""
        by_stage = {stage: where if isinstance(where, Mapping) else {unit: where} for stage, where in folders.items()}
        return cls(
            unit,
            {
                stage: {one: {p.name: p for p in sorted(folder.iterdir())} for one, folder in units.items()}
                for stage, units in by_stage.items()
            },
        )

    def path(self, stage: str, name: str, *, unit: str | None = None) -> Path:
        """Return the path of an upstream file; ``{unit}`` in ``name`` stands for the unit.

        Raises:
            DataError: The upstream entry holds no such file.
        """
        unit = unit or self.unit
        name = name.format(unit=unit)
        have = self.files.get(stage, {}).get(unit, {})
        if name not in have:
            raise DataError(
                f"{stage} of {unit} has no file {name!r}; it has {', '.join(sorted(have)) or 'none'}",
                cure=f"rerun it: hrcneuro {stage} {unit} --force",
            )
        return have[name]

    def has(self, stage: str, name: str, *, unit: str | None = None) -> bool:
        """Return whether the upstream entry holds the file."""
        unit = unit or self.unit
        return name.format(unit=unit) in self.files.get(stage, {}).get(unit, {})

    def units(self, stage: str) -> tuple[str, ...]:
        """Return the subjects of a stage whose files are here, in the order of their names."""
        return tuple(sorted(unit for unit in self.files.get(stage, {}) if unit not in OF_ALL))
