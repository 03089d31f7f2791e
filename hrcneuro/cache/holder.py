"""Who holds a lock: a process, its machine, and when it started, as a number may be given again to another process."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Holder:
    """The process that holds a lock.

    Attributes:
        pid: Its number; 0 where it is unknown.
        host: The name of its machine.
        start: When it started, in the kernel's ticks: a number may be given again to another process.
        task: What it does, in a few words.
    """

    pid: int = 0
    host: str = ""
    start: str = ""
    task: str = ""

    @classmethod
    def me(cls, task: str = "") -> Holder:
        """Return this process."""
        return cls(os.getpid(), socket.gethostname(), started(os.getpid()) or "", task)

    @classmethod
    def read(cls, text: str) -> Holder:
        """Return who a lock file names; nobody where it is in no form that is known."""
        # It is shown on terminals, and whoever may write there may have written it.
        lines = ["".join(c if c.isprintable() else "?" for c in line.strip()) for line in text.splitlines()[:4]]
        pid, host, start, task = [*lines, "", "", "", ""][:4]
        return cls(int(pid), host, start, task) if pid.isascii() and pid.isdecimal() else cls()

    def text(self) -> str:
        """Return what is written into the lock file."""
        return f"{self.pid}\n{self.host}\n{self.start}\n{self.task}\n"

    @property
    def here(self) -> bool:
        """Whether it is a process of this machine."""
        return self.pid > 0 and self.host == socket.gethostname()

    @property
    def dead(self) -> bool:
        """Whether it is known to have ended."""
        if not self.here:
            return False
        start = started(self.pid)
        return start is None or bool(self.start and start and start != self.start)

    def __str__(self) -> str:
        if not self.pid:
            return "an unknown process"
        place = "" if self.here else f" on {self.host or 'an unknown machine'}"
        return f"process {self.pid}{place}" + (f", {self.task}" if self.task else "")


def started(pid: int) -> str | None:
    """Return when a process of this machine started; None where there is none, empty where it cannot be known."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
        state, *fields = text.rpartition(")")[2].split()  # a name before it may hold blanks
        return None if state in "ZX" else fields[18]
    except (OSError, ValueError, IndexError):
        pass
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return None
    except OSError:
        pass
    return ""
