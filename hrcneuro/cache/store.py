"""Entries on disk: ``<root>/<stage>/<unit>/<key16>/`` with natural file names and a ``record.json``, written last.

Correctness rests on one rename; the per-key lock only saves double work.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.cache import fingerprint
from hrcneuro.errors import ConfigError, StageError

RECORD = "record.json"
_TEMPORARY = ".tmp-"


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


class Store:
    """A folder of entries, each under its key: looks them up, publishes, checks and removes them."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def folder(self, stage: str, unit: str, key: str) -> Path:
        """Return where an entry lies or would lie."""
        return self.root / stage / unit / key

    def lookup(self, stage: str, unit: str, key: str, *, verify: bool = False) -> Record | None:
        """Return the record of a sound entry, or None; ``verify`` reads every byte."""
        folder = self.folder(stage, unit, key)
        record = read_record(folder)
        return record if record is not None and not fault(folder, record, verify=verify) else None

    def diagnose(self, stage: str, unit: str, key: str, *, verify: bool = False) -> str:
        """Return what is wrong with an entry that is there; an empty string where it is sound or absent."""
        folder = self.folder(stage, unit, key)
        if not folder.exists():
            return ""
        record = read_record(folder)
        return (
            "record.json is missing, unreadable or altered" if record is None else fault(folder, record, verify=verify)
        )

    def quarantine(self, stage: str, unit: str, key: str) -> Path:
        """Move a bad entry out of the way and return where it went."""
        bad = self.root / ".quarantine" / f"{stage}-{unit}-{key}-{time.time_ns()}"
        with self.guarded():
            bad.parent.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(FileNotFoundError):
                self.folder(stage, unit, key).rename(bad)
        return bad

    @contextlib.contextmanager
    def lock(self, stage: str, unit: str, key: str) -> Iterator[None]:
        """Hold the key's lock; others who want to compute the same wait here."""
        from filelock import FileLock

        with self.guarded():
            lock = FileLock(self._lock_file(stage, unit, key))
            lock.acquire()
        try:
            yield
        finally:
            lock.release()

    def _lock_file(self, stage: str, unit: str, key: str) -> Path:
        folder = self.root / ".locks"
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"{stage}-{unit}-{key}.lock"

    @contextlib.contextmanager
    def workspace(self, stage: str, unit: str, key: str) -> Iterator[Path]:
        """Yield an empty folder beside the entry's place; it is gone afterwards unless it was published."""
        parent = self.folder(stage, unit, key).parent
        with self.guarded():
            parent.mkdir(parents=True, exist_ok=True)
            folder = parent / f"{_TEMPORARY}{key}-{os.getpid()}"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def publish(self, record: Record, work: Path) -> Record:
        """Make the files of ``work`` an entry: hash, write the record, flush, rename. Return the full record."""
        with self.guarded():
            outputs = {}
            for path in sorted(p for p in work.rglob("*") if p.is_file()):
                _flush(path)
                name = path.relative_to(work).as_posix()
                outputs[name] = {"sha256": fingerprint.file_digest(path), "size": path.stat().st_size}
            full = Record(**{**asdict(record), "outputs": outputs})
            write_record(work, full)
            _flush(work / RECORD)
            _flush(work)
            entry = (record.stage, record.unit, record.key)
            target, old = self.folder(*entry), work.with_name(f"{work.name}-old")
            if self.diagnose(*entry):
                self.quarantine(*entry)
            elif target.exists():
                target.rename(old)
            work.rename(target)
            _flush(target.parent)
            shutil.rmtree(old, ignore_errors=True)
        return full

    def entries(self) -> list[Path]:
        """Return the folders of all visible entries, in the order of their names."""
        return sorted(
            p for p in self.root.glob("*/*/*") if p.is_dir() and not any(q.startswith(".") for q in p.parts[-3:])
        )

    def leftovers(self) -> list[Path]:
        """Return what interrupted runs left behind, and what was quarantined."""
        return sorted([*self.root.glob(f"*/*/{_TEMPORARY}*"), *self.root.glob(".quarantine/*")])

    def sweep(self) -> None:
        """Remove the temporary folders of processes that are gone: those whose lock nobody holds."""
        from filelock import FileLock, Timeout

        for folder in self.root.glob(f"*/*/{_TEMPORARY}*"):
            key = folder.name.removeprefix(_TEMPORARY).partition("-")[0]
            with contextlib.suppress(Timeout, OSError):
                lock = self._lock_file(folder.parent.parent.name, folder.parent.name, key)
                with FileLock(lock, timeout=0):
                    shutil.rmtree(folder, ignore_errors=True)

    def guarded(self) -> contextlib.AbstractContextManager[None]:
        """Turn a full or read-only disk into an error with a cure."""
        return guarded(self.root)


@contextlib.contextmanager
def guarded(place: Path) -> Iterator[None]:
    """Turn a full or read-only disk under ``place`` into an error with a cure."""
    try:
        yield
    except OSError as error:
        raise explain_os_error(error, place) from error


def explain_os_error(error: OSError, root: Path) -> ConfigError | StageError:
    """Return the error that a person can act on."""
    import errno

    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return StageError(
            f"the disk of {root} is full",
            cure="free space ('hrcneuro cache gc' drops unused entries) or choose another place: --workdir DIR",
        )
    if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM, errno.ENOTDIR, errno.EEXIST, errno.ENOENT):
        return ConfigError(
            f"{root} cannot be written: {error.strerror}",
            cure="give yourself the right to write there, or choose another place: --workdir DIR or HRCNEURO_CACHE",
        )
    return StageError(f"the disk of {root} failed: {error}", cure="check the disk, then run the same command again")


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


def fault(folder: Path, record: Record, *, verify: bool) -> str:
    """Return what is wrong with an entry's files; an empty string where nothing is."""
    if (record.stage, record.unit, record.key) != folder.parts[-3:]:
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


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
