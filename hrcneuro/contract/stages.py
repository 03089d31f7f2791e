"""What a stage is: the work on a subject and on the group, what it reads, and what is known of it before it runs."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro.contract.inputs import Inputs, Reads

Summary = dict[str, Any]


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
