"""Where jobs run: in this process, in worker processes on this machine (both here; ``on_processes`` runs a job again
whose worker died), or on other machines (``cluster``). Each has the shape of concurrent.futures.

The worker pool is our own. Held against pebble 5.2 and loky 3.7, which were given all that their public interfaces let
one add (``benchmarks/bench_pool.py``; docs/benchmarks.md has the figures), it is kept for three reasons:

1. A death costs one job. In loky any worker's death fails every job; in pebble so does one while the worker unpickles
   its first job, which is when it imports the stages: it dies with a lock that all workers share.
2. So does an odd answer. In both libraries one exception that cannot be unpickled breaks the pool for all jobs.
3. An interrupt ends all workers at once, and each removes its job's temporary folder. loky kills them and the folders
   stay; pebble ends one worker after the other, and each that is deep in a numeric library takes its own 3 s.
"""

from __future__ import annotations

import concurrent.futures as futures
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

from hrcneuro import interrupts, streams
from hrcneuro.errors import ConfigError, StageError, did_you_mean
from hrcneuro.pipeline import job
from hrcneuro.pipeline.item import State

if TYPE_CHECKING:
    from hrcneuro.pipeline.cluster import Site
    from hrcneuro.pipeline.graph import Task

ELSEWHERE = ("dask", "slurm")
"""Those whose workers are on other machines."""
NAMES = ("auto", "serial", "processes", *ELSEWHERE)
# Long enough to unwind from a call into a numeric library, short enough for someone who pressed Ctrl-C.
_GRACE_S = 3.0
_OF_A_TERMINAL = (signal.SIGINT, signal.SIGQUIT)
# In a worker: SIGTERM has come, and whatever exception comes out of a job now is due to that.
_terminated = threading.Event()


class Executor(Protocol):
    """What the pipeline asks of a place that runs jobs."""

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Start ``call(*args)`` and return its future."""

    def __enter__(self) -> Executor: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None: ...


class Serial:
    """Runs each job at once, in this process."""

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Run ``call(*args)`` now and return its finished future."""
        future: futures.Future = futures.Future()
        try:
            future.set_result(call(*args))
        except Exception as error:
            future.set_exception(error)
        return future

    def __enter__(self) -> Serial:
        return self

    def __exit__(self, *_: object) -> None:
        return None


class WorkerDied(Exception):
    """A worker process ended before its job did.

    Attributes:
        lost: Why the job had to be run again, each time; empty where nobody has counted.
    """

    def __init__(self, cause: str, *, lost: tuple[str, ...] = ()) -> None:
        super().__init__(cause)
        self.lost = lost


class Processes:
    """Runs jobs in worker processes. A worker that dies takes only its own job with it and is replaced; an interrupt
    ends all of them within seconds, and they end with their parent.
    """

    def __init__(self, workers: int) -> None:
        # The resource tracker unblocks the interrupt in the thread that starts it; workers started there inherit that.
        resource_tracker.ensure_running()
        # One thread a worker, asleep while its worker works: nothing polls, and no lock is shared between workers.
        self._threads = futures.ThreadPoolExecutor(workers, initializer=_block_interrupts)
        self._thread = threading.local()
        self._workers: list[_Worker] = []
        self._lock = threading.Lock()
        self._closed = False

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Queue ``call(*args)`` and return its future."""
        return self._threads.submit(self._run, call, *args)

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._threads.shutdown()
        with self._lock:
            self._closed = True
            workers = list(self._workers)
        self._threads.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.pipe.close() if kind is None else worker.process.terminate()
        deadline = time.monotonic() + _GRACE_S
        try:
            for worker in workers:
                worker.process.join(max(0.0, deadline - time.monotonic()))
        finally:
            # Also where someone presses Ctrl-C again: they do not want to wait.
            for worker in workers:
                worker.process.kill()
            self._threads.shutdown()

    def _run(self, call: Callable[..., Any], *args: Any) -> Any:
        worker = getattr(self._thread, "worker", None)
        if worker is None or not worker.process.is_alive():
            with self._lock:
                if self._closed:
                    raise WorkerDied("the run is over")
                worker = self._thread.worker = _Worker()
                self._workers.append(worker)
        return worker.run(call, args)


class _Worker:
    """A process that does one job after another, and the pipe to it."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, far_end = context.Pipe()
        # A daemon: should this process end in an unforeseen way, Python still ends the worker.
        self.process = context.Process(target=_work, args=(far_end,), daemon=True)
        self.process.start()
        # Nobody else holds that end now, so the worker's death is an end of file here.
        far_end.close()

    def run(self, call: Callable[..., Any], args: tuple) -> Any:
        """Return ``call(*args)``, computed in the worker.

        Raises:
            WorkerDied: The worker ended before it answered.
            Exception: What ``call`` raised.
        """
        try:
            self.pipe.send((call, args))
            message = self.pipe.recv_bytes()
        except (EOFError, OSError):
            self.process.join(_GRACE_S)
            raise WorkerDied(_cause(self.process.exitcode)) from None
        succeeded, value = pickle.loads(message)
        if succeeded:
            return value
        raise value


def create(
    name: str,
    workers: int,
    site: Callable[[], Site] | None = None,
    retries: Callable[[Task], int] = lambda task: 0,
) -> Executor:
    """Return an executor; ``auto`` means processes where more than one worker is asked for.

    Args:
        name: One of ``NAMES``.
        workers: How many jobs run at a time, on this machine; at least 1.
        site: Returns what those for other machines need to know.
        retries: Tells how often a task's job is run again whose worker process died.

    Raises:
        ConfigError: The name is unknown, or what an executor needs is not here.
    """
    if name not in NAMES:
        raise ConfigError(
            f"unknown executor {name!r}{did_you_mean(name, NAMES)}", cure=f"choose one of: {', '.join(NAMES)}"
        )
    job.one_thread()
    if name in ELSEWHERE:
        assert site is not None
        return _on_cluster(name, site())
    if name == "serial" or (name == "auto" and workers == 1):
        return Serial()
    from hrcneuro.pipeline.on_processes import LocalJobs

    return LocalJobs(workers, retries)


def _on_cluster(name: str, site: Site) -> Executor:
    # Loaded where they are asked for: both come with libraries of their own.
    if name == "dask":
        from hrcneuro.pipeline.on_dask import Dask

        return Dask(site)
    from hrcneuro.pipeline.on_slurm import Slurm

    return Slurm(site)


def outcome(future: futures.Future, name: str) -> job.Outcome:
    """Return what became of a submitted ``job.execute``, also where it never came back."""
    lost: tuple[str, ...] = ()
    try:
        return future.result()
    except WorkerDied as death:
        lost = death.lost
        error = StageError(
            f"the worker of {name} died: {death}",
            cure="if memory ran out, use fewer workers (-j 1); the same command goes on from here",
        )
    except Exception as unknown:
        error = StageError(
            f"{name} came to no result: {type(unknown).__name__}: {unknown}",
            cure="run it again with --executor serial --debug, and please report it as a bug",
        )
    return job.Outcome(State.FAILED, error=error, lost=lost)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _block_interrupts() -> None:
    # Threads hand their mask on to the processes that they start, from the first instruction: a key reaches the
    # whole terminal, and a worker must not die with a half-told story while the parent decides what it means.
    signal.pthread_sigmask(signal.SIG_BLOCK, _OF_A_TERMINAL)


def _work(pipe: Connection) -> None:
    """Run what comes through the pipe until its other end is closed; the life of a worker."""
    for number in _OF_A_TERMINAL:
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _exit_once)
    sys.unraisablehook = _ignored
    streams.prepare()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        _answer_all(pipe)
    except Exception:
        # Some places make another exception of an exit, such as those that import.
        if not _terminated.is_set():
            raise
        sys.exit(1)


def _answer_all(pipe: Connection) -> None:
    while True:
        try:
            message = pipe.recv_bytes()
        except (EOFError, OSError):
            return
        try:
            call, args = pickle.loads(message)
            answer = (True, call(*args))
        except Exception as error:
            if _terminated.is_set():
                raise
            answer = (False, error)
        try:
            pipe.send(answer)
        except OSError:
            # The parent is gone: nobody waits for the answer.
            return
        except Exception as error:
            pipe.send((False, RuntimeError(f"the answer cannot travel between processes: {error}")))


def _exit_once(*_: object) -> None:
    # Unwinding removes the temporary folder; a second signal must not disturb that.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _terminated.set()
    sys.exit(1)


def _ignored(unraisable: Any) -> None:
    """Where the signal came in a callback of Python's own, as of weak references, the exit is dropped: once more."""
    if _terminated.is_set() and issubclass(unraisable.exc_type, SystemExit):
        signal.signal(signal.SIGTERM, _exit_once)
        interrupts.again(signal.SIGTERM)
    else:
        sys.__unraisablehook__(unraisable)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _cause(exitcode: int | None) -> str:
    if exitcode and exitcode < 0:
        return f"it was ended by {signal.Signals(-exitcode).name}"
    return f"it ended with exit code {exitcode}"
