"""A file of a cache's list of studies: which study it is, what it points at, and what it has pointed at lately."""

from __future__ import annotations

import errno
import math
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import LARGEST_LIST, parse_json, read_file
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
        text = _read(path)
        # A last line without an end was being written when its run was killed: it looked for nothing yet.
        head, *rows = [parse_json(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]
        _check_head(head)
        study = PlacedStudy(head["id"], head["folder"], head["inode"], head["host"], tuple(head["former"]))
        process = Holder(head["process"][0], study.host, head["process"][1])
        seen = path.stat().st_mtime
        return Listing(
            path=path,
            study=study,
            entries=frozenset(entry_in(row) for row in rows if len(row) == 3),
            over=head["over"] or process.dead or (not process.here and time.time() - seen > _OTHER_MACHINE_S),
            forgotten=head["forgotten"],
            seen=seen,
            cache=head["cache"],
            left={entry_in(row[:3]): _time_in(row[3]) for row in rows if len(row) != 3},
        )
    except (ValueError, TypeError, KeyError, IndexError, OverflowError) as error:
        raise DataError(
            f"{path}, which says what a study points at in this cache, cannot be understood ({error})",
            cure="remove that file, then run a command of each study that uses this cache, such as 'hrcneuro run'",
        ) from error


def _read(path: Path) -> str:
    try:
        return read_file(path, max_bytes=LARGEST_LIST).decode()
    except OSError as error:
        if error.errno != errno.EFBIG:
            raise
        raise ValueError(error.strerror) from error


def _check_head(head: Any) -> None:
    """Refuse a first line of another shape, or whose ids, which are parts of files' names, lead elsewhere."""
    pid, start = head["process"]
    sound = (
        all(isinstance(name, str) and name.isalnum() for name in (head["id"], *head["former"]))
        and all(isinstance(head[name], str) for name in ("folder", "host", "cache"))
        and all(isinstance(head[name], bool) for name in ("over", "forgotten"))
        and all(isinstance(number, int) for number in (head["inode"], pid))
        and isinstance(start, str)
        and isinstance(head["former"], list)
        and b"\0" not in os.fsencode(head["folder"]) + os.fsencode(head["cache"])
    )
    if not sound:
        raise ValueError("its first line names no study")


def _time_in(value: Any) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"no time: {value!r}")
    return float(value)


def entry_in(row: Any) -> Entry:
    """Return the entry that a row of the list names; ValueError or TypeError where it names none."""
    stage, unit, key = row
    if not all(isinstance(part, str) for part in row):
        raise ValueError(f"no entry: {row}")
    return stage, unit, key
