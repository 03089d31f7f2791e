"""What a worker on another machine does with a job: it looks whether it stands where the run does, then computes.

A ticket travels there and an answer back; data go by the cache alone, which both must see. A worker that sees another
cache, or has other code or libraries than the key says, computes nothing: its result would lie under a false key.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

from hrcneuro.cache import fingerprint, why
from hrcneuro.cache.disk import guarded, make_folder, read_file, remove, share
from hrcneuro.errors import ConfigError, HrcError
from hrcneuro.pipeline import job as jobs
from hrcneuro.pipeline import keys, second_cache
from hrcneuro.pipeline.item import State

RUNS = ".runs"
"""Folder of the cache with one for each run that has workers elsewhere."""
MARK = "mark"
_KEPT_S = 30 * 86400.0
# A worker of dask may have several threads; warnings, standard output and BLAS's threads are the whole process's.
_one_at_a_time = threading.Lock()


@dataclasses.dataclass(frozen=True)
class Ticket:
    """A job on its way to a worker.

    Attributes:
        job: The job.
        run: Name of the run's folder in the cache.
        tries: How many workers it may cost; 0 where somebody else counts.
    """

    job: jobs.Job
    run: str
    tries: int = 0


@dataclasses.dataclass(frozen=True)
class Answer:
    """What became of a job; its record is read from the cache.

    Attributes:
        state: Hit, run or failed.
        begun: How many workers have begun the job, with this one.
        seconds: How long it took.
        error, trace: What it failed of, and where.
        pulled: Whether its entry came from the second cache.
        notes: What a person should know of it besides.
        given_up: Whether it was not begun once more, as all workers that had begun it were lost.
    """

    state: State
    begun: int = 1
    seconds: float = 0.0
    error: HrcError | None = None
    trace: str = ""
    pulled: bool = False
    notes: tuple[str, ...] = ()
    given_up: bool = False


def work(ticket: Ticket) -> Answer:
    """Compute a ticket's job in this process and publish its entry."""
    job = ticket.job
    notes: list[str] = []
    try:
        _see_the_run(ticket)
        with _one_at_a_time:
            begun = _begin(ticket)
            if ticket.tries and begun > ticket.tries:
                return Answer(State.FAILED, begun - 1, given_up=True)
            _be_alike(job)
            if not job.second_cache:
                # Its address does not travel where it has a password.
                job = dataclasses.replace(job, second_cache=second_cache.named(None))
            outcome = jobs.execute(job, notes.append)
    except HrcError as error:
        return Answer(State.FAILED, error=error)
    return Answer(
        outcome.state, begun, outcome.seconds, outcome.error, outcome.trace, pulled=outcome.pulled, notes=tuple(notes)
    )


@contextlib.contextmanager
def run_folder(root: Path, run: str) -> Iterator[Path]:
    """Yield the folder of a run in the cache at ``root``: what workers elsewhere look for; it is gone afterwards."""
    folder = root / RUNS / run
    with guarded(root):
        make_folder(folder, root)
        (folder / MARK).write_text(run, encoding="utf-8")
        share(folder / MARK, root)
    drop_old(folder)
    try:
        yield folder
    finally:
        with contextlib.suppress(OSError):
            remove(folder)


def drop_old(mine: Path) -> None:
    """Remove the folders beside ours that killed runs have left; jobs of a younger one may still be under way.

    How old one is the disk's own clock says, which has just dated ours: this machine's may go wrong by years.
    """
    for folder in mine.parent.glob("*"):
        with contextlib.suppress(OSError):
            if mine.stat().st_mtime - folder.stat().st_mtime > _KEPT_S:
                remove(folder)


def _see_the_run(ticket: Ticket) -> None:
    """Refuse to work where the run's own file is not to be seen.

    Raises:
        ConfigError: This is another cache, or none.
    """
    root = ticket.job.root
    try:
        seen = read_file(root / RUNS / ticket.run / MARK).decode(errors="replace")
    except OSError as error:
        raise ConfigError(
            f"a worker does not see the run's file in the cache {root}: {error.strerror}",
            cure="give all machines the same cache under the same path, on a disk that they share: --workdir DIR or "
            "HRCNEURO_CACHE; where the run has ended already, nothing is to do",
        ) from error
    if seen != ticket.run:
        raise ConfigError(f"a worker sees another file in the cache {root}", cure="let all machines share one disk")


def _begin(ticket: Ticket) -> int:
    """Note that a worker begins the job; return how many have, with this one."""
    folder, count = ticket.job.root / RUNS / ticket.run, 1
    while True:
        path = folder / f"{begun_as(ticket.job)}.begun-{count}"
        try:
            path.open("x").close()
        except FileExistsError:
            count += 1
        except OSError:
            # It only counts; what comes next fails of the same disk, and says it.
            return count
        else:
            share(path, ticket.job.root)
            return count


def _be_alike(job: jobs.Job) -> None:
    """Refuse to work with other code or libraries than those in the job's key.

    Raises:
        ConfigError: They differ, or have changed since this process loaded them.
    """
    if changed := _changed(job.parts["code"]):
        raise ConfigError(
            f"the program's code has changed since a worker began ({', '.join(changed)}); it would compute with what "
            "it has loaded before",
            cure="start the workers anew",
        )
    memo = fingerprint.Memo(job.root / ".memo.json")
    here = {**job.parts, **keys.installed(job.task, job.config, memo)}
    if causes := why.causes(job.parts, here):
        raise ConfigError(
            f"a worker's installation differs from that of the run: {'; '.join(causes)}",
            cure="give all machines one environment: pip install --constraint constraints.txt .",
        )


def _changed(modules: Iterable[str]) -> list[str]:
    """Return the modules whose files are others than when this process did its first job."""
    first, now = _first_stamps(), _stamps()
    places = {name: keys.PACKAGE.parent.joinpath(*name.split(".")) for name in modules}
    files = {name: (f"{place}.py", str(place / "__init__.py")) for name, place in places.items()}
    return [
        name for name, both in files.items() if any(path in first and now.get(path) != first[path] for path in both)
    ]


@functools.cache
def _first_stamps() -> dict[str, tuple[int, int]]:
    return _stamps()


def _stamps() -> dict[str, tuple[int, int]]:
    """Return size and time of every file of the package's code."""
    found = {}
    for folder, _, names in os.walk(keys.PACKAGE):
        for name in (one for one in names if one.endswith(".py")):
            path = os.path.join(folder, name)
            with contextlib.suppress(OSError):
                stat = os.stat(path)
                found[path] = (stat.st_size, stat.st_mtime_ns)
    return found


def begun_as(job: jobs.Job) -> str:
    """Return what the marks of those that begin a job are called, without their number."""
    return f"{job.task.name}-{job.task.unit}-{job.key}"
