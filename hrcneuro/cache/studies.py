"""The studies that use a cache, and the entries that each points at: ``<cache>/.studies/<id>-….jsonl``.

A run writes a file of its own: a line that says which study it is and where, then a line for each entry, written before
the entry is looked for. When the run ends, one file with what the study's results point at takes the place of the
files of its runs that have ended. So what a study points at is always in some file, whatever is killed when.
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import flush, guarded, make_folder, share
from hrcneuro.cache.holder import Holder
from hrcneuro.cache.record import Entry, entry_of
from hrcneuro.cache.store import Store
from hrcneuro.errors import DataError

ID = ".study"
"""The file in a study's results that holds its id, a random word."""
_OTHER_MACHINE_S = 7 * 86400.0


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
            (results / ID).open("rb").close()
        except PermissionError:
            return True  # another account's: what may not be seen may not pass for gone
        except OSError:
            return False
        return read_id(results) in self.ids

    def __str__(self) -> str:
        return self.folder if self.host == socket.gethostname() else f"{self.host}:{self.folder}"


@dataclass(frozen=True)
class Listing:
    """A file of the list.

    Attributes:
        path: The file.
        study: Whose it is.
        entries: What it says that the study points at.
        over: Whether the run that wrote it has ended.
        forgotten: Whether its study was declared to be gone.
        seen: When it was written last, seconds since 1970.
        cache: The folder of the cache for which it was written: a cache may be copied with its list.
    """

    path: Path
    study: PlacedStudy
    entries: frozenset[Entry]
    over: bool
    forgotten: bool
    seen: float
    cache: str


class Studies:
    """The list of a cache."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.folder = root / ".studies"
        # Beside the list, so that it outlives it: of what was there before the list, nobody knows who points at it.
        self._before = root / ".before-the-list"

    def before(self) -> set[Entry]:
        """Return the entries that were in the cache already when its list was begun, or begun anew.

        Raises:
            DataError: That is noted and cannot be understood.
        """
        try:
            return {_entry(json.loads(line)) for line in self._before.read_text(encoding="utf-8").splitlines()}
        except FileNotFoundError:
            return set()
        except (OSError, ValueError, TypeError) as error:
            raise DataError(
                f"{self._before}, which names the entries that are older than the list of studies, cannot be read or "
                f"understood ({error})",
                cure="run a command of each study that uses this cache, such as 'hrcneuro run', then remove that file",
            ) from error

    def read(self) -> list[Listing]:
        """Return all files of the list.

        Raises:
            DataError: The list, or one of its files, cannot be read or understood: what it keeps is unknown, so
                nothing may be dropped.
        """
        if os.path.lexists(self.folder) and not self.folder.is_dir():
            raise DataError(
                f"{self.folder}, the list of the studies that use this cache, is no folder or leads nowhere",
                cure="put back the folder, or remove what stands in its place and run a command of each study that "
                "uses this cache, such as 'hrcneuro run'",
            )
        with guarded(self.folder):
            while True:
                try:
                    return [_read(path) for path in sorted(self.folder.glob("*.jsonl"))]
                except FileNotFoundError:
                    continue  # replaced meanwhile by one that may have come after we looked for files

    def open(self, study: PlacedStudy, entries: Iterable[Entry]) -> Path:
        """Enter a run of a study that points at these entries now; return the run's file.

        Raises:
            OSError: The list cannot be written.
        """
        return self._write(study, entries, over=False)

    def claim(self, run: Path, entry: Entry) -> None:
        """Let a run's file name an entry that the run is about to look for.

        Raises:
            OSError: The file cannot be written.
        """
        line = json.dumps(list(entry)) + "\n"
        # Closed each time: on a network's file system others then see it.
        with run.open("r+b") as file:
            file.seek(0, os.SEEK_END)
            file.write(line.encode())

    def settle(self, study: PlacedStudy, pointers: Callable[[], Iterable[Entry]], run: Path | None = None) -> None:
        """Let one file say what a study points at, in place of those of its runs that have ended.

        Args:
            study: The study.
            pointers: Returns what its results point at; called once it is known which runs have ended.
            run: The file of a run that ends with this.

        Raises:
            OSError: The list cannot be written.
            DataError: A file of the list cannot be understood.
        """
        ended = [one for one in self.read() if one.study.same(study) and (one.over or one.path == run)]
        former = {name for one in ended for name in one.study.ids} - {study.id}
        self._write(replace(study, former=tuple(sorted(former))), pointers(), over=True)
        for one in ended:
            one.path.unlink(missing_ok=True)

    def forget(self, study: PlacedStudy) -> None:
        """Let a study that is gone point at nothing; that it was there stays known, and so who wrote its entries.

        Raises:
            OSError: The list cannot be written.
        """
        known = [one for one in self.read() if one.study.same(study)]
        former = {name for one in known for name in one.study.ids} - {study.id}
        self._write(replace(study, former=tuple(sorted(former))), (), over=True, forgotten=True)
        for one in known:
            one.path.unlink(missing_ok=True)

    def _write(self, study: PlacedStudy, entries: Iterable[Entry], *, over: bool, forgotten: bool = False) -> Path:
        self._begin()
        me = Holder.me()
        head = {
            "id": study.id,
            "former": study.former,
            "folder": study.folder,
            "inode": study.inode,
            "host": study.host,
            "process": [me.pid, me.start],
            "over": over,
            "forgotten": forgotten,
            "cache": str(self.root),
        }
        path = self.folder / f"{study.id}-{secrets.token_hex(6)}.jsonl"
        self._put(path, [head, *map(list, sorted(entries))])
        return path

    def _put(self, path: Path, lines: Iterable[Any]) -> None:
        """Let a file with these lines appear, whole, for all who share the cache."""
        part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
        part.write_text("".join(json.dumps(line) + "\n" for line in lines))
        share(part, self.root)
        flush(part)
        part.rename(path)

    def _begin(self) -> None:
        """Make the folder of the list; what the cache has by then is noted first, with what was noted before."""
        if self.folder.is_dir():
            return
        if there := {entry_of(folder) for folder in Store(self.root).entries()}:
            self._put(self._before, map(list, sorted(there | self.before())))
        make_folder(self.folder, self.root)


def read_id(results: Path) -> str:
    """Return the id of the study with these results; empty where there is none or it cannot be read."""
    try:
        text = (results / ID).read_text(encoding="ascii").strip()
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


def _read(path: Path) -> Listing:
    try:
        if not path.is_file() and os.path.lexists(path):
            raise ValueError("it is no file, or a link that leads nowhere")
        text = path.read_text(encoding="utf-8")
        # A last line without an end was being written when its run was killed: it looked for nothing yet.
        head, *rows = [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]
        study = PlacedStudy(head["id"], head["folder"], head["inode"], head["host"], tuple(head["former"]))
        pid, start = head["process"]
        process = Holder(pid, study.host, start)
        seen = path.stat().st_mtime
        return Listing(
            path=path,
            study=study,
            entries=frozenset(_entry(row) for row in rows),
            over=head["over"] or process.dead or (not process.here and time.time() - seen > _OTHER_MACHINE_S),
            forgotten=head["forgotten"],
            seen=seen,
            cache=head["cache"],
        )
    except (ValueError, TypeError, KeyError) as error:
        raise DataError(
            f"{path}, which says what a study points at in this cache, cannot be understood ({error})",
            cure="remove that file, then run a command of each study that uses this cache, such as 'hrcneuro run'",
        ) from error


def _entry(row: Any) -> Entry:
    stage, unit, key = row
    if not all(isinstance(part, str) for part in row):
        raise ValueError(f"no entry: {row}")
    return stage, unit, key
