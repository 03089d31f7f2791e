"""What libraries of another process write on standard error, taken line by line, so that it spoils no picture here."""

from __future__ import annotations

import contextlib
import os
import sys
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext

_PIECE = 65536  # bytes: as much as a pipe holds
_LONGEST = 2000  # bytes of a line that has no end yet


class Lines:
    """The reading end, in this process."""

    def __init__(self, reading: Connection) -> None:
        """Take the end of a pipe into which another process writes; see :func:`pass_on`."""
        self._reading, self._begun = reading, b""
        os.set_blocking(reading.fileno(), False)

    @classmethod
    def pipe(cls, context: BaseContext) -> tuple[Lines, Connection]:
        """Return the reading end, and the other one for a process that is about to be started."""
        reading, writing = context.Pipe(duplex=False)
        return cls(reading), writing

    def take(self) -> list[str]:
        """Return the lines that have come since the last call; never waits."""
        text = self._begun
        with contextlib.suppress(OSError):
            while piece := os.read(self._reading.fileno(), _PIECE):
                text += piece
        *whole, self._begun = text.split(b"\n")
        if len(self._begun) > _LONGEST:
            whole, self._begun = [*whole, self._begun], b""
        return [line for one in whole if (line := one.decode(errors="replace").strip())]

    def close(self) -> None:
        """Take no more."""
        self._reading.close()


def pass_on(writing: Connection) -> None:
    """Let what libraries write on standard error go into a pipe; Python's own words go where they went.

    Nobody is kept waiting: where the pipe is full, or nobody reads it, the line is lost.
    """
    # Whoever sits at the terminal must read of an arm that moves also when the process that reads the pipe has ended.
    sys.stderr = os.fdopen(os.dup(2), "w", buffering=1, errors="backslashreplace")
    os.set_blocking(writing.fileno(), False)
    os.dup2(writing.fileno(), 2)
    writing.close()
