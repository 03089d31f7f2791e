"""The stage graph: which tasks there are, what a command asks for, and what stands on what."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from hrcneuro import stages
from hrcneuro.config.settings import Settings
from hrcneuro.contract import Patterns
from hrcneuro.errors import ConfigError, did_you_mean

GROUP = "group"
# Excluded subjects stop here: their quality and outlier verdict belong in the report, their data in no analysis.
_BEFORE_EXCLUSION = ("acquire", "preprocess", "epoch")


@dataclass(frozen=True, order=True)
class Task:
    """A stage and the unit that it runs on."""

    rank: int
    unit: str
    stage: str = field(compare=False)

    @classmethod
    def of(cls, stage: str, unit: str) -> Task:
        """Return the task; tasks sort in the order in which people read them: by stage, group last."""
        return cls(2 * stages.NAMES.index(stage) + (unit == GROUP), unit, stage)


def needs(settings: Settings, task: Task) -> dict[Task, tuple[str, ...]]:
    """Return the tasks that a task reads from, and the file patterns that it reads."""
    stage = stages.load(task.stage)
    config = settings.sections[task.stage]
    parts = stage.parts(config) if hasattr(stage, "parts") else ()
    if task.unit in parts:
        return {}
    if hasattr(stage, "inputs"):
        patterns: Patterns = stage.inputs(config)
    else:
        patterns = stage.GROUP_INPUTS if task.unit == GROUP else stage.INPUTS
    units = settings.included if task.unit == GROUP else (task.unit,)
    found = {Task.of(name, unit): files for name, files in patterns.items() for unit in units}
    return found | {Task.of(task.stage, part): ("*",) for part in parts}


def targets(settings: Settings, names: Iterable[str], subjects: Iterable[str]) -> list[Task]:
    """Return the tasks that a command asks for: the named subjects, or everyone and the group.

    Raises:
        ConfigError: A stage or a subject is unknown, or a group stage is asked for one subject.
    """
    subjects = list(dict.fromkeys(subjects))
    for subject in subjects:
        if subject not in settings.study.subjects and subject != GROUP:
            # s1 is s01, however many letters it shares with s12.
            same = [s for s in settings.study.subjects if _unpadded(s) == _unpadded(subject)]
            hint = did_you_mean(subject, same or settings.study.subjects)
            raise ConfigError(
                f"unknown subject {subject!r}{hint}; the study has {', '.join(settings.study.subjects) or 'none'}",
                cure="name one of these, or add it to study.subjects",
            )
    found = []
    for name in names:
        check_stage(name)
        stage = stages.load(name)
        everyone = settings.study.subjects if name in _BEFORE_EXCLUSION else settings.included
        if not hasattr(stage, "run") and any(s != GROUP for s in subjects):
            raise ConfigError(f"{name} runs once for the whole group", cure=f"leave the subjects out: hrcneuro {name}")
        if not hasattr(stage, "run_group") and GROUP in subjects:
            raise ConfigError(f"{name} runs for subjects only", cure=f"name subjects, or none: hrcneuro {name}")
        if hasattr(stage, "run"):
            found += [Task.of(name, s) for s in (subjects or everyone) if s != GROUP]
        if hasattr(stage, "run_group") and (not subjects or GROUP in subjects):
            found.append(Task.of(name, GROUP))
    return found


def _unpadded(name: str) -> str:
    return re.sub(r"(?<!\d)0+(?=\d)", "", name.lower())


def check_stage(name: str) -> None:
    """Refuse a name that is no stage.

    Raises:
        ConfigError: With the nearest spelling.
    """
    if name not in stages.NAMES:
        hint = did_you_mean(name, stages.NAMES)
        raise ConfigError(f"unknown stage {name!r}{hint}", cure=f"stages: {', '.join(stages.NAMES)}")


def closure(settings: Settings, wanted: Iterable[Task]) -> dict[Task, dict[Task, tuple[str, ...]]]:
    """Return every task that the wanted ones stand on, with its needs, in an order that respects them."""
    found: dict[Task, dict[Task, tuple[str, ...]]] = {}
    todo = list(wanted)
    while todo:
        task = todo.pop()
        if task not in found:
            found[task] = needs(settings, task)
            todo += found[task]
    return {task: found[task] for task in sorted(found)}
