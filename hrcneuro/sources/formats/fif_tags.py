"""The tags of a FIF file, as far as they say which files a recording consists of and whether each is whole.

A FIF is a chain of tags (kind, type, size, next; big-endian; Elekta Neuromag's and MNE's files alike). No numeric
library: every plan asks for the parts.
"""

from __future__ import annotations

import contextlib
import gzip
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, cast

from hrcneuro.errors import DataError

_TAG = struct.Struct(">iIii")
_BLOCK_START, _BLOCK_END, _BUFFER = 104, 105, 300
_RAW_BLOCKS = (102, 112, 119)
_REF = 118
_ROLE, _NUMBER, _NAME = 115, 117, 118
_PREVIOUS, _NEXT = 1, 2
# Bytes of a content that may be a name or a number.
_SHORT = 4096
_CURE = "copy or download the file again, every part of it"


@dataclass
class _File:
    """What the tags of one file say; ``whole`` if its recording's block is closed."""

    next_name: str = ""
    previous: str = ""
    whole: bool = False
    buffers: int = 0


def parts(path: Path) -> list[Path]:
    """Return the later parts of a split recording, in order, by the names that each part gives to the next.

    Raises:
        DataError: A part is missing, or the file is itself a later part.
    """
    first = _look(path)
    if first.previous:
        raise DataError(
            f"{path.name} is a later part of a recording in several files: it goes on after {first.previous}",
            cure="name the first part in acquire.path; the others are found from it",
        )
    found: list[Path] = []
    name = first.next_name
    while name:
        part = path.parent / name
        if not part.exists() and not part.is_symlink():
            before = (found or [path])[-1].name
            raise DataError(
                f"{path.name} is a recording in several files, and a part is missing: {before} goes on in {name}",
                cure=f"put {name} beside it, under that name: the parts name each other",
            )
        if part == path or part in found:
            raise DataError(f"{part.name} is named as a part of {path.name} twice", cure=_CURE)
        found.append(part)
        name = _look(part).next_name if part.exists() else ""
    return found


def check_whole(path: Path) -> None:
    """Refuse a file that ends within its recording: what is cut off between two buffers leaves no other trace.

    Raises:
        DataError: It does; the message says how many buffers of samples there are.
    """
    found = _look(path)
    if found.buffers and not found.whole:
        raise DataError(
            f"{path.name} is truncated: it ends within its recording, after {found.buffers} buffers of samples",
            cure=_CURE,
        )


def _look(path: Path) -> _File:
    about = path.stat()
    return _walk(path, about.st_size, about.st_mtime_ns)


@lru_cache(maxsize=64)
def _walk(path: Path, size: int, mtime_ns: int) -> _File:
    """Walk the tags of a file; what is no FIF gives an empty answer, which its reader will have words for.

    A plan and a reading ask several times; size and time of the file are there to be asked anew when it changes.
    """
    found = _File()
    blocks: list[int] = []
    role = 0
    with _opened(path) as file, contextlib.suppress(EOFError, OSError, struct.error):
        for kind, content in _tags(file):
            if kind == _BUFFER:
                found.buffers += 1
            elif kind in (_BLOCK_START, _BLOCK_END):
                block = _integer(content)
                found.whole |= kind == _BLOCK_END and block in _RAW_BLOCKS
                blocks = [*blocks, block] if kind == _BLOCK_START else blocks[:-1]
                role = 0
            elif blocks[-1:] == [_REF]:
                role = _integer(content) if kind == _ROLE else role
                _refer(found, path.name, kind, content, role)
    return found


def _refer(found: _File, name: str, kind: int, content: bytes, role: int) -> None:
    """Note what a reference says of another file; a name says more than a number."""
    if kind not in (_NAME, _NUMBER):
        return
    text = content.decode("latin-1") if kind == _NAME else _numbered(name, _integer(content))
    if role == _NEXT and (kind == _NAME or not found.next_name):
        found.next_name = text
    elif role == _PREVIOUS and (kind == _NAME or not found.previous):
        # MNE writes this name with its folder.
        found.previous = re.split(r"[/\\]", text)[-1]


def _numbered(name: str, number: int) -> str:
    """Return the name of a part that is known by its number only: ``x_raw.fif`` goes on in ``x_raw-1.fif``."""
    stem, _, endings = name.partition(".")
    stem = re.sub(r"-\d+$", "", stem)
    return f"{stem}-{number}.{endings}" if number else f"{stem}.{endings}"


def _tags(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of each tag to the last one that is whole; a long content is left empty.

    It never goes back: in a compressed file that would mean to unpack it from the start.
    """
    position = 0
    while len(head := file.read(_TAG.size)) == _TAG.size:
        kind, _, size, following = _TAG.unpack(head)
        end = position + _TAG.size + size
        content = b""
        if 0 <= size <= _SHORT:
            content = file.read(size)
        elif size > 0:
            file.seek(end - 1)
        if size < 0 or (len(content) < size if size <= _SHORT else not file.read(1)):
            return
        yield kind, content
        if following < 0:
            return
        position = max(following, end)
        file.seek(position)


def _integer(content: bytes) -> int:
    return int(struct.unpack(">i", content[:4])[0])


def _opened(path: Path) -> BinaryIO:
    return cast("BinaryIO", gzip.open(path, "rb")) if path.suffix.lower() == ".gz" else path.open("rb")
