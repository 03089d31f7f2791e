"""A study in its place: which one it is after a copy, a move, a backup, on another machine."""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
from dataclasses import dataclass
from pathlib import Path

from hrcneuro.cache.disk import read_file

ID = ".study"
"""The file in a study's results that holds its id, a random word."""


@dataclass(frozen=True)
class PlacedStudy:
    """A study in its place.

    Attributes:
        id: A random word that a copy shares.
        folder: Its working folder.
        inode: Of that folder.
        host: The machine that it was seen from.
        former: Ids that it had before its results were deleted.
    """

    id: str
    folder: str
    inode: int
    host: str
    former: tuple[str, ...] = ()

    @classmethod
    def at(cls, folder: Path, results: Path) -> PlacedStudy:
        """Return the study of a working folder; it is given an id where it has none.

        Raises:
            OSError: The folder cannot be read.
        """
        return cls(_identity(results), str(folder), folder.stat().st_ino, socket.gethostname())

    @property
    def ids(self) -> set[str]:
        """All ids under which it wrote entries."""
        return {self.id, *self.former}

    def same(self, other: PlacedStudy) -> bool:
        """Return whether the other is this study: of the same path, and alike in two of id, inode and machine.

        A copy elsewhere, also one that lies at the same path of another machine, is another study. A study whose
        results were deleted, that came back from a backup, or whose machine is named anew, is the same.
        """
        alike = (bool(self.ids & other.ids), self.inode == other.inode, self.host == other.host)
        return self.folder == other.folder and sum(alike) >= 2

    def there(self) -> bool:
        """Return whether it is in its place, as far as this machine and account can see."""
        results = Path(self.folder) / "results"
        try:
            read_file(results / ID)
        except PermissionError:
            return True  # another account's: what may not be seen may not pass for gone
        except OSError:
            return False
        return read_id(results) in self.ids

    def __str__(self) -> str:
        return self.folder if self.host == socket.gethostname() else f"{self.host}:{self.folder}"


def read_id(results: Path) -> str:
    """Return the id of the study with these results; empty where there is none or it cannot be read."""
    try:
        text = read_file(results / ID).decode("ascii").strip()
    except (OSError, ValueError):
        return ""
    return text if text.isalnum() else ""


def _identity(results: Path) -> str:
    known = read_id(results)
    if known:
        return known
    part = results / f"{ID}.{secrets.token_hex(4)}"
    new = secrets.token_hex(8)
    with contextlib.suppress(OSError):
        results.mkdir(parents=True, exist_ok=True)
        part.write_text(f"{new}\n", encoding="ascii")
        try:
            # Of two that begin at once, one gives the id: a link does not replace.
            os.link(part, results / ID)
        except FileExistsError:
            if not read_id(results):
                part.replace(results / ID)
        except OSError:
            part.replace(results / ID)
    with contextlib.suppress(OSError):
        part.unlink()
    # Where it cannot be kept, it holds for this run: the list has it.
    return read_id(results) or new
