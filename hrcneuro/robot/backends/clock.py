"""Real time."""

from __future__ import annotations

import contextlib
import os
import time


class WallClock:
    """The machine's monotonic clock; its owner asks to be scheduled before others, where that is allowed."""

    def __init__(self) -> None:
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, -15)

    def now(self) -> float:
        """Return the time, seconds."""
        return time.monotonic()

    def wait_until(self, t: float) -> None:
        """Sleep until ``t``."""
        left = t - time.monotonic()
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
