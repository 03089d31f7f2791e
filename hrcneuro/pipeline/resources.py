"""What a job on another machine may use: as the configuration says, else by what earlier runs have recorded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from hrcneuro.config.cluster import ClusterOptions, StageResources
from hrcneuro.contract import GROUP
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.measured import Measured, Place

# Where nothing has been recorded: a subject of the paper's size took 0.9 GB (docs/benchmarks.md) and some minutes.
_UNKNOWN_GB, _UNKNOWN_MIN = 2.0, 60
# Over what was recorded: another subject may be longer, another machine slower or busier.
_MORE_MEMORY, MORE_TIME = 1.5, 3.0
_LEAST_GB, _LEAST_MIN = 1.0, 5


@dataclass(frozen=True)
class Resources:
    """What a job may use, and how often it is sent again where it was lost."""

    memory_gb: float
    minutes: int
    retries: int

    def doubled(self, what: str) -> Resources:
        """Return twice the ``time`` or ``memory``, for a job that ran out of it; all else stays."""
        if what == "time":
            return replace(self, minutes=2 * self.minutes)
        return replace(self, memory_gb=2 * self.memory_gb) if what == "memory" else self


Kind = tuple[str, bool]
"""A stage's numbers or pictures, and whether they are of the group: it takes what no subject tells."""


def kind(task: Task) -> Kind:
    """Return the kind of a task."""
    return task.name, task.unit == GROUP


def most(known: Mapping[Place, Measured]) -> dict[Kind, Measured]:
    """Return the most that any unit of each kind took."""
    found: dict[Kind, Measured] = {}
    for (name, unit), one in known.items():
        of = name, unit == GROUP
        before = found.get(of, Measured())
        found[of] = Measured(max(before.seconds, one.seconds), max(before.peak_mb, one.peak_mb))
    return found


def resources(task: Task, options: ClusterOptions, known: Mapping[Kind, Measured]) -> Resources:
    """Return what a task's job may use: its stage's values, else those for all, else by what was recorded."""
    own = options.stages.get(task.subject, StageResources())
    last = known.get(kind(task))
    memory = _UNKNOWN_GB if last is None else max(_LEAST_GB, math.ceil(2 * _MORE_MEMORY * last.peak_mb / 1024) / 2)
    minutes = _UNKNOWN_MIN if last is None else max(_LEAST_MIN, math.ceil(MORE_TIME * last.seconds / 60))
    return Resources(
        memory_gb=own.memory_gb or options.memory_gb or memory,
        minutes=own.minutes or options.minutes or minutes,
        retries=retries(task, options),
    )


def retries(task: Task, options: ClusterOptions) -> int:
    """Return how often a task's job is sent again where its worker was lost: its stage's value, else that for all."""
    own = options.stages.get(task.subject, StageResources()).retries
    return options.retries if own < 0 else own
