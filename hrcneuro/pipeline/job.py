"""One unit of work: lock its key, run the stage in a temporary folder, publish. This is what a worker process runs."""

from __future__ import annotations

import contextlib
import errno
import functools
import logging
import os
import platform
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from hrcneuro import drawings, stages
from hrcneuro.cache import fingerprint
from hrcneuro.cache.disk import explain_os_error
from hrcneuro.cache.locks import PATIENCE_S
from hrcneuro.cache.record import Record
from hrcneuro.cache.store import Store
from hrcneuro.contract import GROUP, Inputs, Sessions
from hrcneuro.errors import HrcError, StageError, of_the_system
from hrcneuro.pipeline import second_cache
from hrcneuro.pipeline.anonymous import anonymous
from hrcneuro.pipeline.graph import Task, drawing_of
from hrcneuro.pipeline.item import State

# Of glibc's malloc.h: from where on the heap is cut short behind its last block, and how many blocks may be mappings of
# their own, with what glibc begins with.
_M_TRIM_THRESHOLD, _M_MMAP_MAX = -1, -4
_NEVER, _MAPPINGS = 2**31 - 1, 65536


@dataclass(frozen=True)
class Job:
    """Everything that a worker needs; it travels between processes."""

    task: Task
    key: str
    parts: Mapping[str, Any]
    config: Any
    inputs: Inputs
    root: Path
    provenance: Mapping[str, Any] = field(default_factory=dict)
    force: bool = False
    quiet: bool = False
    patience_s: float = PATIENCE_S
    second_cache: str = ""


@dataclass(frozen=True)
class Outcome:
    """What became of a job: it was hit, has run or failed.

    Attributes:
        state: Which of these.
        record: Of its entry, where there is one.
        seconds: How long it took.
        error, trace: What it failed of, and where.
        pulled: Whether its entry came from the second cache.
        lost: Why it had to be sent to a worker again, each time.
    """

    state: State
    record: Record | None = None
    seconds: float = 0.0
    error: HrcError | None = None
    trace: str = ""
    pulled: bool = False
    lost: tuple[str, ...] = ()


def execute(job: Job, tell: Callable[[str], None] | None = None) -> Outcome:
    """Compute a job unless another process has just done so, and publish its entry.

    ``tell`` is told of what a person should know meanwhile; without it, that goes to standard error.
    """
    start, tell = time.perf_counter(), tell or partial(_tell, job)
    store, place = Store(job.root), (job.task.name, job.task.unit, job.key)
    try:
        with store.lock(*place, tell=tell, patience_s=job.patience_s):
            done = None if job.force else store.lookup(*place)
            if done is not None:
                return Outcome(State.HIT, done)
            if job.second_cache and not job.force:
                done = second_cache.take(job.second_cache, store, place, tell)
            if done is not None:
                return Outcome(State.HIT, done, pulled=True)
            record = _compute(job, store, start)
        return Outcome(State.RAN, record, time.perf_counter() - start)
    except HrcError as error:
        return Outcome(State.FAILED, None, time.perf_counter() - start, error, traceback.format_exc())
    except Exception as error:
        return Outcome(State.FAILED, None, time.perf_counter() - start, _unexpected(job, error), traceback.format_exc())


def _compute(job: Job, store: Store, start: float) -> Record:
    from threadpoolctl import threadpool_limits

    place, processor = (job.task.name, job.task.unit, job.key), time.process_time()
    keep_memory(growing=not job.task.draws and _in_real_time(job))
    call, libraries = work_of(job.task, job.config)
    with store.workspace(*place) as work, _overhear() as overheard:
        # One BLAS thread: results must not depend on how many cores a machine has, and subjects are the parallel axis.
        # What libraries print goes to standard error: on standard output it would spoil --json.
        with threadpool_limits(1), contextlib.redirect_stdout(sys.stderr):
            try:
                summary = call(job.config, job.inputs, work) or {}
            except OSError as error:
                raise _disk(error, job) from error
        provenance = {
            **job.provenance,
            "seconds": round(time.perf_counter() - start, 3),
            "cpu_seconds": round(time.process_time() - processor, 3),
            "peak_rss_mb": _peak_rss_mb(),
            "platform": f"{platform.system()} {platform.machine()}",
            "blas_threads": 1,
            "versions": {name: fingerprint.version(name) for name in libraries},
            "warnings": [anonymous(text, (str(job.root), str(job.root.parent))) for text in overheard()],
        }
        record = Record(*place, job.parts, {}, summary, provenance)
        return store.publish(record, work)


def _in_real_time(job: Job) -> bool:
    return stages.load(job.task.name).sessions(job.config) is not Sessions.SIDE_BY_SIDE


@contextlib.contextmanager
def _overhear() -> Iterator[Callable[[], list[str]]]:
    """Keep from the terminal what libraries warn of, by Python's warnings or in a log; yields what tells it so far."""
    logged: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: logged.append(f"{record.name}: {record.getMessage()}")  # type: ignore[method-assign]
    logging.getLogger().addHandler(handler)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("default")
            yield lambda: sorted({*logged, *(f"{w.category.__name__}: {w.message}" for w in caught)})
    finally:
        logging.getLogger().removeHandler(handler)


def work_of(task: Task, config: Any) -> tuple[Callable[[Any, Inputs, Path], Any], tuple[str, ...]]:
    """Return what computes or draws a task, and the libraries that it rests on."""
    if task.draws:
        return drawing_of(task).draw, drawings.load(task.subject).libraries
    stage = stages.load(task.name)
    if side := stage.side(config, task.unit):
        return side.work(task.unit), stage.libraries
    work = stage.group if task.unit == GROUP else stage.subject
    assert work is not None
    return work.run, stage.libraries


def _tell(job: Job, text: str) -> None:
    # Not through the parent: the serial one waits here itself.
    if not job.quiet and sys.stderr is not None:
        print(f"{job.task}: {text}", file=sys.stderr, flush=True)


def _disk(error: OSError, job: Job) -> Exception:
    of_the_disk = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
    return explain_os_error(error, job.root) if error.errno in of_the_disk else error


def of_memory(error: BaseException) -> bool:
    """Return whether an error says that memory ran out: Python's own, the system's, or that of loading a library."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    # The loader has no number for it, and numpy and scipy put their own words around its.
    words = ("failed to map segment", "cannot allocate memory")
    return isinstance(error, ImportError) and any(one in str(error).lower() for one in words)


def _unexpected(job: Job, error: Exception) -> HrcError:
    if of_memory(error):
        return StageError(f"{job.task} ran out of memory", cure="use fewer workers: -j 1")
    if (known := of_the_system(error)) is not None:
        return known
    if job.task.draws:
        return StageError(
            f"the pictures of {job.task.subject}, {job.task.unit}, failed: {type(error).__name__}: {error}",
            cure="the numbers stand; --debug shows the traceback; please report it as a bug",
        )
    return StageError(
        f"{job.task} failed unexpectedly: {type(error).__name__}: {error}",
        cure="run it again with --debug for the traceback; if the input is sound, please report it as a bug",
    )


def _peak_rss_mb() -> int:
    # The peak of the whole worker process so far, which is an upper bound for this unit.
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def keep_memory(*, growing: bool = False) -> bool:
    """Let this process keep the memory that it frees for what it asks for next; return whether the C library can.

    Stages need a gigabyte one after the other, and arrays of some megabytes come and go within them. As it stands,
    glibc gives each back to the system and takes the next one page by page, cleared: on a virtual machine whose host
    takes free pages away meanwhile, 2.5 s a gigabyte. The peak, which is what a worker is given, stays as it is.

    Args:
        growing: Large blocks are mappings of their own all the same, as they are without this: what a session on an
            arm writes down grows in place then, and is never copied within a control cycle.
    """
    mallopt = _mallopt()
    return mallopt is not None and bool(
        mallopt(_M_TRIM_THRESHOLD, _NEVER) and mallopt(_M_MMAP_MAX, _MAPPINGS if growing else 0)
    )


@functools.cache
def _mallopt() -> Callable[[int, int], int] | None:
    import ctypes

    try:
        found: Callable[[int, int], int] = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return None
    return found


def one_thread() -> None:
    """Ask the numeric libraries for one thread; they read this when they are first loaded."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
