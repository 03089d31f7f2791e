"""An entry's ``record.json``: what it holds and how it came to be, under a seal; whether its files are so."""

from __future__ import annotations

import functools
import json
import os
import re
import stat
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from hrcneuro.cache import fingerprint, sealed
from hrcneuro.cache.disk import LARGEST, parse_json, read_file, read_json
from hrcneuro.errors import is_utf8

RECORD = "record.json"
SLIM = ".slim"
"""The file in an entry that names those of its files that were dropped to save disk, as a list in JSON."""
PULLED = ".pulled"
"""The file in an entry that says that it came from a bucket."""
_KEY = re.compile("[0-9a-f]{16}")
# A stage's or a unit's name, and each part of a file's: nothing that leads elsewhere, or that hides.
_NAME = re.compile(r"[\w-][^\x00-\x1f\x7f/\\]{0,199}")
_MOST_BYTES = 255  # that a file system takes for a name
# Of the names of files most are so; that they are inside is seen at a glance.
_PLAIN_NAME = re.compile("[A-Za-z0-9_-][A-Za-z0-9_.-]{0,199}")
_MOST_FILES = 10_000

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

    @property
    def size(self) -> int:
        """The bytes of all its files."""
        return sum(about["size"] for about in self.outputs.values())


def entry_of(folder: Path) -> Entry:
    """Return stage, unit and key of an entry's folder."""
    return folder.parts[-3], folder.parts[-2], folder.name


def is_key(text: str) -> bool:
    """Return whether a text is in the form of a key."""
    return _KEY.fullmatch(text) is not None


def write_record(folder: Path, record: Record) -> None:
    """Write ``record.json``, with a seal: the hash of everything else in it."""
    # Through JSON and back, so that the seal is of what a reader will see.
    content = json.loads(json.dumps(asdict(record)))
    (folder / RECORD).write_text(sealed.write(content), encoding="utf-8")


def read_record(folder: Path | str) -> Record | None:
    """Return the record of an entry, or None where it is missing, unreadable or not as it was written."""
    try:
        return parse_record(read_file(f"{folder}/{RECORD}"))
    except (OSError, ValueError):
        return None


def parse_record(data: bytes) -> Record:
    """Return the record that a file holds, whoever wrote it; records may share what is equal in them.

    Raises:
        ValueError: It is not as it was written, or names files that lie outside its entry or cannot be together.
    """
    if len(data) > LARGEST:
        raise ValueError(f"it has more than {LARGEST} bytes")
    try:
        content = sealed.read(data)
        record = Record(**(_plainly(data) if content is None else content))
    except (TypeError, AttributeError, KeyError) as error:
        raise ValueError("it is no record") from error
    _check_form(record)
    return record


def _plainly(data: bytes) -> dict[str, Any]:
    """Return what a text holds, in whatever form of JSON, without its seal."""
    content: dict[str, Any] = parse_json(data)
    seal = content.pop("seal")
    # The first is what records had for a seal before their text had one: they are the most that come here.
    if seal != fingerprint.digest(content) and seal != sealed.seal_of(content):
        raise ValueError("its seal is broken: it was altered")
    return content


def _check_form(record: Record) -> None:
    named = (record.stage, record.unit, record.key)
    if not all(isinstance(part, str) for part in named) or not is_entry(named):
        raise ValueError("it names no stage, unit and key")
    if not all(isinstance(part, dict) for part in (record.parts, record.outputs, record.summary, record.provenance)):
        raise ValueError("it is no record")
    if len(record.outputs) > _MOST_FILES:
        raise ValueError(f"it names {len(record.outputs)} files; allowed: {_MOST_FILES}")
    for name, about in record.outputs.items():
        if not is_inside(name):
            raise ValueError(f"{name!r} is no name of a file of an entry")
        size, sha256 = (about.get("size"), about.get("sha256")) if isinstance(about, dict) else (None, None)
        # By its type: True is an int, too.
        if type(size) is not int or size < 0:
            raise ValueError(f"the size of {name} is none")
        if not fingerprint.is_sha256(sha256):
            raise ValueError(f"the hash of {name} is none")
    _check_apart(record.outputs)


def _check_apart(names: Iterable[str]) -> None:
    folders = {str(folder) for name in names if "/" in name for folder in PurePosixPath(name).parents}
    if folders and (both := sorted(folders.intersection(names))):
        raise ValueError(f"{both[0]} is to be a file and a folder")


def is_inside(name: str) -> bool:
    """Return whether a relative name with slashes can be a file's of an entry, in plain sight, beside its record."""
    if _PLAIN_NAME.fullmatch(name):
        return name != RECORD
    return len(name) < 1000 and all(_is_name(part) and part != RECORD for part in name.split("/"))


def _is_name(part: str) -> bool:
    """Return whether a text can be the name of a file or folder, and leads nowhere else."""
    if _PLAIN_NAME.fullmatch(part):
        return True
    return _NAME.fullmatch(part) is not None and is_utf8(part) and len(part.encode()) <= _MOST_BYTES


def is_entry(entry: tuple[str, ...]) -> bool:
    """Return whether three texts name a stage, a unit and a key that can be folders of a cache."""
    stage, unit, key = entry
    return _is_name(stage) and _is_name(unit) and is_key(key)


def dropped(folder: Path | str) -> frozenset[str]:
    """Return the names of an entry's files that were dropped to save disk and are not there."""
    try:
        content = read_json(f"{folder}/{SLIM}")
    except (OSError, ValueError):
        return frozenset()
    names = [name for name in content if isinstance(name, str)] if isinstance(content, list) else []
    return frozenset(name for name in names if is_inside(name) and not os.path.lexists(f"{folder}/{name}"))


def fault(
    folder: Path | str,
    record: Record,
    entry: Entry,
    *,
    verify: bool,
    without: Callable[[], Collection[str]] = tuple,
) -> str:
    """Return what is wrong with the files of an entry, wherever they lie; an empty string where nothing is.

    ``without`` returns names of files that need not be there; it is asked where one is missing.
    """
    if (record.stage, record.unit, record.key) != entry:
        return f"record.json is of {record.stage}/{record.unit}/{record.key}"
    need_not: Collection[str] | None = None
    for name, expected in record.outputs.items():
        path = f"{folder}/{name}"
        try:
            about = os.lstat(path)
        except OSError:
            need_not = without() if need_not is None else need_not
            if name in need_not:
                continue
            return f"{name} is missing"
        if not stat.S_ISREG(about.st_mode):
            return f"{name} is no file but a {_kind(about.st_mode)}"
        if about.st_size != expected["size"]:
            return f"{name} has {about.st_size} bytes instead of {expected['size']}"
        if verify and fingerprint.file_digest(Path(path)) != expected["sha256"]:
            return f"the content of {name} has changed"
    return ""


def sound(folder: str, entry: Entry, *, verify: bool, slim: bool) -> tuple[Record | None, frozenset[str]]:
    """Return the record of a sound entry that lies in a folder, or None; and which of its files were dropped.

    ``slim`` takes also one of which files were dropped for a sound one. The folder is a text: thousands of paths take
    longer to make than to open.
    """
    gone: frozenset[str] = frozenset()

    def without() -> frozenset[str]:
        nonlocal gone
        gone = dropped(folder)
        return gone

    record = read_record(folder)
    # Of few entries files were dropped: which, is looked for where one is missing.
    if record is None or fault(folder, record, entry, verify=verify, without=without if slim else tuple):
        return None, dropped(folder)
    return record, gone


def flaw(folder: Path, entry: Entry, *, verify: bool = False) -> str:
    """Return what is wrong with an entry that lies in a folder; an empty string where it is sound or absent."""
    try:
        folder.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return ""
    record = read_record(folder)
    if record is None:
        return "record.json is missing, unreadable or altered"
    return fault(folder, record, entry, verify=verify, without=functools.partial(dropped, folder))


def _kind(mode: int) -> str:
    return "link" if stat.S_ISLNK(mode) else "folder" if stat.S_ISDIR(mode) else "device or pipe"
