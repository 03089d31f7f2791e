"""Where recordings go: a folder of its own for each, room for it, and one writer; no library loads for this."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import time
from datetime import datetime
from pathlib import Path

from hrcneuro.errors import REFUSED, ConfigError, HrcError, StageError

_ROOM = 16_000_000  # bytes that must be free beside what a recording takes
_LOOKS_S = 0.5  # whoever looks whether a file is kept has let go of it long before
_AGAIN_S = 0.005


def check_room(folder: Path, size: int, *, what: str, cure: str, then: str = "nothing has moved") -> None:
    """Refuse what would not fit.

    Args:
        folder: Where it is to lie; it need not exist yet.
        size: Bytes.
        what: That takes the room, for the message.
        cure: What a person can do about it.
        then: What has not happened.

    Raises:
        StageError: Less is free.
    """
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.is_dir())
    free, need = shutil.disk_usage(there).free, size + _ROOM
    if free < need:
        raise StageError(
            f"{what} may take {need / 1e6:.0f} MB in {folder}, where {free / 1e6:.0f} MB are free; {then}",
            cure=cure,
        )


def new_folder(parent: Path, suffix: str = "") -> Path:
    """Make and return a recording's folder, named by the time of day; another attempt's is never taken.

    Args:
        parent: In which it is made.
        suffix: What its name ends with, where it is not the recording itself.

    Raises:
        OSError: It cannot be made.
    """
    parent.mkdir(parents=True, exist_ok=True)
    name = f"{datetime.now():%Y-%m-%dT%H%M%S}{suffix}"
    for number in range(1, 1000):
        place = parent / (name if number == 1 else f"{name}-{number}")
        # One that is there is another attempt's.
        with contextlib.suppress(FileExistsError):
            place.mkdir()
            return place
    raise FileExistsError(f"{parent / name} and 999 more are there already")


def unwritable(what: str, place: Path, error: OSError) -> HrcError:
    """Return what a person is told where something cannot be written below ``record.folder``.

    Args:
        what: Such as ``the recording``.
        place: Where.
        error: Why: what may not be written there is a mistake of the configuration, all else the disk's.
    """
    kind = ConfigError if error.errno in REFUSED else StageError
    return kind(
        f"{what} cannot be written in {place}: {error.strerror or error}",
        cure="give yourself the right to write there, or choose another place: record.folder",
    )


def lock(path: Path) -> int:
    """Keep a file for this process alone; return its descriptor. The lock ends when that is closed, or this process.

    Where the file system knows no locks, nobody is kept out. Whoever only looks (:func:`is_locked`) is waited for.

    Raises:
        BlockingIOError: Another process has it.
        OSError: It cannot be opened.
    """
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    until = time.monotonic() + _LOOKS_S
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= until:
                os.close(file)
                raise
            time.sleep(_AGAIN_S)
        except OSError:
            return file  # a file system without locks
        else:
            return file


def is_locked(path: Path) -> bool:
    """Return whether a process keeps a file by :func:`lock`; False where that cannot be seen."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        # Shared, so that nobody who looks at the same time takes this one for a keeper; it ends with the file.
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(file)
    return False
