"""A file of a cache's list of studies: which study it is, what it points at, and what it has pointed at lately."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.cache.holder import Holder
from hrcneuro.cache.placed import PlacedStudy
from hrcneuro.cache.record import Entry
from hrcneuro.errors import DataError

_OTHER_MACHINE_S = 7 * 86400.0


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
        left: What the study points at no more, and since when, seconds since 1970.
    """

    path: Path
    study: PlacedStudy
    entries: frozenset[Entry]
    over: bool
    forgotten: bool
    seen: float
    cache: str
    left: Mapping[Entry, float] = field(default_factory=dict)


def read_listing(path: Path) -> Listing:
    """Return what a file of the list says.

    Raises:
        FileNotFoundError: It is gone.
        DataError: It is no file, or cannot be understood.
    """
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
            entries=frozenset(entry_in(row) for row in rows if len(row) == 3),
            over=head["over"] or process.dead or (not process.here and time.time() - seen > _OTHER_MACHINE_S),
            forgotten=head["forgotten"],
            seen=seen,
            cache=head["cache"],
            left={entry_in(row[:3]): float(row[3]) for row in rows if len(row) != 3},
        )
    except (ValueError, TypeError, KeyError, IndexError) as error:
        raise DataError(
            f"{path}, which says what a study points at in this cache, cannot be understood ({error})",
            cure="remove that file, then run a command of each study that uses this cache, such as 'hrcneuro run'",
        ) from error


def entry_in(row: Any) -> Entry:
    """Return the entry that a row of the list names; ValueError or TypeError where it names none."""
    stage, unit, key = row
    if not all(isinstance(part, str) for part in row):
        raise ValueError(f"no entry: {row}")
    return stage, unit, key
