"""The studies that use a cache, and the entries that each points at: ``<cache>/.studies/<id>-….jsonl``.

A run writes a file of its own: a line that says which study it is and where, then a line for each entry, written before
the entry is looked for. When the run ends, one file with what the study's results point at takes the place of the
files of its runs that have ended. So what a study points at is always in some file, whatever is killed when.
What it points at no more stays in that file for a day, with the time when it was left: a copy of the study that has
not run yet is in no list, and may point at it.
"""

from __future__ import annotations

import json
import os
import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import LARGEST_LIST, flush, guarded, make_folder, parse_json, read_file, share
from hrcneuro.cache.holder import Holder
from hrcneuro.cache.listing import Listing, entry_in, read_listing
from hrcneuro.cache.placed import PlacedStudy
from hrcneuro.cache.record import Entry, entry_of
from hrcneuro.cache.store import Store
from hrcneuro.errors import DataError

KEPT_S = 86400.0
"""So long what a study points at no more is remembered, in seconds."""


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
            lines = read_file(self._before, max_bytes=LARGEST_LIST).decode().splitlines()
            return {entry_in(parse_json(line)) for line in lines}
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
                    return [read_listing(path) for path in sorted(self.folder.glob("*.jsonl"))]
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
        pointed = set(pointers())
        left = {entry: at for entry, at in _left(ended, time.time()).items() if entry not in pointed}
        self._write(replace(study, former=tuple(sorted(former))), pointed, over=True, left=left)
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

    def _write(
        self,
        study: PlacedStudy,
        entries: Iterable[Entry],
        *,
        over: bool,
        forgotten: bool = False,
        left: Mapping[Entry, float] | None = None,
    ) -> Path:
        self.begin()
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
        rows = [[*entry, at] for entry, at in sorted((left or {}).items())]
        self._put(path, [head, *map(list, sorted(entries)), *rows])
        return path

    def _put(self, path: Path, lines: Iterable[Any]) -> None:
        """Let a file with these lines appear, whole, for all who share the cache."""
        part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
        part.write_text("".join(json.dumps(line) + "\n" for line in lines))
        share(part, self.root)
        flush(part)
        part.rename(path)

    def begin(self) -> None:
        """Make the folder of the list; what the cache has by then is noted first, with what was noted before.

        Raises:
            OSError: The list cannot be written.
            DataError: What was noted before cannot be understood.
        """
        if self.folder.is_dir():
            return
        if there := {entry_of(folder) for folder in Store(self.root).entries()}:
            self._put(self._before, map(list, sorted(there | self.before())))
        make_folder(self.folder, self.root)


def _left(ended: Iterable[Listing], now: float) -> dict[Entry, float]:
    """Return what runs that have ended pointed at within the last day, and until when: those until now."""
    left: dict[Entry, float] = {}
    for one in ended:
        for entry, at in [*one.left.items(), *((entry, now) for entry in one.entries)]:
            if now - at < KEPT_S:
                left[entry] = max(at, left.get(entry, at))
    return left
