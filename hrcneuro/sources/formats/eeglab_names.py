"""Which file holds the samples of an EEGLAB data set, found without reading more of it than needed.

A ``.set`` is a MATLAB file with one structure ``EEG``, or since 2021 with its fields as variables. Its field ``data``
is either the samples or the name of the file that has them.
Source: The MathWorks, MAT-File Format (R2023b), chapter 1: level 5.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from hrcneuro.sources.formats.named import find_named

DATA_ENDINGS = (".fdt", ".dat")

_HDF5 = b"MATLAB 7.3"
_LITTLE = b"IM"
_MATRIX, _COMPRESSED = 14, 15
_STRUCT, _CHAR = 2, 4
_ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16"}
_LONGEST_NAME = 4096


@dataclass(frozen=True)
class Files:
    """The data file of a ``.set``: None where the samples are inside, or where the file is missing."""

    name: str
    data: Path | None
    spare: Path | None
    """Another candidate that is there and is not read."""


def data_files(path: Path) -> Files:
    """Return what a ``.set`` names as its data file, and what is there, by EEGLAB's rule.

    In a structure, the file that has the name of the ``.set`` is the one that counts, whatever name is inside: so
    EEGLAB loads a data set that was renamed. Fields without a structure are loaded by the name inside. The other
    candidate is taken where that one is missing.
    """
    name, in_struct = named_data(path)
    ending = "." + name.rpartition(".")[2]
    if ending.lower() not in DATA_ENDINGS:
        return Files(name, None, None)
    own, inside = find_named(path.parent, path.stem + ending), find_named(path.parent, name)
    first, second = (own, inside) if in_struct else (inside, own)
    if first is None:
        return Files(name, second, None)
    return Files(name, first, second if second is not None and second != first else None)


def named_data(path: Path) -> tuple[str, bool]:
    """Return the text in the field ``data``, empty where it holds samples, and whether it lies in a structure.

    A file that is no MATLAB file, or damaged, names nothing: reading it says why.
    """
    with path.open("rb") as file:
        head = file.read(128)
        if head.startswith(_HDF5):
            return _named_in_hdf5(path)
        order = "<" if head[126:128] == _LITTLE else ">"
        try:
            for element in _variables(file, order):
                if (hit := _named_in(element, order)) is not None:
                    return hit
        except (struct.error, zlib.error, EOFError):
            pass
    return "", True


class _Stream:
    """Bytes of one variable, compressed or not, from front to back."""

    def __init__(self, file: BinaryIO, size: int, *, compressed: bool) -> None:
        self._file, self._left = file, size
        self._inflate = zlib.decompressobj() if compressed else None

    def read(self, count: int) -> bytes:
        got = b""
        while len(got) < count:
            piece = self._piece(count - len(got))
            if not piece:
                raise EOFError
            got += piece
        return got

    def skip(self, count: int) -> None:
        if self._inflate is None:
            self._file.seek(min(count, self._left), 1)
            self._left -= min(count, self._left)
            return
        while count:
            count -= len(self.read(min(count, 1 << 20)))

    def _piece(self, most: int) -> bytes:
        if self._inflate is None:
            raw = self._file.read(min(most, self._left))
            self._left -= len(raw)
            return raw
        if not self._inflate.unconsumed_tail and self._left:
            raw = self._file.read(min(1 << 16, self._left))
            self._left -= len(raw)
            return self._inflate.decompress(raw, most)
        return self._inflate.decompress(self._inflate.unconsumed_tail, most)


def _variables(file: BinaryIO, order: str) -> Iterator[_Stream]:
    """Yield a stream at the content of each variable of the file."""
    while len(tag := file.read(8)) == 8:
        kind, size = struct.unpack(order + "II", tag)
        following = file.tell() + size
        stream = _Stream(file, size, compressed=kind == _COMPRESSED)
        if kind == _COMPRESSED:
            kind, _ = struct.unpack(order + "II", stream.read(8))
        if kind == _MATRIX:
            yield stream
        file.seek(following)


def _named_in(stream: _Stream, order: str) -> tuple[str, bool] | None:
    """Return what a variable says of the samples, None where it is neither ``EEG`` nor ``data``."""
    kind, name = _head(stream, order)
    if name == "data":
        return (_text(stream, order) if kind == _CHAR else ""), False
    if name != "EEG" or kind != _STRUCT:
        return None
    (width,) = struct.unpack(order + "i", _part(stream, order)[1])
    names = _part(stream, order)[1]
    for at in range(0, len(names), width):
        _, size = struct.unpack(order + "II", stream.read(8))
        if names[at : at + width].rstrip(b"\0") != b"data":
            stream.skip(size)
            continue
        # An empty matrix may be written as a tag alone.
        return (_text(stream, order) if size and _head(stream, order)[0] == _CHAR else ""), True
    return None


def _head(stream: _Stream, order: str) -> tuple[int, str]:
    """Return class and name of a matrix, the stream before its content."""
    flags = _part(stream, order)[1]
    _part(stream, order)
    name = _part(stream, order)[1]
    return struct.unpack(order + "I", flags[:4])[0] & 0xFF, name.decode("latin-1")


def _text(stream: _Stream, order: str) -> str:
    kind, raw = _part(stream, order)
    encoding = _ENCODINGS.get(kind, "latin-1")
    if encoding == "utf-16":
        encoding += "-le" if order == "<" else "-be"
    return raw.decode(encoding, errors="replace").rstrip("\0 ")


def _part(stream: _Stream, order: str) -> tuple[int, bytes]:
    """Return type and bytes of the next part; up to four bytes stand in the tag itself, others end on eight."""
    tag = stream.read(8)
    kind, size = struct.unpack(order + "II", tag)
    if kind >> 16:
        return kind & 0xFFFF, tag[4 : 4 + (kind >> 16)]
    if size > 1 << 20:
        raise EOFError
    content = stream.read(size)
    stream.skip(-size % 8)
    return kind, content


def _named_in_hdf5(path: Path) -> tuple[str, bool]:
    # Only such a file needs the library, which brings numpy along.
    import h5py

    try:
        with h5py.File(path, "r") as file:
            in_struct = "EEG" in file
            field = file["EEG/data" if in_struct else "data"]
            if field.attrs.get("MATLAB_class") != b"char" or field.size > _LONGEST_NAME:
                return "", in_struct
            return "".join(chr(int(code)) for code in field[()].ravel()).rstrip("\0 "), in_struct
    except (OSError, KeyError):
        return "", True
