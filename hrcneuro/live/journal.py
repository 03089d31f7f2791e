"""``session.json`` of a recording: what was to be recorded, what came, what stood out, how it ended."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

FILE = "session.json"
_LIBRARIES = ("hrcneuro", "mne-lsl", "pyxdf", "numpy")
RUNNING, ENDED, FULL, FAILED = "recording", "ended", "stopped by its disk", "stopped by a fault"


class Journal:
    """The file, with a part for each time that the recording was begun or resumed.

    Attributes:
        path: The file.
        about: All that it says.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        """Begin with what ``about`` says of the whole recording, or go on with what is there."""
        self.path = folder / FILE
        _put_aside_what_cannot_be_read(self.path)
        self.about: dict[str, Any] = {**read(folder), **about, "parts": parts(folder)}

    @property
    def part(self) -> dict[str, Any]:
        """What is said of the part that is being recorded."""
        part: dict[str, Any] = self.about["parts"][-1]
        return part

    def begin(self, part: Mapping[str, Any]) -> None:
        """Add a part, and write.

        Raises:
            OSError: It cannot be written.
        """
        self.about["parts"].append({**part, "state": RUNNING, "events": []})
        self.write()

    def write(self) -> None:
        """Let the file appear anew, whole.

        Raises:
            OSError: It cannot be written.
        """
        part = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        part.write_text(json.dumps(self.about, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
        part.replace(self.path)


def beginning(file: Path, *, clock_s: float) -> dict[str, Any]:
    """Return what a part says of its begin: its file, the time of day, the recorder's clock, and who recorded it."""
    versions = {}
    for name in _LIBRARIES:
        # At virtual pace not all are needed.
        with contextlib.suppress(PackageNotFoundError):
            versions[name] = version(name)
    now = datetime.now(UTC).isoformat(timespec="milliseconds")
    return {"file": file.name, "began": now, "clock_s": clock_s, "versions": versions}


def read(folder: Path) -> dict[str, Any]:
    """Return what a recording's ``session.json`` says; nothing where there is none or it cannot be understood."""
    try:
        about = json.loads((folder / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return about if isinstance(about, dict) else {}


def parts(folder: Path) -> list[dict[str, Any]]:
    """Return what a recording's ``session.json`` says of each part; nothing where it cannot be understood."""
    listed = read(folder).get("parts")
    return [one for one in listed if isinstance(one, dict)] if isinstance(listed, list) else []


def _put_aside_what_cannot_be_read(path: Path) -> None:
    """Keep a ``session.json`` that cannot be understood, under another name."""
    if path.is_file() and not read(path.parent):
        number = 1
        while (kept := path.with_name(f"session-unreadable-{number}.json")).exists():
            number += 1
        path.rename(kept)
