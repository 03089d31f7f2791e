"""Where jobs run: in this process, or in worker processes on this machine. Each has the shape of concurrent.futures."""

from __future__ import annotations

import concurrent.futures as futures
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any, Protocol

from hrcneuro import work
from hrcneuro.errors import ConfigError, did_you_mean

NAMES = ("auto", "serial", "processes")


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


class Processes:
    """Runs jobs in worker processes; an interrupt ends them at once, and they end with their parent."""

    def __init__(self, workers: int) -> None:
        self.pool = futures.ProcessPoolExecutor(
            workers, mp_context=multiprocessing.get_context("spawn"), initializer=_start_worker
        )

    def submit(self, call: Callable[..., Any], /, *args: Any) -> futures.Future:
        """Queue ``call(*args)`` and return its future."""
        return self.pool.submit(call, *args)

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.pool.shutdown()
            return
        self.pool.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()


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
    work.one_thread()
    return Serial() if name == "serial" or (name == "auto" and workers == 1) else Processes(workers)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _start_worker() -> None:
    # The parent decides what an interrupt means; a worker must not die with a half-told story.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A clean end on terminate removes the temporary folder.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
