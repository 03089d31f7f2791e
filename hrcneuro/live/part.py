"""One file of a recording, ``part1.xdf``, ``part2.xdf``, …: chunks go in whole, or not at all."""

from __future__ import annotations

import contextlib
import os
import re
from datetime import datetime
from pathlib import Path

from hrcneuro.live import xdf

_HEAD = 1024
LOCK = ".recording"
"""The file in a recording's folder that is locked as long as a process records into it."""


def path_of(folder: Path, number: int) -> Path:
    """Return where a part of a recording lies."""
    return folder / f"part{number}.xdf"


def number_of(path: Path) -> int:
    """Return the number of a part's file; 0 for another file."""
    found = re.fullmatch(r"part(\d+)\.xdfz?", path.name)
    return int(found[1]) if found else 0


def began(head: bytes) -> float:
    """Return when a file says that it was begun, seconds since 1970; 0 where it does not say.

    Args:
        head: The first bytes of the file, a thousand at least.
    """
    found = re.search(rb"<datetime>([^<]*)</datetime>", head)
    try:
        return datetime.fromisoformat(found[1].decode()).timestamp() if found else 0.0
    except (ValueError, OverflowError):
        return 0.0


def newest(parent: Path, pattern: str = "*.xdf*") -> Path | None:
    """Return the folder of the recording that was begun or resumed last, by what its files say; None for none.

    Folders are named by the time of day of their place, which is set back once a year.
    """

    def of(path: Path) -> tuple[float, str]:
        with path.open("rb") as file:
            return began(file.read(_HEAD)), str(path)

    last = max(parent.glob(f"*/{pattern}"), key=of, default=None)
    return last and last.parent


class Part:
    """An XDF file that grows.

    Attributes:
        path: The file.
        size: Bytes that are in it, all of them in whole chunks.
        fault: Why nothing more goes in; empty while it does.
    """

    def __init__(self, path: Path, *, started: str) -> None:
        """Begin a new file.

        Args:
            path: It must not exist.
            started: Time of day, ISO 8601.

        Raises:
            OSError: It exists, or cannot be written.
        """
        self.path, self.size, self.fault = path, 0, ""
        self._waiting: list[bytes] = []
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        self.add(xdf.MAGIC + xdf.file_header(started))
        self.write()
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

    def add(self, chunk: bytes) -> None:
        """Take a whole chunk, to be written with the next ones."""
        self._waiting.append(chunk)

    def write(self, *, sync: bool = False) -> None:
        """Write what was taken; with ``sync`` it is on the disk afterwards.

        Raises:
            OSError: It cannot be written; the file then ends with the last chunk before it.
        """
        try:
            rest = memoryview(b"".join(self._waiting))
            written = 0
            while written < len(rest):
                written += os.write(self._file, rest[written:])
            self.size += written
            self._waiting.clear()
            if sync:
                os.fsync(self._file)
        except OSError as error:
            self.fault = error.strerror or str(error)
            # What is left of a chunk would be damage to a reader.
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self.size)
                os.lseek(self._file, self.size, os.SEEK_SET)
            raise

    def close(self) -> None:
        """Write the rest and close the file.

        Raises:
            OSError: The rest cannot be written.
        """
        try:
            self.write(sync=True)
        finally:
            os.close(self._file)
