"""A log that was cut short, made whole before a session goes on: nothing is taken away that is not kept elsewhere."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.experiment.disk import replaced, sync_path
from hrcneuro.experiment.progress import Progress
from hrcneuro.sources import authors_log, experiments
from hrcneuro.sources.layout import log_names

TORN = "experiment.torn"
"""Where that is kept which was taken away: unfinished last lines."""


def mend_journal(path: Path) -> tuple[list[experiments.Entry], list[str]]:
    """Return the lines of ``experiment.jsonl``, and what was done, a sentence each; a torn end is put aside.

    Raises:
        DataError: A line before the last one is damaged.
        OSError: It cannot be read or written.
    """
    entries, whole = experiments.read(path)
    torn = path.read_bytes()[whole:]
    return entries, _put_aside(path, whole, torn) if torn else []


def mend_pair(place: Path, subject: str, progress: Progress, origin: str) -> list[str]:
    """Bring the authors' pair to what ``experiment.jsonl`` tells; return what was done, a sentence each.

    Raises:
        DataError: Somebody has edited it.
        OSError: It cannot be read or written.
    """
    names = log_names(subject)
    moves = authors_log.log_head() + "".join(map(authors_log.log_line, progress.rows))
    done = mend_log(place / names["log"], moves)
    lines = [episode.line(origin) for episode in progress.episodes]
    mend_metadata(place / names["metadata"], authors_log.metadata_head(origin=origin) + "".join(lines))
    return done


def mend_log(path: Path, expected: str) -> list[str]:
    """Bring a file whose lines are only ever added to what it should be; return what was done.

    Raises:
        DataError: It has other lines, so that somebody has edited it.
        OSError: It cannot be read or written.
    """
    wanted = expected.encode()
    found = path.read_bytes() if path.exists() else b""
    common = _common(found, wanted)
    done = []
    if not wanted.startswith(found):
        lines, rest = found[common:].splitlines(keepends=True), wanted[common:]
        # A whole line in the place of another one is no accident.
        if rest and lines[0].endswith(b"\n") and b"\0" not in lines[0]:
            raise _edited(path, found[:common].count(b"\n") + 1)
        done = _put_aside(path, common, found[common:])
        found = found[:common]
    missing = wanted[len(found) :]
    if missing:
        with path.open("ab") as file:
            file.write(missing)
            os.fsync(file.fileno())
    if missing and not found and wanted.count(b"\n") > 1:
        done.append(f"{path.name} was not there: it was written anew from {experiments.FILE}")
    elif missing and found:
        done.append(f"{path.name} lacked {len(missing)} bytes, which {experiments.FILE} has: they were added")
    return done


def mend_metadata(path: Path, expected: str) -> None:
    """Let the metadata be what they should be; only the last line may differ, or be missing.

    Raises:
        DataError: Others do, so that somebody has edited it.
        OSError: It cannot be read or written.
    """
    found = path.read_bytes() if path.exists() else b""
    wanted = expected.encode()
    whole, last = found.splitlines(keepends=True)[:-1], wanted.splitlines(keepends=True)
    for number, (line, other) in enumerate(zip(whole, last, strict=False), start=1):
        if line != other:
            raise _edited(path, number)
    if found != wanted:
        replaced(path, lambda part: part.write_bytes(wanted))


def _common(found: bytes, wanted: bytes) -> int:
    """Return how many bytes of whole lines are the same."""
    same = 0
    for line, other in zip(found.splitlines(keepends=True), wanted.splitlines(keepends=True), strict=False):
        if line != other:
            break
        same += len(line)
    return same


def _put_aside(path: Path, whole: int, torn: bytes) -> list[str]:
    """Move what stands behind ``whole`` bytes of a file to where such things are kept."""
    kept = path.with_name(TORN)
    head = f"{datetime.now(UTC).isoformat(timespec='seconds')} {path.name}, from byte {whole}: {len(torn)} bytes\n"
    with kept.open("ab") as file:
        file.write(head.encode() + torn + b"\n")
        file.flush()
        os.fsync(file.fileno())
    sync_path(path.parent)
    os.truncate(path, whole)
    return [f"the last line of {path.name} was torn: {len(torn)} bytes were moved to {TORN}"]


def _edited(path: Path, line: int) -> DataError:
    return DataError(
        f"{path.name}, line {line} is not what {experiments.FILE} tells: one of them was edited",
        cure=f"restore it from a copy, or put it aside: {path.name} is then written anew from {experiments.FILE}",
    )
