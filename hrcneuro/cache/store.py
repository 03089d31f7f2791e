"""Entries on disk: ``<root>/<stage>/<unit>/<key16>/`` with natural file names and a ``record.json``, written last.

Correctness rests on one rename; the per-key lock only saves double work.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path

from hrcneuro.cache import fingerprint
from hrcneuro.cache.disk import flush, guarded, make_folder, remove, share
from hrcneuro.cache.locks import PATIENCE_S, Lock, wait_for
from hrcneuro.cache.record import (
    Entry,
    Record,
    entry_of,
    flaw,
    is_key,
    sound,
    write_record,
)
from hrcneuro.errors import HrcError

_TEMPORARY, _OLD = ".tmp-", "-old"
_DROPPED, _QUARANTINE, _LOCKS = ".dropped", ".quarantine", ".locks"
# Of no concern to those who wait for a lock: what comes next fails of the same, and says it.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
# What renaming says of a place where another folder is.
_TAKEN = (errno.ENOTEMPTY, errno.EEXIST)


class Store:
    """A folder of entries, each under its key: looks them up, publishes, checks and removes them."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def folder(self, stage: str, unit: str, key: str) -> Path:
        """Return where an entry lies or would lie."""
        return self.root / stage / unit / key

    def lookup(self, stage: str, unit: str, key: str, *, verify: bool = False, slim: bool = False) -> Record | None:
        """Return the record of a sound entry, or None.

        ``verify`` reads every byte; ``slim`` takes also one of which files were dropped to save disk.
        """
        return self.look(stage, unit, key, verify=verify, slim=slim)[0]

    def look(
        self, stage: str, unit: str, key: str, *, verify: bool = False, slim: bool = False
    ) -> tuple[Record | None, frozenset[str]]:
        """Return what :meth:`lookup` does, and the names of the entry's files that were dropped to save disk."""
        return sound(f"{self.root}/{stage}/{unit}/{key}", (stage, unit, key), verify=verify, slim=slim)

    def diagnose(self, stage: str, unit: str, key: str, *, verify: bool = False) -> str:
        """Return what is wrong with an entry that is there; an empty string where it is sound or absent."""
        with self.guarded():
            return flaw(self.folder(stage, unit, key), (stage, unit, key), verify=verify)

    def quarantine(self, stage: str, unit: str, key: str) -> Path:
        """Move a bad entry out of the way and return where it went."""
        with self.guarded():
            return self._quarantine(self.folder(stage, unit, key), (stage, unit, key))

    def _quarantine(self, folder: Path, entry: Entry) -> Path:
        bad = self.root / _QUARANTINE / f"{'-'.join(entry)}-{time.time_ns()}"
        make_folder(bad.parent, self.root)
        with contextlib.suppress(FileNotFoundError):
            folder.rename(bad)
        return bad

    @contextlib.contextmanager
    def lock(
        self,
        stage: str,
        unit: str,
        key: str,
        *,
        tell: Callable[[str], None] = lambda text: None,
        patience_s: float = PATIENCE_S,
        ended: threading.Event | None = None,
    ) -> Iterator[None]:
        """Hold the key's lock; others who want to compute the same wait here.

        Where there is no lock to be had, the work goes on without: it may then be done twice, never wrongly.

        Args:
            stage, unit, key: The entry.
            tell: Is told who is waited for, and why the work goes on without a lock.
            patience_s: So long a holder on another machine may give no sign of life.
            ended: Once it is set the lock is not waited for any more: who set it does no more work.

        Raises:
            ConfigError: There is no cache, and it cannot be made.
        """
        lock = self._lock(stage, unit, key)
        held = False
        with self.guarded():
            make_folder(self.root, self.root)
        try:
            make_folder(lock.place.parent, self.root)
            held = wait_for(lock, tell, patience_s=patience_s, ended=ended)
        except OSError as error:
            if error.errno not in _NO_ROOM:
                tell(f"no lock can be had, the work goes on without: {lock.place}: {error.strerror}")
        try:
            yield
        finally:
            if held:
                lock.release()

    def flaw_of_locks(self, named: Path | None = None) -> str:
        """Say that the kernel holds no locks in this cache; empty where it does, or nothing can be tried."""
        lock = self._lock("probe", str(os.getpid()), f"{time.time_ns():x}")
        try:
            make_folder(lock.place.parent, self.root)
            if lock.take():
                lock.release()
            lock.place.unlink(missing_ok=True)
        except OSError:
            return ""
        if not lock.flaw:
            return ""
        return (
            f"file locks do not work in {named or self.root} ({lock.flaw}): files stand in for them; two runs may do "
            "the same work twice, and what appears is whole all the same"
        )

    def _lock(self, stage: str, unit: str, key: str) -> Lock:
        return Lock(self.root / _LOCKS / f"{stage}-{unit}-{key}.lock", f"which computes {stage} of {unit}")

    @contextlib.contextmanager
    def workspace(self, stage: str, unit: str, key: str) -> Iterator[Path]:
        """Yield an empty folder beside the entry's place; it is gone afterwards unless it was published."""
        parent = self.folder(stage, unit, key).parent
        with self.guarded():
            make_folder(parent, self.root)
            # Where locks fail, a process of another machine may have our number.
            folder = parent / f"{_TEMPORARY}{key}-{secrets.token_hex(4)}-{os.getpid()}"
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
                name = path.relative_to(work).as_posix()
                outputs[name] = {"sha256": fingerprint.file_digest(path), "size": path.stat().st_size}
            full = Record(**{**asdict(record), "outputs": outputs})
            write_record(work, full)
            self.place(full, work)
        return full

    def place(self, record: Record, work: Path) -> None:
        """Let ``work``, which has an entry's files and record, take the entry's place: flush, rename."""
        with self.guarded():
            for path in (work, *work.rglob("*")):
                share(path, self.root)
                flush(path)
            self._put(work, (record.stage, record.unit, record.key))

    def _put(self, work: Path, entry: Entry) -> None:
        """Let ``work`` take the entry's place; where locks fail, others may do the same at the same time."""
        target, old = self.folder(*entry), work.with_name(f"{work.name}{_OLD}")
        while True:
            try:
                shutil.rmtree(old, ignore_errors=True)
                with contextlib.suppress(FileNotFoundError):
                    target.rename(old)
                # Judged where nobody else replaces it meanwhile: else a sound one could pass for bad.
                if flaw(old, entry):
                    self._quarantine(old, entry)
                work.rename(target)
                break
            except OSError as error:
                if error.errno not in _TAKEN:
                    raise
        flush(target.parent)
        shutil.rmtree(old, ignore_errors=True)

    def entries(self) -> list[Path]:
        """Return the folders of all visible entries, in the order of their names."""
        with self.guarded():
            return sorted(
                p
                for p in self.root.glob("*/*/*")
                # What has another name is none of this cache's: somebody may have put a recording there.
                if is_key(p.name) and p.is_dir() and not any(q.startswith(".") for q in p.parts[-3:])
            )

    def entries_of(self, stage: str, unit: str) -> set[Entry]:
        """Return the visible entries of a stage and unit, under whatever key."""
        with self.guarded():
            return {(stage, unit, p.name) for p in (self.root / stage / unit).glob("*") if is_key(p.name)}

    def quarantined(self) -> list[Path]:
        """Return the bad entries that were moved out of the way."""
        return sorted(self.root.glob(f"{_QUARANTINE}/*"))

    def leftovers(self) -> list[Path]:
        """Return what interrupted runs left behind, and what was quarantined."""
        return sorted([*self.root.glob(f"*/*/{_TEMPORARY}*"), *self.quarantined()])

    def drop(self, folders: Iterable[Path], used: Callable[[], Container[Entry]]) -> list[Path]:
        """Remove visible entries that nobody points at; return those that went, not what somebody points at by now.

        They are taken out of sight first, and then it is asked once more which are ``used``: who claims an entry and
        sees it after that is noticed here, and who claims it later sees it no more.
        """
        place = self.root / _DROPPED / f"{time.time_ns():x}-{secrets.token_hex(4)}"
        aside: dict[Path, Path] = {}
        back: list[Path] = []
        try:
            with self.guarded():
                for folder in folders:
                    out = place.joinpath(*entry_of(folder))
                    # Gone already, or another process has just removed our folder, which was empty: then it stays.
                    with contextlib.suppress(FileNotFoundError):
                        make_folder(out.parent, self.root)
                        folder.rename(out)
                        aside[out] = folder
        finally:
            back = self._settle(aside, used)
        return [folder for out, folder in aside.items() if out not in back]

    def settle(self, used: Callable[[], Container[Entry]]) -> None:
        """Bring to an end what a killed ``drop`` began."""
        self._settle([p for p in self.root.glob(f"{_DROPPED}/*/*/*/*") if is_key(p.name)], used)

    def _settle(self, aside: Iterable[Path], used: Callable[[], Container[Entry]]) -> list[Path]:
        """Put dropped entries back where somebody points at them, else remove them; return those that were put back."""
        entries = {out: entry_of(out) for out in aside}
        try:
            wanted = used() if entries else ()
        except HrcError:
            # While it is not known what is pointed at, nothing may go.
            self._clear(entries, set(entries.values()))
            raise
        return self._clear(entries, wanted)

    def _clear(self, entries: Mapping[Path, Entry], wanted: Container[Entry]) -> list[Path]:
        back = [out for out, entry in entries.items() if entry in wanted]
        with self.guarded():
            for out in back:
                self._restore(out, self.folder(*entries[out]))
            for out in entries:
                remove(out)
        # What is not empty is another process's, which is about to put an entry there.
        for pattern in ("*/*/*", "*/*", "*"):
            for folder in self.root.glob(f"{_DROPPED}/{pattern}"):
                with contextlib.suppress(OSError):
                    folder.rmdir()
        return back

    def _restore(self, aside: Path, target: Path) -> None:
        """Put an entry back into its place; where another has been made meanwhile, it is not needed."""
        try:
            aside.rename(target)
        except FileNotFoundError:
            pass
        except OSError as error:
            if error.errno not in _TAKEN:
                raise

    def sweep(self) -> None:
        """Remove the temporary folders of processes that are gone: those whose lock nobody holds, on any machine.

        An entry that was being replaced when its process was killed goes back into its place.
        """
        for folder in self.root.glob(f"*/*/{_TEMPORARY}*"):
            key = folder.name.removeprefix(_TEMPORARY).partition("-")[0]
            lock = self._lock(folder.parent.parent.name, folder.parent.name, key)
            with contextlib.suppress(OSError):
                make_folder(lock.place.parent, self.root)
                if lock.take():
                    if folder.name.endswith(_OLD):
                        self._restore(folder, folder.parent / key)
                    shutil.rmtree(folder, ignore_errors=True)
                    lock.release()

    def guarded(self) -> contextlib.AbstractContextManager[None]:
        """Turn what the disk refuses into an error with a cure."""
        return guarded(self.root)
