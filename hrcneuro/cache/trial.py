"""A test of the file system under a cache: an entry's whole life in it, a lock, and what a rename does."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from hrcneuro.cache.locks import Lock
from hrcneuro.cache.record import Record
from hrcneuro.cache.store import Store


def try_cache(root: Path, notes: list[str]) -> dict[str, str]:
    """Return step -> ``ok`` or what went wrong, of an entry's whole life in the cache's own file system."""
    steps: dict[str, Callable[[Store], None]] = {
        "write, publish": _publish,
        "read, verify": _read_back,
        "notice damage": _damage,
        "lock": _lock,
        "rename": _rename,
    }
    new = not root.exists()
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".doctor-", dir=root) as folder:
            store = Store(Path(folder))
            notes += [flaw] if (flaw := store.flaw_of_locks(root)) else []
            return {name: _attempt(lambda step=step: step(store)) for name, step in steps.items()}  # type: ignore[misc]
    except OSError as error:
        return {"write, publish": f"{root} cannot be written: {error.strerror}"}
    finally:
        # Who only asks wants no folder.
        with contextlib.suppress(OSError):
            root.rmdir() if new else None


def _attempt(step: Callable[[], None]) -> str:
    try:
        step()
    except Exception as error:
        return f"{type(error).__name__}: {error}".splitlines()[0]
    return "ok"


_ENTRY = ("doctor", "test", "0" * 16)


def _publish(store: Store) -> None:
    with store.workspace(*_ENTRY) as work:
        (work / "data.bin").write_bytes(bytes(range(256)) * 4096)
        store.publish(Record(*_ENTRY, {}, {}), work)


def _read_back(store: Store) -> None:
    if store.lookup(*_ENTRY, verify=True) is None:
        raise OSError("what was written is not what is read")


def _damage(store: Store) -> None:
    path = store.folder(*_ENTRY) / "data.bin"
    path.write_bytes(b"\xff" + path.read_bytes()[1:])
    if store.lookup(*_ENTRY, verify=True) is not None:
        raise OSError("a changed byte was not noticed")
    store.quarantine(*_ENTRY)


def _lock(store: Store) -> None:
    place = store.root / "lock"
    mine, other = Lock(place), Lock(place)
    if not mine.take():
        raise OSError("a lock that nobody holds cannot be taken")
    try:
        if other.take():
            other.release()
            raise OSError("two could hold the same lock: on this file system, start only one run at a time")
    finally:
        mine.release()


def _rename(store: Store) -> None:
    old, new = store.root / "old", store.root / "new"
    for folder in (old, new):
        folder.mkdir()
        (folder / folder.name).touch()
    aside = store.root / "aside"
    new.rename(aside)
    old.rename(new)
    if not (new / "old").exists() or not (aside / "new").exists():
        raise OSError("a renamed folder does not hold its files")
    before = time.time_ns()
    (new / "now").touch()
    if abs((new / "now").stat().st_mtime_ns - before) > 60_000_000_000:
        raise OSError("the file system's clock is more than a minute off this machine's")
