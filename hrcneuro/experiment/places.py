"""Where an experiment's log lies: one session a subject, which one process at a time may write."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from hrcneuro.errors import ConfigError, HardwareError
from hrcneuro.io.places import is_locked, unwritable
from hrcneuro.io.places import lock as locked
from hrcneuro.sources import experiments
from hrcneuro.sources.layout import log_names

TABLE = "trials.parquet"
ANOTHER = "choose another subject's name"
_WHAT = "the experiment's log"
_LOCK = ".experiment"


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
        raise unwritable(_WHAT, place, error) from error
    try:
        yield lock
    except OSError as error:
        os.close(lock)
        raise unwritable(_WHAT, place, error) from error
    except BaseException:
        os.close(lock)
        raise


@contextlib.contextmanager
def reading(place: Path) -> Iterator[None]:
    """Explain where something in the folder cannot be read.

    Raises:
        ConfigError, StageError: It cannot.
    """
    try:
        yield
    except OSError as error:
        raise unwritable(_WHAT, place, error) from error


def refuse_running(place: Path, subject: str) -> None:
    """Refuse a session that another process writes at this moment; nothing is locked.

    Raises:
        HardwareError: One does.
    """
    if is_locked(place / _LOCK):
        raise _running(place, subject)


def _lock(place: Path, subject: str) -> int:
    try:
        return locked(place / _LOCK)
    except BlockingIOError as error:
        raise _running(place, subject) from error


def _running(place: Path, subject: str) -> HardwareError:
    return HardwareError(
        f"another experiment of {subject} is running: it writes into {place}",
        cure="end it with Esc, twice, in its window, then resume; or choose another subject's name",
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
