"""Where recordings go: a folder of its own for each, and room for it; no library loads for this."""

from __future__ import annotations

import contextlib
import shutil
from datetime import datetime
from pathlib import Path

from hrcneuro.errors import StageError

_ROOM = 16_000_000  # bytes that must be free beside what a recording takes


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
