"""Where jobs run: in this process, or in worker processes on this machine. Each has the shape of concurrent.futures."""

from __future__ import annotations

import concurrent.futures as futures
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, Protocol

from hrcneuro.errors import ConfigError, StageError, did_you_mean
from hrcneuro.pipeline import job
from hrcneuro.pipeline.item import State

NAMES = ("auto", "serial", "processes")
# Long enough to unwind from a call into a numeric library, short enough for someone who pressed Ctrl-C.
_GRACE_S = 3.0
# Of a worker: it was told to end.
_leaving = threading.Event()


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
    """A worker process ended before its job did."""


class Processes:
    """Runs jobs in worker processes. A worker that dies takes only its own job with it and is replaced; an interrupt
    ends all of them within seconds, and they end with their parent.
    """

    def __init__(self, workers: int) -> None:
        # The resource tracker unblocks the interrupt in the thread that starts it; workers started there inherit that.
        resource_tracker.ensure_running()
        self._threads = futures.ThreadPoolExecutor(workers, initializer=_leave_interrupts_to_the_parent)
        self._own = threading.local()
        self._workers: list[_Worker] = []
        self._lock = threading.Lock()
        self._closed = False

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Queue ``call(*args)`` and return its future."""
        return self._threads.submit(self._do, call, *args)

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
            worker.dismiss() if kind is None else worker.process.terminate()
        deadline = time.monotonic() + _GRACE_S
        for worker in workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            worker.process.kill()
        self._threads.shutdown()

    def _do(self, call: Callable[..., Any], *args: Any) -> Any:
        worker = getattr(self._own, "worker", None)
        if worker is None or not worker.process.is_alive():
            with self._lock:
                if self._closed:
                    raise WorkerDied("the run is over")
                worker = self._own.worker = _Worker()
                self._workers.append(worker)
        return worker.do(call, args)


class _Worker:
    """A process that does one job after another, and the pipe to it."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        # A daemon: should this process end in an unforeseen way, Python still ends the worker.
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        # Its death is an end of file here, as nobody else holds that end.
        theirs.close()

    def do(self, call: Callable[..., Any], args: tuple) -> Any:
        """Return ``call(*args)``, computed there."""
        try:
            self.pipe.send((call, args))
            done, value = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join(_GRACE_S)
            raise WorkerDied(_end(self.process.exitcode)) from None
        if done:
            return value
        raise value

    def dismiss(self) -> None:
        """Let the worker end: it has nothing more to do."""
        self.pipe.close()


def create(name: str, workers: int) -> Executor:
    """Return an executor; ``auto`` means processes where more than one worker is asked for.

    Raises:
        ConfigError: The name is unknown or the number of workers is not positive.
    """
    if name not in NAMES:
        raise ConfigError(
            f"unknown executor {name!r}{did_you_mean(name, NAMES)}", cure=f"choose one of: {', '.join(NAMES)}"
        )
    if workers < 1:
        raise ConfigError(f"-j {workers} asks for no worker", cure="give -j a number of at least 1")
    job.one_thread()
    return Serial() if name == "serial" or (name == "auto" and workers == 1) else Processes(workers)


def outcome(future: futures.Future, name: str) -> job.Outcome:
    """Return what became of a submitted ``job.execute``, also where it never came back."""
    try:
        return future.result()
    except WorkerDied as death:
        error = StageError(
            f"the worker of {name} died: {death}",
            cure="if memory ran out, use fewer workers (-j 1); the same command goes on from here",
        )
    except Exception as unknown:
        error = StageError(
            f"{name} came to no result: {type(unknown).__name__}: {unknown}",
            cure="run it again with --executor serial --debug, and please report it as a bug",
        )
    return job.Outcome(State.FAILED, error=error)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _leave_interrupts_to_the_parent() -> None:
    # Threads hand their mask on to the processes that they start, from the first instruction: Ctrl-C reaches the
    # whole terminal, and a worker must not die with a half-told story while the parent decides what it means.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _serve(pipe: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end_cleanly)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        _answer(pipe)
    except Exception:
        # The exit of a worker told to end comes out of some places as another exception, such as those of an import.
        if not _leaving.is_set():
            raise
        sys.exit(1)


def _answer(pipe: Connection) -> None:
    while True:
        try:
            call, args = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, call(*args))
        except Exception as error:
            if _leaving.is_set():
                raise
            answer = (False, error)
        try:
            pipe.send(answer)
        except OSError:
            # The parent is gone: nobody waits for the answer.
            return
        except Exception as error:
            pipe.send((False, RuntimeError(f"the answer cannot travel between processes: {error}")))


def _end_cleanly(*_: object) -> None:
    # Unwinding removes the temporary folder; a second signal must not disturb that.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _leaving.set()
    sys.exit(1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _end(code: int | None) -> str:
    return f"it was ended by {signal.Signals(-code).name}" if code and code < 0 else f"it ended with exit code {code}"
