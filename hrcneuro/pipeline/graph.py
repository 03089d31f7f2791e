"""The graph: which tasks there are, what a command asks for, and what stands on what."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from hrcneuro import drawings, stages
from hrcneuro.cache.formats import Formats
from hrcneuro.config.settings import Settings
from hrcneuro.contract import GROUP, OF_ALL, Drawing, Of, Reads, Sessions
from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.pipeline.workdir import FIGURES

FORMATS: Formats = {
    ".fif": (b"\x00\x00\x00\x64\x00\x00\x00\x1f", b""),
    ".parquet": (b"PAR1", b"PAR1"),
    ".npz": (b"PK\x03\x04", b""),
    ".png": (b"\x89PNG\r\n\x1a\n", b""),
    ".pdf": (b"%PDF-", b""),
    ".json": (b"", b""),
}
"""What stages and drawings write, by suffix: the bytes that it begins and ends with. Nothing of it is run as code."""
# Excluded subjects stop here: their quality and outlier verdict belong in the report, their data in no analysis.
_BEFORE_EXCLUSION = ("acquire", "preprocess", "epoch")


class Task(NamedTuple):
    """A stage, or its pictures, and the unit that it runs on.

    Tasks sort in the order in which people read them: by stage, the group last, pictures behind all numbers.
    """

    rank: int
    unit: str
    name: str

    @classmethod
    def of(cls, stage: str, unit: str) -> Task:
        """Return the task that computes a unit of a stage."""
        return cls(2 * stages.NAMES.index(stage) + (unit in OF_ALL), unit, stage)

    @classmethod
    def drawing(cls, name: str, unit: str) -> Task:
        """Return the task that draws a unit's pictures."""
        return cls(2 * (len(stages.NAMES) + drawings.NAMES.index(name)) + (unit in OF_ALL), unit, name + FIGURES)

    @property
    def draws(self) -> bool:
        """Whether it makes pictures, of which no other task reads."""
        return self.name.endswith(FIGURES)

    @property
    def subject(self) -> str:
        """The stage that it computes or draws; of pictures that join stages, their name."""
        return self.name.removesuffix(FIGURES)

    def __str__(self) -> str:
        return f"{self.name} of {self.unit}"


@dataclass(frozen=True)
class Need:
    """What a task reads of another: patterns of file names, and whether it can do without."""

    files: tuple[str, ...]
    required: bool = True


Needs = Mapping[Task, Need]
Graph = Mapping[Task, Needs]


def needs(settings: Settings, task: Task) -> Needs:
    """Return the tasks that a stage's task reads from."""
    stage = stages.load(task.name)
    config = settings.sections[task.name]
    if side := stage.side(config, task.unit):
        parts = side.parts(config) if task.unit == side.unit else ()
        return {Task.of(task.name, part): Need(("*",)) for part in parts}
    work = stage.group if task.unit == GROUP else stage.subject
    return _resolved(settings, work.needed(config), task.unit) if work else {}


def targets(settings: Settings, names: Iterable[str], subjects: Iterable[str]) -> list[Task]:
    """Return the tasks that a command asks for: the named subjects, or everyone and the group.

    Raises:
        ConfigError: A stage or a subject is unknown, or a group stage is asked for one subject.
    """
    subjects = list(dict.fromkeys(subjects))
    for subject in subjects:
        if subject != GROUP:
            check_subject(settings, subject)
    tasks = []
    for name in names:
        check_stage(name)
        stage = stages.load(name)
        everyone = settings.study.subjects if name in _BEFORE_EXCLUSION else settings.included
        if not stage.subject and any(s != GROUP for s in subjects):
            raise ConfigError(f"{name} runs once for the whole group", cure=f"leave the subjects out: hrcneuro {name}")
        if not stage.group and GROUP in subjects:
            raise ConfigError(f"{name} runs for subjects only", cure=f"name subjects, or none: hrcneuro {name}")
        if stage.subject:
            tasks += [Task.of(name, s) for s in (subjects or everyone) if s != GROUP]
        if stage.group and (not subjects or GROUP in subjects):
            tasks.append(Task.of(name, GROUP))
            tasks += [Task.of(name, side.unit) for side in stage.sides if side.asked(settings.sections[name])]
    return tasks


def _unpadded(name: str) -> str:
    return re.sub(r"(?<!\d)0+(?=\d)", "", name.lower())


def check_subject(settings: Settings, subject: str) -> None:
    """Refuse a subject that the study does not have.

    Raises:
        ConfigError: With the nearest name.
    """
    known = settings.study.subjects
    if subject not in known:
        # s1 is s01, however many letters it shares with s12.
        same = [s for s in known if _unpadded(s) == _unpadded(subject)]
        raise ConfigError(
            f"unknown subject {subject!r}{did_you_mean(subject, same or known)}; the study has "
            f"{', '.join(known) or 'none'}",
            cure="name one of these, or add it to study.subjects",
        )


def check_stage(name: str, *, joint: bool = False) -> None:
    """Refuse a name that is no stage; ``joint`` allows those of pictures that join stages, too.

    Raises:
        ConfigError: With the nearest spelling.
    """
    known = (*stages.NAMES, *(drawings.JOINT if joint else ()))
    if name not in known:
        raise ConfigError(f"unknown stage {name!r}{did_you_mean(name, known)}", cure=f"stages: {', '.join(known)}")


def closure(settings: Settings, wanted: Iterable[Task]) -> dict[Task, Needs]:
    """Return every task that the wanted ones stand on, with its needs, in an order that respects them."""
    graph: dict[Task, Needs] = {}
    todo = list(wanted)
    while todo:
        task = todo.pop()
        if task not in graph:
            graph[task] = needs(settings, task)
            todo += graph[task]
    return {task: graph[task] for task in sorted(graph)}


def in_real_time(settings: Settings, tasks: Collection[Task]) -> bool:
    """Return whether any of the tasks moves an arm in real time.

    Raises:
        ConfigError: Several would move the one arm: after a stop, the next session would move it with nobody asked.
    """
    arms = list(_arms(settings, tasks))
    for name, units, sessions in arms:
        if sessions is Sessions.ONE_A_COMMAND and len(units) > 1:
            raise _one_arm(settings, name, units)
    return bool(arms)


def check_unattended(settings: Settings, tasks: Collection[Task]) -> None:
    """Refuse tasks that move an arm in real time where an engine of others orders them.

    It starts one after the other, some at the same time, and what failed once more: nobody has been asked.

    Raises:
        ConfigError: There are such tasks.
    """
    for name, units, _ in _arms(settings, tasks):
        raise _one_arm(settings, name, units)


def _arms(settings: Settings, tasks: Collection[Task]) -> Iterator[tuple[str, list[str], Sessions]]:
    """Yield each stage that moves an arm in real time, its units among the tasks, and how many may run at a time."""
    for name in stages.NAMES:
        units = [task.unit for task in tasks if task.name == name]
        sessions = stages.load(name).sessions(settings.sections[name]) if units else Sessions.SIDE_BY_SIDE
        if sessions is not Sessions.SIDE_BY_SIDE:
            yield name, units, sessions


def _one_arm(settings: Settings, name: str, units: list[str]) -> ConfigError:
    number = f"{len(units)} subjects are" if len(units) > 1 else "a subject is"
    return ConfigError(
        f"{name}.backend = {settings.sections[name].backend!r} drives one arm in real time, and {number} asked of it "
        f"({', '.join(units)}); allowed: one subject a command",
        cure=f"hrcneuro {name} {units[0]} with the same options, then the next; a pipeline, or a Snakefile, leaves "
        f"{name} out of study.stages",
    )


def pictures(settings: Settings, graph: Graph, *, joint: bool) -> dict[Task, Needs]:
    """Return the drawings that a graph of numbers allows, with their needs.

    Args:
        settings: The configuration.
        graph: Tasks that compute numbers.
        joint: Whether those that join stages are wanted, too.
    """
    drawable: dict[Task, Needs] = {}
    for name in drawings.NAMES if joint else drawings.STAGES:
        drawn = drawings.load(name)
        if drawn.subject:
            for task in graph:
                if task.name == name and task.unit != GROUP and not _on_the_side(settings, task):
                    _allow(drawable, Task.drawing(name, task.unit), drawn.subject, settings, graph)
        if drawn.group:
            _allow(drawable, Task.drawing(name, GROUP), drawn.group, settings, graph)
        for unit, drawing in drawn.sides.items():
            _allow(drawable, Task.drawing(name, unit), drawing, settings, graph)
    return drawable


def _allow(allowed: dict[Task, Needs], task: Task, drawing: Drawing, settings: Settings, graph: Graph) -> None:
    wanted = _resolved(settings, drawing.reads, task.unit)
    here = {source: need for source, need in wanted.items() if source in graph}
    if here and all(source in graph for source, need in wanted.items() if need.required):
        allowed[task] = here


def _on_the_side(settings: Settings, task: Task) -> bool:
    return stages.load(task.name).side(settings.sections[task.name], task.unit) is not None


def _resolved(settings: Settings, reads: Reads, unit: str) -> dict[Task, Need]:
    # Each asked for where it is read: to name all subjects for every subject takes longer than all else of a graph.
    units: dict[Of, Callable[[], tuple[str, ...]]] = {
        Of.OWN: lambda: (unit,),
        Of.GROUP: lambda: (GROUP,),
        Of.INCLUDED: lambda: settings.included,
        Of.EVERYONE: lambda: settings.study.subjects,
    }
    merged: dict[Task, Need] = {}
    for read in reads:
        for one in units[read.of]():
            task = Task.of(read.stage, one)
            before = merged.get(task, Need((), False))
            merged[task] = Need((*before.files, *read.files), before.required or read.required)
    return merged


def drawing_of(task: Task) -> Drawing:
    """Return the drawing that a task of pictures makes: a subject's, the group's or one on the side."""
    drawing = drawings.load(task.subject).of(task.unit)
    assert drawing is not None
    return drawing
