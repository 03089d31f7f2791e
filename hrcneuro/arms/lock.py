"""One session an arm: who drives it holds a lock on this machine, which ends with the process however that ends."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

from hrcneuro.errors import HardwareError


@contextlib.contextmanager
def exclusive(backend: str, host: str, subject: str) -> Iterator[None]:
    """Keep the arm of ``backend`` at ``host`` for ``subject``'s session alone.

    Raises:
        HardwareError: Another session on this machine drives it, or its lock cannot be opened.
    """
    arm = f"{backend} at {host}" if host else backend
    place = _place(backend, host)
    try:
        file = _open(place)
    except OSError as error:
        raise HardwareError(
            f"the lock of the arm ({arm}), {place}, cannot be opened: {error.strerror}",
            cure="see who owns that file, and that the folder for temporary files (TMPDIR) can be written",
        ) from error
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(file, 200, 0).decode(errors="replace") or "another session"
            raise HardwareError(
                f"the arm ({arm}) is driven by {holder}; nothing has moved",
                cure="wait until that session has ended, or end it with Ctrl-C where it runs",
            ) from None
        # The file stays: were it removed, a third session could lock a new one beside a second that has the old.
        os.ftruncate(file, 0)
        os.pwrite(file, f"process {os.getpid()}, the session of {subject}".encode(), 0)
        yield
    finally:
        os.close(file)


def _place(backend: str, host: str) -> Path:
    # A name and its number are one arm.
    with contextlib.suppress(OSError, UnicodeError):
        host = socket.gethostbyname(host) if host else host
    name = hashlib.sha256(f"{backend} {host}".encode()).hexdigest()[:16]
    return Path(tempfile.gettempdir()) / f"hrcneuro-arm-{name}.lock"


def _open(place: Path) -> int:
    # Not created where it is there already: in a folder that all may write, Linux refuses to create over another
    # account's file, but lets it be opened.
    try:
        return os.open(place, os.O_RDWR | os.O_NOFOLLOW)
    except FileNotFoundError:
        file = os.open(place, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        with contextlib.suppress(OSError):
            os.fchmod(file, 0o666)
        return file
