"""What the loop needs of an arm and of a clock. Backends differ; the loop does not."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

from hrcneuro import published

RATE = published.LOOP_HZ.value  # the UR10 CB3's control rate, Hz
PERIOD = 1.0 / RATE

# Bits of RTDE's safety_status_bits and values of runtime_state ("RTDE guide", Universal Robots).
NORMAL, PROTECTIVE, EMERGENCY = 1 << 0, 1 << 2, 1 << 7
STOPPED, PLAYING, PAUSED = 1, 2, 4


@dataclass(slots=True)
class Packet:
    """What the arm tells of itself in one cycle."""

    stamp: float  # when the packet was made, on the loop's clock, seconds
    q: list[float]  # measured joint angles, six, radians
    qd: list[float]  # measured joint velocities, six, rad/s
    safety: int = NORMAL
    runtime: int = PLAYING
    scaling: float = 1.0  # the speed slider, 0 … 1


class Backend(Protocol):
    """An arm that takes joint velocities."""

    def state(self) -> Packet:
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


class Cause(enum.Enum):
    """Why a session cannot go on; whoever talks to people finds by it what they can do."""

    EMERGENCY_STOP = enum.auto()
    PROTECTIVE_STOP = enum.auto()
    NOT_NORMAL = enum.auto()  # another safety mode
    SAFETY_BITS = enum.auto()  # a restriction beside the normal mode
    PACKETS_LOST = enum.auto()
    LATE = enum.auto()  # the session itself was held up: nobody supervised meanwhile
    NOT_KEPT = enum.auto()  # what the session does cannot be written down
    ALONE = enum.auto()  # whoever asks for the motions is gone
    PROGRAM = enum.auto()  # the control program is paused or has ended
    SLIDER = enum.auto()  # the speed slider stands too low
    NO_NUMBER = enum.auto()  # a command is none
    OUT_OF_BOX = enum.auto()  # a command would lead out of the keep-inside box
    OFF_PATH = enum.auto()  # the tip is too far from where it should be on its way
    TIP_ASTRAY = enum.auto()  # the tip did not arrive
    JOINT_ASTRAY = enum.auto()
    STARTS_OUTSIDE = enum.auto()  # of the keep-inside box
    STARTS_FOLDED = enum.auto()  # with another elbow or wrist than at home
    SLOW_ANSWER = enum.auto()  # commands and packets take too long, evenly
    NO_RESPONSE = enum.auto()  # commands do not move it
    OTHER_RESPONSE = enum.auto()  # it moves otherwise than commanded


class ArmError(RuntimeError):
    """The session cannot go on: why, and what was seen, for a person to read."""

    def __init__(self, cause: Cause, problem: str) -> None:
        super().__init__(cause, problem)
        self.cause = cause
        self.problem = problem

    def __str__(self) -> str:
        return self.problem


class Stopped(ArmError):
    """The session ended before its last move; what was recorded until then is kept.

    Attributes:
        rests: Whether the arm was seen at rest afterwards.
    """

    def __init__(self, cause: Cause, problem: str, *, rests: bool) -> None:
        seen = (
            "the arm was stopped" if rests else "the arm was told to stop, but was not seen at rest: it may be moving"
        )
        super().__init__(cause, f"{problem}; {seen}")
        self.rests = rests
