"""What else this machine did while an arm was driven: whose work holds up a control loop."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

_PROC = Path("/proc")
_NAMED = 3
# A share of one core below this holds nobody up.
_NOTICEABLE = 0.05


class Machine:
    """Takes down what every process has computed so far, to tell later who has computed since."""

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._spent = dict(_spent())

    def words(self) -> str:
        """Return the load since then and the processes beside this session that computed most, largest first."""
        seconds = max(time.monotonic() - self._begun, 1e-3)
        shares = {process: (spent - self._spent.get(process, 0.0)) / seconds for process, spent in _spent()}
        most = sorted(shares, key=shares.__getitem__, reverse=True)[:_NAMED]
        named = [f"{process[1]} ({100 * shares[process]:.0f} % of a core, process {process[0]})" for process in most
                 if shares[process] >= _NOTICEABLE]  # fmt: skip
        with contextlib.suppress(OSError):
            load = f"a load of {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
            return f"this machine has {load}; beside this session ran: {', '.join(named) or 'no busy program'}"
        return ""


Process = tuple[int, str, int]
"""Number, name and start of a process: a number is used again."""


def _spent() -> Iterator[tuple[Process, float]]:
    """Yield how many seconds of a core each process has used that is neither this one nor of its making."""
    second = os.sysconf("SC_CLK_TCK")
    own = {os.getpid()}
    # Where there is no such folder (macOS), nothing is named. Numbers grow: parents come before their children.
    for number in sorted(int(place.name) for place in _PROC.glob("[0-9]*")):
        # It may end at any moment.
        with contextlib.suppress(OSError, ValueError, IndexError):
            head, _, tail = (_PROC / str(number) / "stat").read_text(errors="replace").rpartition(")")
            fields = tail.split()
            if number in own or int(fields[1]) in own:
                own.add(number)
                continue
            yield (number, head.partition("(")[2], int(fields[19])), (int(fields[11]) + int(fields[12])) / second
