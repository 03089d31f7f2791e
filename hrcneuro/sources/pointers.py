"""Files that only stand for the real ones."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.errors import DataError

_LFS = b"version https://git-lfs.github.com/spec"


def refuse_pointer(path: Path) -> None:
    """Refuse a file that is only Git LFS's stand-in for the real one.

    Raises:
        DataError: It is a pointer; the cure is the command that fetches the content.
    """
    with path.open("rb") as file:
        head = file.read(len(_LFS))
    if head == _LFS:
        raise DataError(
            f"{path.name} is a Git LFS pointer of {path.stat().st_size} bytes, not the data",
            cure=f"fetch the content in that repository: git lfs install && git lfs pull --include '*/{path.name}'",
        )
