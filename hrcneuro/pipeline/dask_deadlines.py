"""How long jobs on dask's workers may run: dask has no time limit, so the run ends the worker of one that is late.

dask's "processing" counts what waits at a worker, too. What tells is the mark that a worker leaves as it begins a job.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro.pipeline.cluster import Dispatch
from hrcneuro.pipeline.worker import begun_as


@dataclass
class _Begun:
    """What is known of a dispatch: how many workers have begun it, which was the last, and when it was seen to."""

    marks: int = 0
    worker: str = ""
    since: float = 0.0


class Deadlines:
    """Tells which dispatches have run for longer than they may, and where."""

    def __init__(self) -> None:
        self._begun: dict[Dispatch, _Begun] = {}

    def over(self, folder: Path, sent: Mapping[Dispatch, Any], places: Mapping[str, str]) -> dict[Dispatch, str]:
        """Return the dispatches whose time has run out, and their workers.

        Args:
            folder: Of the run, with the workers' marks.
            sent: What is under way, and dask's future of each.
            places: The worker that has each of dask's keys, also where it waits there.
        """
        marks, now = _marks(folder), time.monotonic()
        late: dict[Dispatch, str] = {}
        for dispatch, future in sent.items():
            known = self._begun.setdefault(dispatch, _Begun())
            worker, begun = places.get(future.key, ""), marks[begun_as(dispatch.job)]
            if worker and begun > known.marks:
                self._begun[dispatch] = _Begun(begun, worker, now)
            elif worker and worker == known.worker and now - known.since > 60.0 * dispatch.resources.minutes:
                # It is sent again, and begins anew, perhaps on the same worker.
                known.worker = ""
                late[dispatch] = worker
        for settled in [one for one in self._begun if one.future.done()]:
            del self._begun[settled]
        return late


def places(client: Any) -> dict[str, str]:
    """Return the worker that has each key."""
    return {key: worker for worker, keys in client.processing().items() for key in keys}


def end_workers(client: Any, workers: Iterable[str], wait_s: float) -> None:
    """End workers: those with a nanny begin anew, others are gone. A call under way in a worker cannot be stopped."""
    for worker in workers:
        try:
            client.restart_workers([worker], timeout=wait_s, raise_for_error=False)
        except Exception:
            # It has no nanny.
            with contextlib.suppress(Exception):
                client.run(os._exit, 1, workers=[worker], wait=False, on_error="ignore")


def _marks(folder: Path) -> Counter[str]:
    try:
        return Counter(name.rpartition(".begun-")[0] for name in os.listdir(folder))
    except OSError:
        # The disk may answer the next time.
        return Counter()
