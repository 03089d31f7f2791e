"""Files that only stand for the real ones."""

from __future__ import annotations

import os
from pathlib import Path

from hrcneuro.errors import DataError

_LFS = b"version https://git-lfs.github.com/spec"


def refuse_pointer(path: Path) -> None:
    """Refuse a file that is only a stand-in for the real one: Git LFS's pointer, or a link to a file that is not here.

    Raises:
        DataError: It is one; the cure is the command that fetches the content.
    """
    refuse_broken_link(path)
    with path.open("rb") as file:
        head = file.read(len(_LFS))
    if head == _LFS:
        raise DataError(
            f"{path.name} is a Git LFS pointer of {path.stat().st_size} bytes, not the data",
            cure=f"fetch the content in that repository: git lfs install && git lfs pull --include '*/{path.name}'",
        )


def refuse_broken_link(path: Path) -> None:
    """Refuse a link whose target is absent, as git-annex and DataLad leave them until the content is fetched.

    Raises:
        DataError: It is one.
    """
    if not path.is_symlink() or path.exists():
        return
    target = os.readlink(path)
    annexed = "annex/objects" in target.replace("\\", "/")
    raise DataError(
        f"{path.name} is a link to a file that is not here: {target}",
        cure=f"git annex get '{path.name}' (or datalad get '{path.name}') in its folder"
        if annexed
        else "fetch what the link leads to (git annex get, where the data are annexed), or copy the file itself",
    )
