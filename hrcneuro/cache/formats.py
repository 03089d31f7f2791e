"""What a file that comes from elsewhere may be, by its suffix, and whether it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hrcneuro.cache.disk import read_json

Formats = Mapping[str, tuple[bytes, bytes]]
"""Suffix of a file -> the bytes that it begins and ends with; what has another suffix is refused."""


def is_of_format(path: Path, formats: Formats) -> bool:
    """Return whether a file is what its suffix says.

    JSON is one that a reader can take: of moderate size, and not nested without end.
    """
    head, tail = formats[path.suffix]
    with path.open("rb") as file:
        begins = file.read(len(head)) == head
        file.seek(max(0, path.stat().st_size - len(tail)))
        ends = file.read() == tail if tail else True
    return begins and ends and (path.suffix != ".json" or _is_json(path))


def _is_json(path: Path) -> bool:
    try:
        read_json(path)
    except (OSError, ValueError):
        return False
    return True
