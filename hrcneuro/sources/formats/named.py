"""Where a file lies that another file names: as it stands, else as another system or program would have written it."""

from __future__ import annotations

import os
import unicodedata
from pathlib import Path


def find_named(folder: Path, name: str) -> Path | None:
    """Return the file of that name beside the one that names it, or None where there is none.

    A link whose target is absent counts as found: whoever opens it says so.

    Args:
        folder: Where the naming file lies.
        name: As written there: a bare name, or a path of this system or of Windows, of which the last part counts.
    """
    if not name:
        return None
    base = name.replace("\\", "/").rpartition("/")[2]
    for path in (folder / name, folder / base):
        if is_there(path):
            return path
    # Windows does not tell R.EEG from r.eeg, a Mac writes an umlaut as two characters.
    alike = [path for path in sorted(folder.iterdir()) if _plain(path.name) == _plain(base)]
    return alike[0] if len(alike) == 1 and is_there(alike[0]) else None


def find_path(path: Path) -> Path:
    """Return the path as the disk spells it, where only accents are written in another way; else as it is."""
    if path.exists() or path.is_symlink():
        return path
    found = Path(path.parts[0]) if path.is_absolute() else Path()
    for part in path.parts[1:] if path.is_absolute() else path.parts:
        here = found / part
        if not here.exists() and not here.is_symlink():
            alike = (p for p in (found.iterdir() if found.is_dir() else ()) if _composed(p.name) == _composed(part))
            here = next(alike, here)
        found = here
    return found if found.exists() or found.is_symlink() else path


def is_there(path: Path) -> bool:
    """Return whether there is such a file, or a link that should lead to one."""
    return path.is_file() or (path.is_symlink() and not path.exists())


def _plain(name: str) -> str:
    raw = os.fsencode(name)
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        # Unpacked from an archive that was made on Windows.
        text = raw.decode("cp1252", errors="replace")
    return _composed(text).casefold()


def _composed(name: str) -> str:
    return unicodedata.normalize("NFC", name)
