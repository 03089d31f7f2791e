"""An entry's ``record.json``: what it holds and how it came to be, under a seal; whether its files are so."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.cache import fingerprint

RECORD = "record.json"
_KEY = re.compile("[0-9a-f]{16}")

Entry = tuple[str, str, str]
"""Stage, unit and key."""


@dataclass(frozen=True)
class Record:
    """What an entry holds and how it came to be."""

    stage: str
    unit: str
    key: str
    parts: Mapping[str, Any]
    outputs: Mapping[str, Mapping[str, Any]]  # file name -> sha256, size
    summary: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)


def entry_of(folder: Path) -> Entry:
    """Return stage, unit and key of an entry's folder."""
    return folder.parts[-3], folder.parts[-2], folder.name


def is_key(text: str) -> bool:
    """Return whether a text is in the form of a key."""
    return _KEY.fullmatch(text) is not None


def write_record(folder: Path, record: Record) -> None:
    """Write ``record.json``, with a seal: the digest of everything else in it."""
    # Through JSON and back, so that the seal is of what a reader will see.
    content = json.loads(json.dumps(asdict(record)))
    text = json.dumps({**content, "seal": fingerprint.digest(content)}, indent=1, sort_keys=True)
    (folder / RECORD).write_text(f"{text}\n", encoding="utf-8")


def read_record(folder: Path) -> Record | None:
    """Return the record of an entry, or None where it is missing, unreadable or not as it was written."""
    try:
        content = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        seal = content.pop("seal")
        return Record(**content) if seal == fingerprint.digest(content) else None
    except (OSError, ValueError, TypeError, AttributeError, KeyError):
        return None


def fault(folder: Path, record: Record, entry: Entry, *, verify: bool) -> str:
    """Return what is wrong with the files of an entry, wherever they lie; an empty string where nothing is."""
    if (record.stage, record.unit, record.key) != entry:
        return f"record.json is of {record.stage}/{record.unit}/{record.key}"
    for name, expected in record.outputs.items():
        path = folder / name
        try:
            size = path.stat().st_size
        except OSError:
            return f"{name} is missing"
        if size != expected["size"]:
            return f"{name} has {size} bytes instead of {expected['size']}"
        if verify and fingerprint.file_digest(path) != expected["sha256"]:
            return f"the content of {name} has changed"
    return ""


def flaw(folder: Path, entry: Entry, *, verify: bool = False) -> str:
    """Return what is wrong with an entry that lies in a folder; an empty string where it is sound or absent."""
    try:
        folder.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return ""
    record = read_record(folder)
    if record is None:
        return "record.json is missing, unreadable or altered"
    return fault(folder, record, entry, verify=verify)
