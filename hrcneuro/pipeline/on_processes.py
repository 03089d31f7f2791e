"""Jobs in worker processes on this machine: one whose worker died is done by another one, as often as it may be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hrcneuro.pipeline.cluster import counted, done_all_the_same
from hrcneuro.pipeline.executors import Processes, WorkerDied
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.job import Job, execute


class LocalJobs(Processes):
    """Runs jobs of the pipeline in worker processes, again where a worker died: memory may have run out for a moment.

    Others need not wait meanwhile: who waits for a job's worker is the thread that starts the next one.
    """

    def __init__(self, workers: int, retries: Callable[[Task], int]) -> None:
        """Start no worker yet; ``retries`` tells how often a task's job may be run again."""
        super().__init__(workers)
        self._retries = retries

    def _run(self, call: Callable[..., Any], *args: Any) -> Any:
        if call is not execute:
            raise TypeError(f"{call} is no job of the pipeline")
        job: Job = args[0]
        died: list[str] = []
        while True:
            try:
                outcome = super()._run(call, job)
            except WorkerDied as death:
                if self._closed:
                    raise
                # What it had published before it died is not run again.
                outcome = done_all_the_same(job)
                if outcome is None:
                    died.append(str(death))
                    if len(died) > self._retries(job.task):
                        raise WorkerDied(counted(died), lost=_lost(died)) from None
                    continue
            return replace(outcome, lost=_lost(died))


def _lost(died: list[str]) -> tuple[str, ...]:
    return tuple(f"its worker died: {cause}" for cause in died)
