"""Jobs on other machines: each is sent there and, where it is lost on the way, again; its record comes by the cache.

What all engines share. An engine sends a dispatch and says what became of it: ``arrived`` with an answer, or ``lost``.
It calls ``look_for_entries`` now and then, for answers whose entries this machine does not see yet.
"""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import os
import secrets
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
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
from hrcneuro.pipeline.measured import Measured
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
        notify: Is called with what a person should know while the run goes on.
    """

    root: Path
    options: ClusterOptions
    resources: Callable[[Task], Resources]
    workers: int = 0
    notify: Callable[[str], None] = lambda text: None


@dataclass(eq=False)
class Dispatch:
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
        self.under_way: set[Dispatch] = set()
        self._lock = threading.Lock()
        # Answers whose entries this machine does not see yet, and until when they are looked for.
        self._unseen: dict[Dispatch, tuple[Answer, float]] = {}
        self._closed = False
        self._exits = contextlib.ExitStack()

    @abstractmethod
    def open(self) -> None:
        """Begin to work with the engine.

        Raises:
            ConfigError: It is not there, or does not answer.
        """

    @abstractmethod
    def send(self, dispatch: Dispatch) -> None:
        """Send a dispatch's job, again where it was lost."""

    @abstractmethod
    def close(self, *, interrupted: bool) -> None:
        """End the work with the engine; ``interrupted``: end what is under way there."""

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Send a job and return the future of its outcome; ``call`` is ``job.execute``: no other one travels."""
        if call is not execute:
            raise TypeError(f"{call} is no job of the pipeline")
        (job,) = args
        dispatch = Dispatch(job, self.site.resources(job.task))
        with self._lock:
            self.under_way.add(dispatch)
        self.send(dispatch)
        return dispatch.future

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

    def ticket(self, dispatch: Dispatch, *, counted: bool) -> Ticket:
        """Return what travels; ``counted``: the worker gives up where the job has cost too many workers already.

        For engines that send a job again by themselves, and do not say so.
        """
        return Ticket(dispatch.job, self.run, dispatch.resources.retries + 1 if counted else 0)

    def arrived(self, dispatch: Dispatch, answer: Answer) -> None:
        """Settle a dispatch with its answer."""
        lost = answer.begun if answer.given_up else answer.begun - 1
        for text in answer.notes:
            self.site.notify(f"{dispatch.job.task}: {text}")
        # Where the engine sent it again by itself.
        dispatch.lost += ["its worker was lost"] * (lost - len(dispatch.lost))
        if answer.given_up:
            self.fail(dispatch, _missing(dispatch))
        elif answer.error is not None:
            self._settle(dispatch, Outcome(State.FAILED, None, answer.seconds, answer.error, answer.trace))
        else:
            self._unseen[dispatch] = (answer, time.monotonic() + _SEEN_AFTER_S)
            self._look_for(dispatch)

    def look_for_entries(self) -> None:
        """Settle the dispatches that have an answer and whose entries have appeared, or have not for too long."""
        for dispatch in list(self._unseen):
            self._look_for(dispatch)

    def _look_for(self, dispatch: Dispatch) -> None:
        answer, deadline = self._unseen.get(dispatch, (None, 0.0))
        if answer is None:
            return  # another thread has just settled it
        job, record = dispatch.job, _record(dispatch.job)
        if record is not None:
            self._settle(dispatch, Outcome(answer.state, record, answer.seconds, pulled=answer.pulled))
        elif time.monotonic() < deadline:
            return
        else:
            problem = f"a worker says that {job.task} is done, and its entry is not in the cache {job.root}"
            cure = "let all machines share one disk for the cache; the same command goes on from here"
            self.fail(dispatch, DataError(problem, cure=cure))
        self._unseen.pop(dispatch, None)

    def lost(self, dispatch: Dispatch, reason: str, *, ran_out_of: str = "", preempted: bool = False) -> None:
        """Send a dispatch again that brought no answer, or settle it where it was lost too often.

        Args:
            dispatch: The dispatch.
            reason: Why, in words that go on from the task's name.
            ran_out_of: ``time`` or ``memory``, of which it is given twice as much.
            preempted: Whether the engine took its place for somebody else: that is no failure.
        """
        if self._done_all_the_same(dispatch):
            return
        dispatch.lost.append(reason)
        dispatch.tries += not preempted
        if self._closed:
            return
        if dispatch.tries > dispatch.resources.retries:
            self.fail(dispatch, _missing(dispatch))
            return
        dispatch.resources = dispatch.resources.doubled(ran_out_of)
        self.send(dispatch)

    def missing(self, dispatch: Dispatch, reason: str) -> None:
        """Settle a dispatch that brought no answer and is not sent again."""
        if self._done_all_the_same(dispatch):
            return
        dispatch.lost.append(reason)
        self.fail(dispatch, _missing(dispatch))

    def _done_all_the_same(self, dispatch: Dispatch) -> bool:
        """Settle a dispatch whose worker was lost behind the publishing of its entry; return whether it was."""
        outcome = done_all_the_same(dispatch.job)
        if outcome is not None:
            self._settle(dispatch, outcome)
        return outcome is not None

    def broken(self, dispatch: Dispatch, error: BaseException, *, log: str = "") -> None:
        """Settle a dispatch whose job the engine could not even begin; ``log`` is the end of the worker's, if known."""
        if isinstance(error, ModuleNotFoundError):
            cure = "give the workers the same environment: pip install --constraint constraints.txt ."
            self.fail(dispatch, StageError(f"a worker has no module {error.name}", cure=cure))
            return
        problem = f"{dispatch.job.task} came to no result on a worker: {type(error).__name__}: {error}"
        if log:
            problem += f"; its log ends with: {log}"
        cure = "--executor processes does without workers elsewhere"
        self.fail(dispatch, StageError(problem, cure=cure if log else f"{cure}; where this one runs its log says more"))

    def fail(self, dispatch: Dispatch, error: HrcError) -> None:
        """Settle a dispatch with an error that a person can act on."""
        self._settle(dispatch, Outcome(State.FAILED, error=error))

    def _settle(self, dispatch: Dispatch, outcome: Outcome) -> None:
        with self._lock:
            if dispatch not in self.under_way:
                return
            self.under_way.discard(dispatch)
        dispatch.future.set_result(Outcome(**{**vars(outcome), "lost": tuple(dispatch.lost)}))


def done_all_the_same(job: Job) -> Outcome | None:
    """Return the outcome of a job whose worker was lost behind the publishing of its entry; None: it was not."""
    # A forced job's key may have had an entry before.
    record = None if job.force else _record(job)
    return None if record is None else Outcome(State.RAN, record, Measured.of(record).seconds)


def counted(reasons: Sequence[str]) -> str:
    """Return reasons in a person's words, each once: ``its 10 min ran out; its node failed, 2 times``."""
    counts = {reason: reasons.count(reason) for reason in reasons}
    return "; ".join(f"{reason}{f', {n} times' if n > 1 else ''}" for reason, n in counts.items())


def _missing(dispatch: Dispatch) -> StageError:
    task = dispatch.job.task
    stage = f"cluster.stages.{task.subject}"
    return StageError(
        f"{task} is missing: {counted(dispatch.lost)}",
        cure="the same command goes on from here, with what is missing alone; where memory or time ran out, give more: "
        f"--set {stage}.memory_gb=8 --set {stage}.minutes=120 --set {stage}.retries=5",
    )


def _record(job: Job) -> Record | None:
    """Return the record of a job's entry, or None where this machine does not see it in the cache."""
    store, place = Store(job.root), (job.task.name, job.task.unit, job.key)
    # A folder that is listed is asked for anew on a network's file system.
    with contextlib.suppress(OSError):
        os.listdir(store.folder(*place).parent)
    try:
        return store.lookup(*place)
    except (HrcError, OSError):
        # The disk may answer the next time.
        return None
