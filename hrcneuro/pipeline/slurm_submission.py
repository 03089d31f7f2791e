"""Arrays of jobs for SLURM: which jobs go together, how submitit submits them, what sbatch says where it takes none."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.pipeline.cluster import Dispatch
from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.slurm_job import WARNED_MIN, WARNED_S, in_a_job
from hrcneuro.pipeline.worker import Ticket

LONGEST = 1000
"""SLURM takes no longer arrays where nobody has told it to (MaxArraySize)."""
# What sbatch says where its server is busy or away for a moment. All else is taken for a refusal, which stays.
_BUSY = (
    "socket timed out", "unable to contact slurm controller", "zero bytes were transmitted", "connection refused",
    "connection timed out", "communication connection failure", "resource temporarily unavailable", "standby mode",
    "transport endpoint", "send/recv operation", "too many open files", "stale file handle",
)  # fmt: skip
# What it says before the general words on a policy, of which the time and the size of a job are others.
_CROWDED = "submitjob"


class NotTaken(Exception):
    """SLURM has not taken an array; the message is what it says.

    Attributes:
        busy: Whether the same array may be taken a moment later.
        crowded: Whether the user has as many jobs there as a limit allows, also of other runs.
    """

    def __init__(self, said: str) -> None:
        super().__init__(said)
        self.busy = any(words in said.lower() for words in _BUSY)
        self.crowded = _CROWDED in said.lower()


def alike(dispatches: Iterable[Dispatch]) -> list[list[Dispatch]]:
    """Return dispatches in groups of one stage that may use the same."""
    groups: dict[Any, list[Dispatch]] = {}
    for one in dispatches:
        groups.setdefault((one.job.task.name, one.resources), []).append(one)
    return list(groups.values())


def submit(
    submitit: Any,
    folder: Path,
    tickets: Sequence[Ticket],
    what: Resources,
    options: ClusterOptions,
    *,
    workers: int = 0,
) -> list[Any]:
    """Submit tickets of one stage as one array and return submitit's jobs, in their order.

    Args:
        submitit: The module.
        folder: For tickets, answers and logs; its owner alone may write it.
        tickets: What the jobs do.
        what: What each may use.
        options: The section ``[cluster]``.
        workers: How many may run at a time; 0 for as many as SLURM gives.

    Raises:
        NotTaken: SLURM takes none of them.
    """
    try:
        engine = submitit.SlurmExecutor(folder)
        engine.update_parameters(
            job_name=f"hrcneuro-{tickets[0].job.task.name}",
            time=what.minutes + WARNED_MIN,
            # sbatch takes whole numbers alone.
            mem=f"{math.ceil(1024 * what.memory_gb)}MB",
            cpus_per_task=1,
            ntasks_per_node=1,
            array_parallelism=workers or LONGEST,
            signal_delay_s=WARNED_S,
            **({"partition": options.partition} if options.partition else {}),
            **({"account": options.account} if options.account else {}),
            additional_parameters=dict(options.sbatch),
        )
        with engine.batch():
            return [engine.submit(in_a_job, ticket, what.minutes) for ticket in tickets]
    except Exception as error:
        _remove_unused(folder)
        lines = str(error).splitlines() or [type(error).__name__]
        raise NotTaken("; ".join(line.removeprefix("sbatch: ").removeprefix("error: ") for line in lines)) from error


def _remove_unused(folder: Path) -> None:
    """Remove the tickets of an array that was not taken: one that is tried for hours would fill the disk."""
    for path in folder.glob("*.pkl"):
        # What was taken has the number of its job before a line below.
        if "_" not in path.name:
            with contextlib.suppress(OSError):
                path.unlink()
