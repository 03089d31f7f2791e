"""The section ``[cluster]``: what jobs on other machines may use, and how often what was lost is sent again.

It decides where and how, never a result: no key has any of it.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import stages
from hrcneuro.contract import option
from hrcneuro.errors import did_you_mean


@dataclass(frozen=True)
class StageResources:
    """What a job of one stage may use, where that differs from the others."""

    memory_gb: float = option(0.0, "memory of a job; 0: as for all", low=0.0, unit="GB")
    minutes: int = option(0, "time of a job; 0: as for all", low=0, unit="min")
    retries: int = option(-1, "how often a lost job is sent again; -1: as for all", low=-1, high=99)


@dataclass(frozen=True)
class ClusterOptions:
    """Where jobs run with ``--executor dask`` and ``--executor slurm``, and what they may use."""

    memory_gb: float = option(0.0, "memory of a job; 0: from what earlier runs have recorded", low=0.0, unit="GB")
    minutes: int = option(0, "time of a job; 0: from what earlier runs have recorded", low=0, unit="min")
    retries: int = option(
        2, "how often a job is sent again whose worker was lost, or ran out of time or memory", low=0, high=99
    )
    stages: dict[str, StageResources] = option({}, "stages that need other values, [cluster.stages.NAME]")
    scheduler: str = option(
        "", "address of a dask scheduler, as tcp://host:8786; empty: workers on this machine", private=True
    )
    wait_s: float = option(
        60.0, "so long a dask scheduler may be without any worker, or SLURM without an answer", low=1.0, unit="s"
    )
    partition: str = option("", "SLURM's partition; empty: its default")
    account: str = option("", "SLURM's account; empty: its default", private=True)
    sbatch: dict[str, str] = option({}, 'further options of sbatch, such as { qos = "low" }', private=True)


def check_cluster(options: ClusterOptions) -> list[str]:
    """Return what is wrong with the section: stages that there are none of."""
    return [
        f"there is no stage {name!r}{did_you_mean(name, stages.NAMES)}; stages: {', '.join(stages.NAMES)}"
        for name in options.stages
        if name not in stages.NAMES
    ]
