"""Where a result comes from: version, commit and command line, without user, host or path."""

from __future__ import annotations

import functools
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcneuro import __version__
from hrcneuro.pipeline.anonymous import command_line


@functools.cache
def provenance() -> Mapping[str, Any]:
    """Return version, git commit, whether the tree was dirty, and the command line, for ``record.json``."""
    folder = Path(__file__).parents[1]
    # Installed into a user's own repository, this package is no part of that one's history.
    ours = _git(folder, "ls-files", "--", "__init__.py")
    commit = _git(folder, "rev-parse", "HEAD") if ours else ""
    return {
        "hrcneuro": __version__,
        "commit": commit or "unknown",
        "dirty": bool(_git(folder, "status", "--porcelain", "--untracked-files=no")) if commit else None,
        "command": command_line(),
    }


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
