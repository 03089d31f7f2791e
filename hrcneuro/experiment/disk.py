"""Files that grow line by line, and what waits for the disk in their place.

A line is with the system as soon as it is written: a process that is killed loses none. That it is also on the disk,
should the power fail, takes milliseconds to a second; a thread waits for that, so that nobody else does.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable
from pathlib import Path


class Growing:
    """A file to whose end lines are added; what the disk has no room for is kept, and written with the next.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path, *, new: bool) -> None:
        """Open the file.

        Args:
            path: Its place.
            new: It must not be there.

        Raises:
            OSError: It cannot be opened, or is there already.
        """
        self.path = path
        self._waiting = self._torn = b""
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | (os.O_EXCL if new else 0), 0o666)

    def add(self, line: str) -> None:
        """Add a line to what :meth:`write` has to write."""
        # A lone surrogate, as another program's JSON may have it, is no UTF-8; so written, JSON reads it again.
        self._waiting += line.encode(errors="backslashreplace")

    def write(self) -> None:
        """Write all that waits.

        Raises:
            OSError: The disk took a part of it; the rest waits.
        """
        while self._waiting:
            written = os.write(self._file, self._waiting)
            self._torn = (self._torn + self._waiting[:written]).rpartition(b"\n")[2]
            self._waiting = self._waiting[written:]

    @property
    def missing(self) -> str:
        """The lines that wait, whole also where the disk took a part of the first."""
        return (self._torn + self._waiting).decode() if self._waiting else ""

    def sync(self) -> None:
        """Wait until all that was written is on the disk.

        Raises:
            OSError: It cannot come there.
        """
        os.fsync(self._file)

    def close(self) -> None:
        """Close the file; what waits is lost."""
        os.close(self._file)


def replaced(path: Path, write: Callable[[Path], object], *, sync: bool = True) -> None:
    """Let a file appear anew, whole.

    Args:
        path: The file.
        write: Writes what it is given the place of.
        sync: Whether to wait until it is on the disk.

    Raises:
        OSError: It cannot be written; the former one stays.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        write(part)
        if sync:
            sync_path(part)
        part.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def sync_path(path: Path) -> None:
    """Wait until a file or folder is on the disk.

    Raises:
        OSError: It cannot come there.
    """
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


class Waiter:
    """A thread that does what takes long, the newest of each kind; without a thread it is done at once.

    What went wrong is told by :meth:`take_fault`, unless the same was asked for again since: then that tells.
    """

    def __init__(self, *, thread: bool) -> None:
        self._faults: dict[str, Exception] = {}
        self._jobs: dict[str, Callable[[], object]] = {}
        self._changed = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="log", daemon=True) if thread else None
        if self._thread is not None:
            self._thread.start()

    def do(self, kind: str, job: Callable[[], object]) -> None:
        """Have something done soon; what waits of the same kind need not be done any more.

        Raises:
            OSError: There is no thread, and it cannot be done.
        """
        if self._thread is None:
            job()
            return
        with self._changed:
            self._faults.pop(kind, None)
            self._jobs[kind] = job
            self._changed.notify()

    def take_fault(self) -> Exception | None:
        """Return what went wrong since this was last asked; None where nothing did."""
        with self._changed:
            faults = [*self._faults.values()]
            self._faults.clear()
        return faults[0] if faults else None

    def end(self) -> None:
        """Do all that waits, and end."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._jobs or self._ended)
                if not self._jobs:
                    return
                kind = next(iter(self._jobs))
                job = self._jobs.pop(kind)
            try:
                job()
            except Exception as error:
                # Whoever writes next is told; what comes until then must still come to the disk.
                with self._changed:
                    self._faults[kind] = error
