"""What a job on another machine may use: as the configuration says, else by what earlier runs have recorded."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from hrcneuro.config.cluster import ClusterOptions, StageResources
from hrcneuro.errors import DataError
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.workdir import Workdir

# Where nothing has been recorded: a subject of the paper's size took 0.9 GB (docs/benchmarks.md) and some minutes.
_UNKNOWN_GB, _UNKNOWN_MIN = 2.0, 60
# Over what was recorded: another subject may be longer, another machine slower or busier.
_MORE_MEMORY, _MORE_TIME = 1.5, 3.0
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


@dataclass(frozen=True)
class Measured:
    """The most that any unit of a stage took when it last ran."""

    peak_mb: float
    seconds: float


def measured(workdir: Workdir, tasks: Iterable[Task]) -> dict[str, Measured]:
    """Return what each stage, and its pictures, took at most, of those that have run."""
    most: dict[str, Measured] = {}
    for task in tasks:
        try:
            provenance = workdir.record(task.name, task.unit).provenance
        except DataError:
            continue
        peak_mb, seconds = provenance.get("peak_rss_mb"), provenance.get("seconds")
        if isinstance(peak_mb, int | float) and isinstance(seconds, int | float):
            before = most.get(task.name, Measured(0.0, 0.0))
            most[task.name] = Measured(max(before.peak_mb, peak_mb), max(before.seconds, seconds))
    return most


def resources(task: Task, options: ClusterOptions, known: Mapping[str, Measured]) -> Resources:
    """Return what a task's job may use: its stage's values, else those for all, else by what was recorded."""
    own = options.stages.get(task.subject, StageResources())
    last = known.get(task.name)
    memory = _UNKNOWN_GB if last is None else max(_LEAST_GB, math.ceil(2 * _MORE_MEMORY * last.peak_mb / 1024) / 2)
    minutes = _UNKNOWN_MIN if last is None else max(_LEAST_MIN, math.ceil(_MORE_TIME * last.seconds / 60))
    return Resources(
        memory_gb=own.memory_gb or options.memory_gb or memory,
        minutes=own.minutes or options.minutes or minutes,
        retries=options.retries if own.retries < 0 else own.retries,
    )
