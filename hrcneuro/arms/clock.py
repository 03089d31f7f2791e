"""The machine's own time for the loop: a monotonic clock with a place before other work, and the arm's stamps on it."""

from __future__ import annotations

import contextlib
import os
import time

# Linux's monotonic clock stands still while a laptop sleeps, so that a session would wake up and see no gap.
_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
_PRIORITY = 20  # of 1 to 99: before all ordinary work, behind the kernel's own


def seconds() -> float:
    """Return the machine's monotonic time, sleep included."""
    return time.clock_gettime(_CLOCK)


class WallClock:
    """The machine's monotonic clock, which counts the time that the machine sleeps."""

    def __init__(self) -> None:
        self._before: tuple[int, os.sched_param] | None = None
        self._nice: int | None = None

    def raise_priority(self) -> None:
        """Have this thread, and what it starts from now on, run before the machine's other work, where that is allowed.

        A high priority among ordinary programs is not enough: Linux shares the processor among sessions first, and on a
        busy machine a cycle came hundreds of milliseconds late.
        """
        try:
            before = os.sched_getscheduler(0), os.sched_getparam(0)
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
            self._before = before
        except (OSError, AttributeError):
            with contextlib.suppress(OSError):
                nice = os.getpriority(os.PRIO_PROCESS, 0)
                os.setpriority(os.PRIO_PROCESS, 0, -15)
                self._nice = nice

    def restore_priority(self) -> None:
        """Let this thread run as it did before :meth:`raise_priority`."""
        if self._before is not None:
            os.sched_setscheduler(0, *self._before)
            self._before = None
        if self._nice is not None:
            os.setpriority(os.PRIO_PROCESS, 0, self._nice)
            self._nice = None

    def now(self) -> float:
        """Return the time, seconds."""
        return seconds()

    def wait_until(self, t: float) -> None:
        """Sleep until ``t``."""
        left = t - seconds()
        if left > 0.0:
            time.sleep(left)


class Stamps:
    """Puts the arm's timestamps on this machine's clock: the quickest packet seen defines the offset.

    A packet that was under way longer than the quickest is as much older; so a delay shows as age. The offset gives
    way by a ten-thousandth of the time passed, which is more than two clocks of crystals drift apart.
    """

    def __init__(self) -> None:
        self._offset = float("inf")
        self._seen = 0.0

    def local(self, stamp: float, now: float) -> float:
        """Return the time on this machine's clock at which a packet of ``stamp``, read at ``now``, was made."""
        self._offset = min(self._offset + 1e-4 * (now - self._seen), now - stamp)
        self._seen = now
        return stamp + self._offset
