"""Locks that are files: one holder at a time, who can be named, also where a file system has no file locks.

Where there are file locks (``flock``), the kernel holds the lock and drops it with the process, however that ends; what
is written in the file says who. Where each machine has locks of its own (NFS with ``nolock``, Lustre with
``localflock``), the kernel gives a lock that another machine holds: so it is not taken while the file names somebody
else who has just given a sign of life. Where there are none, the file itself is the lock: it appears at once with its
holder's name in it, and is removed afterwards. One that a killed process of this machine has left is taken over; of
another machine nobody can know but by the sign of life that the holder gives, which is the file's time.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import secrets
import threading
import time
from collections.abc import Callable
from pathlib import Path

from hrcneuro.cache.disk import disk_time
from hrcneuro.cache.holder import Holder

BEAT_S = 2.0
"""A holder gives a sign of life this often."""
PATIENCE_S = 6 * BEAT_S
"""So long a lock's holder on another machine may give no sign of life."""
_WORD_S, _AGAIN_S = 2.0, 60.0
_POLL_S = 0.05
# Longer than anybody needs to remove a file: who left this one was killed at it.
_GUARD_S = 10.0
# More than any holder writes.
_MOST_BYTES = 4096


class Lock:
    """A lock at a path.

    Args:
        place: The file; it stays after a lock by the kernel, so that all who wait mean the same file.
        task: What the holder does, for those who wait.

    Attributes:
        holder: Who held it when it could not be taken.
        flaw: Why the kernel cannot hold it; empty where it can.
    """

    def __init__(self, place: Path, task: str = "") -> None:
        self.place = place
        self.task = task
        self.holder = Holder()
        self.flaw = ""
        self._file: int | None = None
        self._text = ""
        self._lifeless = ""
        self._ahead: float | None = None
        self._end = threading.Event()

    def take(self) -> bool:
        """Return whether the lock is ours now; where it is not, ``holder`` says whose it is.

        Raises:
            OSError: The file can be neither opened nor made.
        """
        self._text = Holder.me(self.task).text()
        taken = self._take_by_kernel()
        if taken is None:
            taken = self._take_by_file()
        if taken:
            self._end = threading.Event()
            threading.Thread(target=self._beat, args=(self._end,), name="lock", daemon=True).start()
        return taken

    def seize(self) -> bool:
        """Take the lock from a holder that gives no sign of life; return False where the kernel still holds it."""
        self._lifeless = self._content()
        return self.take()

    def release(self) -> None:
        """Give the lock back."""
        self._end.set()
        if self._file is None:
            if self._content() == self._text:
                with contextlib.suppress(OSError):
                    self.place.unlink()
            return
        with contextlib.suppress(OSError):
            os.ftruncate(self._file, 0)
        os.close(self._file)
        self._file = None

    @property
    def surely_held(self) -> bool:
        """Whether the holder is known to live: a process of this machine that the kernel, or its start, vouches for."""
        return self.holder.here and not self.holder.dead and bool(self.holder.start or not self.flaw)

    def sign(self) -> tuple[float, str]:
        """Return time and content of the file: while neither changes, its holder gives no sign of life."""
        try:
            # A file that is opened is asked for anew on a network's file system; its status alone may be remembered.
            # Not waited for where somebody has put a pipe there.
            file = os.open(self.place, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError:
            return 0.0, ""
        try:
            return os.fstat(file).st_mtime, os.pread(file, _MOST_BYTES, 0).decode(errors="replace")
        except OSError:
            return 0.0, ""
        finally:
            os.close(file)

    def age(self) -> str:
        """Return how long ago the holder gave its last sign of life, in words."""
        when = self.sign()[0]
        return ago(time.time() - when) if when else "unknown"

    def _take_by_kernel(self) -> bool | None:
        """Return whether the kernel gave us the lock; None where it has none to give."""
        file = _open(self.place)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.holder = Holder.read(self._content())
            os.close(file)
            return False
        except OSError as error:
            # ENOLCK, ENOSYS, ENOTSUP and what else a file system says in their place, such as EPERM.
            self.flaw = error.strerror or str(error)
            os.close(file)
            return None
        if self._lives_elsewhere():
            os.close(file)
            return False
        # Another account's file can be locked, if not written.
        with contextlib.suppress(OSError):
            os.ftruncate(file, 0)
            os.pwrite(file, self._text.encode(), 0)
        self._file = file
        return True

    def _lives_elsewhere(self) -> bool:
        """Return whether the file names another holder who has just given a sign of life, though the kernel knows none.

        By the disk's clock: this machine's may be another one.
        """
        content = self._content()
        if not content or content in (self._text, self._lifeless):
            return False
        holder = Holder.read(content)
        if not holder.pid or holder.dead:
            return False
        try:
            if self._disk_time() - self.sign()[0] >= PATIENCE_S:
                return False
        except OSError:
            return False  # where nothing can be written, nothing can be spoiled
        self.holder = holder
        return True

    def _disk_time(self) -> float:
        """Return the time by the disk's clock, which is asked once: who waits asks for it many times a second."""
        if self._ahead is None:
            self._ahead = disk_time(self.place.parent) - time.monotonic()
        return self._ahead + time.monotonic()

    def _take_by_file(self) -> bool:
        # Between reading, removing and making, another could take the lock: only who has this second file may.
        guard = self.place.with_name(f"{self.place.name}.guard")
        try:
            guard.open("x").close()
        except FileExistsError:
            self.holder = Holder.read(self._content())
            with contextlib.suppress(OSError):
                if self._disk_time() - guard.stat().st_mtime > _GUARD_S:
                    guard.unlink()
            return False
        try:
            return self._take_guarded()
        finally:
            guard.unlink(missing_ok=True)

    def _take_guarded(self) -> bool:
        content = self._content()
        self.holder = Holder.read(content)
        # An empty file is what a lock by the kernel leaves, or whoever has just tried to lock it so.
        if not content or self.holder.dead or content == self._lifeless:
            self.place.unlink(missing_ok=True)
        part = self.place.with_name(f"{self.place.name}.{secrets.token_hex(4)}")
        try:
            part.write_text(self._text, encoding="utf-8", errors="replace")
            # Unlike a file that is made and then written, a link appears with its content.
            os.link(part, self.place)
        except FileExistsError:
            self.holder = Holder.read(self._content())
            return False
        except OSError:
            return self._take_by_exclusive_file()
        finally:
            with contextlib.suppress(OSError):
                part.unlink()
        return True

    def _take_by_exclusive_file(self) -> bool:
        try:
            with self.place.open("x", encoding="utf-8", errors="replace") as file:
                file.write(self._text)
        except FileExistsError:
            self.holder = Holder.read(self._content())
            return False
        return True

    def _content(self) -> str:
        """Return what the file says; empty where it is not there, or is no file."""
        return self.sign()[1]

    def _beat(self, end: threading.Event) -> None:
        while not end.wait(BEAT_S):
            with contextlib.suppress(OSError):
                os.utime(self.place)


def wait_for(
    lock: Lock, tell: Callable[[str], None], *, patience_s: float, ended: threading.Event | None = None
) -> bool:
    """Return once the lock is ours (True), or is held by one who may be gone and gives no sign of life (False).

    Args:
        lock: The lock.
        tell: Is told who is waited for, once the wait is long enough to be noticed.
        patience_s: So long a holder may give no sign of life: one on another machine, or a process of this one whose
            number may have been given again.
        ended: Once it is set nobody wants the lock any more (False).

    Raises:
        OSError: The file can be neither opened nor made.
    """
    begin = heard = time.monotonic()
    sign, word_at = (-1.0, ""), begin + _WORD_S
    while not lock.take():
        if ended is not None and ended.is_set():
            return False
        now = time.monotonic()
        if (new := lock.sign()) != sign:
            sign, heard = new, now
        # Whoever lets go of a lock of the kernel's empties the file first: for an instant it names nobody.
        patience = patience_s if lock.holder.pid else max(patience_s, BEAT_S)
        if not lock.surely_held and now - heard >= patience:
            tell(f"{lock.holder} has given no sign of life for {patience_s:g} s and is taken to be gone: {lock.place}")
            return lock.seize()
        if now >= word_at:
            end = "" if lock.surely_held else f"; without one in {patience_s:g} s it is taken to be gone"
            tell(f"waiting for {lock.holder}: it holds {lock.place}, last sign of life {lock.age()}{end}")
            word_at = now + _AGAIN_S
        time.sleep(_POLL_S)
    return True


def ago(seconds: float) -> str:
    """Return a time that has passed in words."""
    for size, name in ((86400, "days"), (3600, "hours"), (60, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {name} ago"
    return f"{max(0.0, seconds):.0f} s ago"


def _open(place: Path) -> int:
    # Not created where it is there already: in a folder that all may write, Linux refuses to create over another
    # account's file, but lets it be opened.
    for flags in (os.O_RDWR, os.O_RDONLY):
        try:
            return os.open(place, flags | os.O_NOFOLLOW | os.O_NONBLOCK)
        except PermissionError:
            continue
        except FileNotFoundError:
            break
    file = os.open(place, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    # Whoever may reach the folder may wait here, whatever the maker's umask.
    with contextlib.suppress(OSError):
        os.fchmod(file, 0o666)
    return file
