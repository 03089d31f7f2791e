"""What the loop needs of an arm and of a clock. Backends differ; the loop does not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from hrcneuro.errors import HardwareError

RATE = 125.0  # Hz: the UR10 CB3's control rate (paper § 2.3.2)
PERIOD = 1.0 / RATE

# Bits of RTDE's safety_status_bits and values of runtime_state ("RTDE guide", Universal Robots).
NORMAL, PROTECTIVE, EMERGENCY = 1 << 0, 1 << 2, 1 << 7
STOPPED, PLAYING, PAUSED = 1, 2, 4


@dataclass(slots=True)
class State:
    """One packet from the arm."""

    stamp: float  # when the packet was made, on the loop's clock, seconds
    q: list[float]  # measured joint angles, six, radians
    qd: list[float]  # measured joint velocities, six, rad/s
    safety: int = NORMAL
    runtime: int = PLAYING
    scaling: float = 1.0  # the speed slider, 0 … 1


class Backend(Protocol):
    """An arm that takes joint velocities."""

    def state(self) -> State:
        """Return the newest packet."""

    def speed(self, qd: list[float]) -> None:
        """Command joint velocities, six, rad/s; they hold for a few cycles only, so that silence stops the arm."""

    def stop(self, deceleration: float) -> None:
        """Bring the arm to rest at ``deceleration``, rad/s²."""

    def close(self) -> None:
        """Let go of the arm."""


class Clock(Protocol):
    """Where the loop gets its time."""

    def now(self) -> float:
        """Return the time, seconds, never decreasing."""

    def wait_until(self, t: float) -> None:
        """Return at ``t`` or, if that has passed, at once."""


class Stopped(HardwareError):
    """The session ended before its last move; what was recorded until then is kept."""
