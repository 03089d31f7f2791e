"""Files that may be packed by gzip, whatever their names say."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import BinaryIO, cast

_GZIP = b"\x1f\x8b"


def unpacked(path: Path) -> BinaryIO:
    """Return the open content of a file, unpacked where gzip has packed it."""
    file: BinaryIO = path.open("rb")
    if file.read(2) == _GZIP:
        file.close()
        return cast("BinaryIO", gzip.open(path, "rb"))
    file.seek(0)
    return file
