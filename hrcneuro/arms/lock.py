"""One session an arm: who drives it holds a name in the kernel, which is gone with the process however that ends.

The name is a Unix socket's in Linux's abstract space. No file lies anywhere, so that neither another account nor
another folder for temporary files (TMPDIR, PrivateTmp=) hides one session from another.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

from hrcneuro.errors import HardwareError

_LONGEST = 100  # characters of a command line


@contextlib.contextmanager
def exclusive(backend: str, host: str) -> Iterator[None]:
    """Keep the arm of ``backend`` at ``host`` for one session alone.

    Raises:
        HardwareError: Another session on this machine drives it.
    """
    arm = f"{backend} at {host}" if host else backend
    address = _address(backend, host)
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as name:
        try:
            name.bind(address)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise HardwareError(
                f"the arm ({arm}) is driven by {_holder(address)}; nothing has moved",
                cure="wait until that session has ended, or end it with Ctrl-C where it runs",
            ) from error
        # Who asks for the holder connects, and is told by the kernel; nobody needs to answer.
        name.listen(128)
        yield


def _address(backend: str, host: str) -> str:
    # A name and its number are one arm.
    with contextlib.suppress(OSError, UnicodeError):
        host = socket.gethostbyname(host) if host else host
    return f"\0hrcneuro-arm-{hashlib.sha256(f'{backend} {host}'.encode()).hexdigest()[:16]}"


def _holder(address: str) -> str:
    """Return who holds the name: the number of the process and its command line, as far as they can be seen."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
            link.setblocking(False)
            link.connect(address)
            pid, _, _ = struct.unpack("3i", link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
    except OSError:
        return "another session"
    words: list[str] = []
    # Not there in another space of processes, not to be read where the system hides other accounts' processes.
    with contextlib.suppress(OSError):
        words = Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8", errors="replace").split("\0")
    line = " ".join(words).strip()
    line = line if len(line) <= _LONGEST else f"{line[:_LONGEST]} …"
    return f"process {pid} ({line})" if line else f"process {pid}"
