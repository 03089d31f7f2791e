"""Jobs on other machines: each is sent there and, where it is lost on the way, again; its record comes by the cache.

What all engines share. An engine sends a trip and says what became of it: ``arrived`` with an answer, or ``lost``.
"""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import os
import secrets
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from hrcneuro.cache.record import Record
from hrcneuro.cache.store import Store
from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.errors import DataError, HrcError, StageError
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import Job, Outcome, execute
from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.worker import Answer, Ticket, run_folder

# A network's file system may show a new folder that long after it was made on another machine.
_SEEN_AFTER_S = 60.0


@dataclass(frozen=True)
class Site:
    """What an executor for other machines needs to know.

    Attributes:
        root: The cache, which all machines share.
        options: The section ``[cluster]``.
        resources: What a task's job may use.
        workers: How many jobs may run at a time; 0 for as many as the engine gives.
        tell: Is told what a person should know while the run goes on.
    """

    root: Path
    options: ClusterOptions
    resources: Callable[[Task], Resources]
    workers: int = 0
    tell: Callable[[str], None] = lambda text: None


@dataclass(eq=False)
class Trip:
    """A job on its way.

    Attributes:
        job: The job.
        resources: What it may use: more, once it ran out of that.
        future: Of its outcome.
        lost: Why it was sent again, each time.
        tries: How many of these count: to be preempted is no failure.
    """

    job: Job
    resources: Resources
    future: futures.Future = field(default_factory=futures.Future)
    lost: list[str] = field(default_factory=list)
    tries: int = 0


class Cluster(ABC):
    """Sends jobs to an engine that has workers on other machines; an executor of the pipeline."""

    def __init__(self, site: Site) -> None:
        self.site = site
        self.run = secrets.token_hex(8)
        self.folder = Path()
        self.under_way: set[Trip] = set()
        self._lock = threading.Lock()
        self._closed = False
        self._exits = contextlib.ExitStack()

    @abstractmethod
    def open(self) -> None:
        """Begin to work with the engine.

        Raises:
            ConfigError: It is not there, or does not answer.
        """

    @abstractmethod
    def send(self, trip: Trip) -> None:
        """Send a trip's job, again where it was lost."""

    @abstractmethod
    def close(self, *, interrupted: bool) -> None:
        """End the work with the engine; ``interrupted``: end what is under way there."""

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Send a job and return the future of its outcome; ``call`` is ``job.execute``: no other one travels."""
        if call is not execute:
            raise TypeError(f"{call} is no job of the pipeline")
        (job,) = args
        trip = Trip(job, self.site.resources(job.task))
        with self._lock:
            self.under_way.add(trip)
        self.send(trip)
        return trip.future

    def __enter__(self) -> Cluster:
        with contextlib.ExitStack() as exits:
            self.folder = exits.enter_context(run_folder(self.site.root, self.run))
            self.open()
            self._exits = exits.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closed = True
        with self._exits:
            self.close(interrupted=kind is not None)

    def ticket(self, trip: Trip, *, counted: bool) -> Ticket:
        """Return what travels; ``counted``: the worker gives up where the job has cost too many workers already.

        For engines that send a job again by themselves, and do not say so.
        """
        return Ticket(trip.job, self.run, trip.resources.retries + 1 if counted else 0)

    def arrived(self, trip: Trip, answer: Answer) -> None:
        """Settle a trip with its answer."""
        lost = answer.begun if answer.given_up else answer.begun - 1
        for text in answer.told:
            self.site.tell(f"{trip.job.task}: {text}")
        # Where the engine sent it again by itself.
        trip.lost += ["its worker was lost"] * (lost - len(trip.lost))
        if answer.given_up:
            self.fail(trip, _missing(trip))
        elif answer.error is not None:
            self._settle(trip, Outcome(State.FAILED, None, answer.seconds, answer.error, answer.trace))
        else:
            try:
                record = _record(trip.job)
            except HrcError as error:
                self.fail(trip, error)
            else:
                self._settle(trip, Outcome(answer.state, record, answer.seconds, pulled=answer.pulled))

    def lost(self, trip: Trip, reason: str, *, ran_out_of: str = "", preempted: bool = False) -> None:
        """Send a trip again that brought no answer, or settle it where it was lost too often.

        Args:
            trip: The trip.
            reason: Why, in words that go on from the task's name.
            ran_out_of: ``time`` or ``memory``, of which it is given twice as much.
            preempted: Whether the engine took its place for somebody else: that is no failure.
        """
        trip.lost.append(reason)
        trip.tries += not preempted
        if self._closed:
            return
        if trip.tries > trip.resources.retries:
            self.fail(trip, _missing(trip))
            return
        trip.resources = trip.resources.doubled(ran_out_of)
        self.send(trip)

    def missing(self, trip: Trip, reason: str) -> None:
        """Settle a trip that brought no answer and is not sent again."""
        trip.lost.append(reason)
        self.fail(trip, _missing(trip))

    def broken(self, trip: Trip, error: BaseException) -> None:
        """Settle a trip whose job the engine could not even begin."""
        if isinstance(error, ModuleNotFoundError):
            cure = "give the workers the same environment: pip install --constraint constraints.txt ."
            self.fail(trip, StageError(f"a worker has no module {error.name}", cure=cure))
            return
        problem = f"{trip.job.task} came to no result on a worker: {type(error).__name__}: {error}"
        self.fail(trip, StageError(problem, cure="look into the worker's log; --executor processes does without it"))

    def fail(self, trip: Trip, error: HrcError) -> None:
        """Settle a trip with an error that a person can act on."""
        self._settle(trip, Outcome(State.FAILED, error=error))

    def _settle(self, trip: Trip, outcome: Outcome) -> None:
        with self._lock:
            if trip not in self.under_way:
                return
            self.under_way.discard(trip)
        trip.future.set_result(Outcome(**{**vars(outcome), "lost": tuple(trip.lost)}))


def _missing(trip: Trip) -> StageError:
    task, counts = trip.job.task, {reason: trip.lost.count(reason) for reason in trip.lost}
    times = [f"{reason}{f', {n} times' if n > 1 else ''}" for reason, n in counts.items()]
    return StageError(
        f"{task} is missing: {'; '.join(times)}",
        cure="the same command goes on from here, with what is missing alone; where memory or time ran out, give more: "
        f"--set cluster.stages.{task.subject}.memory_gb=8, .minutes=120 or .retries=5",
    )


def _record(job: Job) -> Record:
    """Return the record of a job's entry, as this machine sees it in the cache.

    Raises:
        DataError: It does not appear.
    """
    store, place = Store(job.root), (job.task.name, job.task.unit, job.key)
    deadline = time.monotonic() + _SEEN_AFTER_S
    while (record := store.lookup(*place)) is None and time.monotonic() < deadline:
        # A folder that is listed is asked for anew on a network's file system.
        with contextlib.suppress(OSError):
            os.listdir(store.folder(*place).parent)
        time.sleep(0.2)
    if record is None:
        raise DataError(
            f"a worker says that {job.task} is done, and its entry is not in the cache {job.root}",
            cure="let all machines share one disk for the cache; the same command goes on from here",
        )
    return record
