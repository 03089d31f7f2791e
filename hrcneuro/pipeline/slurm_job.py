"""A job of SLURM's, where it runs; and the folder through which it gets its ticket and leaves its answer.

Both are pickles, which can be made to run anything: only their owner may write that folder, or any above it.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import stat
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import guarded, remove
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.worker import Answer, Ticket, drop_old, work

OUT_OF_TIME, PREEMPTED = "out of time", "preempted"
WARNED_S, WARNED_MIN = 30, 2
"""So long before the end of its time SLURM tells a job, or a minute earlier; so many minutes more a job is given."""
_EARLIER_S = 60
_HOME = Path("~/.hrcneuro/slurm")


def in_a_job(ticket: Ticket, minutes: int) -> Answer | str:
    """Return the answer to a ticket, ``OUT_OF_TIME`` or ``PREEMPTED``; the life of a SLURM job.

    SLURM tells a job before it ends it, as its time is over or somebody else gets its place: what is half-written is
    removed then. The ``minutes`` are those that the stage may take.
    """
    begin = time.monotonic()
    why: list[str] = []

    def end(*_: object) -> None:
        why.append(OUT_OF_TIME if _late(time.monotonic() - begin, minutes, os.environ) else PREEMPTED)
        raise SystemExit(1)

    # submitit would have the job queued again by itself, or fail it with an exception that looks like the stage's own.
    signal.signal(signal.SIGUSR2, end)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        answer = work(ticket)
        # What is done is done: its answer is written whole.
        for number in (signal.SIGUSR2, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
    except SystemExit:
        if why:
            return why[0]
        raise
    # Some places make another exception of an exit, such as those that import.
    return why[0] if why and answer.state is State.FAILED else answer


def _late(elapsed_s: float, minutes: int, environment: Mapping[str, str]) -> bool:
    """Return whether a signal comes as the job's time is over; else it comes as the job is preempted."""
    try:
        left_s = float(environment["SLURM_JOB_END_TIME"]) - time.time()
    except (KeyError, ValueError):
        # An older SLURM tells no end; the stage's own minutes are over before the job is warned.
        return elapsed_s >= 60 * minutes
    return left_s <= WARNED_S + 2 * _EARLIER_S


@contextlib.contextmanager
def private_folder(run: Path) -> Iterator[Path]:
    """Yield a folder that its owner alone may write, for what goes to jobs and comes back; it is gone afterwards.

    It lies in the run's folder, or in the home folder where others may write the cache: who may rename a folder may put
    another one in its place. All machines must see it.

    Raises:
        ConfigError: Others may write the home folder, too.
    """
    writable = others_may_write(run)
    place = _at_home(writable) if writable else run
    with guarded(place):
        folder = Path(tempfile.mkdtemp(prefix=f"{run.name}-", dir=place))
    if writable:
        drop_old(folder)
    try:
        yield folder
    finally:
        with contextlib.suppress(OSError):
            remove(folder)


def _at_home(writable: Path) -> Path:
    place = _HOME.expanduser()
    with guarded(place):
        for part in (place.parent, place):
            part.mkdir(mode=0o700, exist_ok=True)
    if other := others_may_write(place):
        raise ConfigError(
            f"others than you may write {writable}, and {other} too: they could put code of theirs in the place of "
            "SLURM's jobs, and it would run as you",
            cure=f"take that right from them: chmod go-w {other}",
        )
    return place


def others_may_write(folder: Path) -> Path | None:
    """Return a part of a path in which others than we and the administrator may change what lies there, or None."""
    places = [Path(os.path.abspath(folder)), Path(os.path.realpath(folder))]
    for part in dict.fromkeys(part for place in places for part in (place, *place.parents)):
        try:
            about = os.lstat(part)
        except OSError:
            return part
        # In a folder with the sticky bit everybody renames only what is theirs; a link has no rights of its own.
        closed = not about.st_mode & (stat.S_IWGRP | stat.S_IWOTH) or about.st_mode & stat.S_ISVTX
        if about.st_uid not in (0, os.geteuid()) or not (closed or stat.S_ISLNK(about.st_mode)):
            return part
    return None


def read_answer(path: Path) -> tuple[str, Any] | None:
    """Return whether a job succeeded, and its answer or traceback, as submitit has written them; None where none is.

    Raises:
        OSError: It cannot be read just now.
        PermissionError: It is not ours alone; nothing of it is run.
    """
    try:
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
        try:
            file = os.open(path.name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
            with open(file, "rb") as opened:
                # The file's own rights are those of the user's umask: the folder keeps others out.
                _refuse_others(path.parent, os.fstat(folder), 0o077)
                _refuse_others(path, os.fstat(file), 0o002)
                return pickle.load(opened)
        finally:
            os.close(folder)
    except FileNotFoundError:
        return None


def _refuse_others(path: Path, about: os.stat_result, rights: int) -> None:
    if about.st_uid != os.geteuid() or about.st_mode & rights:
        raise PermissionError(
            f"{path} is {stat.filemode(about.st_mode)}, of user {about.st_uid}: it is not yours alone"
        )


def last_words(path: Path) -> str:
    """Return the last line that a job wrote on standard error before SLURM did; empty where there is none."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    except OSError:
        return ""
    # SLURM only says behind it that the job has failed.
    own = [line for line in lines if not line.startswith(("srun: ", "slurmstepd: "))]
    return (own or lines or [""])[-1][-200:]
