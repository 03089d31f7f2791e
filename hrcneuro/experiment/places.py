"""Where an experiment's log lies: one session a subject, which one process at a time may write."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from hrcneuro.errors import REFUSED, ConfigError, HardwareError, HrcError, StageError
from hrcneuro.sources import experiments
from hrcneuro.sources.layout import log_names

TABLE = "trials.parquet"
ANOTHER = "choose another subject's name"


@contextlib.contextmanager
def opened(place: Path, subject: str) -> Iterator[int]:
    """Make the folder and lock it against another experiment; the lock is given to the log, or given up on an error.

    Raises:
        HardwareError: Another process has it.
        ConfigError, StageError: It cannot be written.
    """
    try:
        place.mkdir(parents=True, exist_ok=True)
        lock = _lock(place, subject)
    except OSError as error:
        raise _unwritable(place, error) from error
    try:
        yield lock
    except OSError as error:
        os.close(lock)
        raise _unwritable(place, error) from error
    except BaseException:
        os.close(lock)
        raise


def _lock(place: Path, subject: str) -> int:
    file = os.open(place / ".experiment", os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(file)
        raise HardwareError(
            f"another experiment of {subject} is running: it writes into {place}",
            cure="end it with Esc, twice, in its window, then resume; or choose another subject's name",
        ) from error
    except OSError:
        pass  # a file system without locks
    return file


def _unwritable(place: Path, error: OSError) -> HrcError:
    kind = ConfigError if error.errno in REFUSED else StageError
    return kind(
        f"the experiment's log cannot be written in {place}: {error.strerror or error}",
        cure="give yourself the right to write there, or choose another place: record.folder",
    )


def refuse_begun(place: Path, subject: str) -> None:
    """Refuse to begin where anything of a session lies.

    Raises:
        ConfigError: It does.
    """
    there = [name for name in (experiments.FILE, *log_names(subject).values(), TABLE) if (place / name).exists()]
    if there:
        kept = experiments.FILE in there
        raise ConfigError(
            f"{subject} has a session already: {place} holds {', '.join(there)}; nothing is overwritten",
            cure=f"go on with it: --resume; or {ANOTHER}" if kept else f"{ANOTHER}, or another place: record.folder",
        )
