"""The in-process arm: a kinematic UR10. On a virtual clock it is deterministic, and far faster than real time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

from hrcneuro.robot.backend import EMERGENCY, PERIOD, PROTECTIVE, STOPPED, Clock, Packet

LEAD = 0.027  # seconds by which the arm trails its commands: a cycle of delay, the lag, half a cycle for the hold
_SILENCE = 0.1  # seconds without a command after which the arm stops by itself, as speedj with t = 0.1 does


class VirtualClock:
    """A clock that jumps to where it is asked to wait."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Return the virtual time, seconds."""
        return self._now

    def wait_until(self, t: float) -> None:
        """Advance to ``t``."""
        if t > self._now:
            self._now = t


@dataclass(frozen=True)
class Disturbance:
    """Something that goes wrong in the simulated arm at ``at`` seconds, until ``until``."""

    kind: str  # protective_stop, emergency_stop, silence (no new packets), slider (half speed), program (stopped)
    at: float
    until: float = float("inf")


class SimArm:
    """A backend whose joints follow the command one cycle late and with a first-order lag (design: robot.md)."""

    def __init__(
        self,
        clock: Clock,
        q: Sequence[float],
        *,
        lag: float = 0.015,
        delay: int = 1,
        disturbances: Sequence[Disturbance] = (),
    ) -> None:
        """Place the arm at rest.

        Args:
            clock: The time that decides how far the arm has moved.
            q: Joint angles at the start, six, radians.
            lag: Time constant of the joints, seconds.
            delay: Whole cycles before a command acts.
            disturbances: What goes wrong, and when.
        """
        self._clock = clock
        self._at = clock.now()
        self._q = [float(v) for v in q]
        self._qd = [0.0] * 6
        self._waiting = [[0.0] * 6 for _ in range(delay)]
        self._asked = [0.0] * 6
        self._commanded_at = self._at
        self._brake: float | None = None
        self._disturbances = tuple(disturbances)
        self._packet: Packet | None = None
        keep = exp(-PERIOD / lag)
        self._keep, self._reach = keep, lag * (1.0 - keep)

    def align(self) -> None:
        """Let a cycle of the arm begin now, which rests: a loop that begins at once then reads each packet in time."""
        self._at = self._commanded_at = self._clock.now()

    def state(self) -> Packet:
        """Return the arm's packet at the clock's time."""
        now = self._clock.now()
        # Half a cycle of tolerance: sums of 8 ms round.
        while self._at + 0.5 * PERIOD < now:
            self._cycle()
        packet = Packet(self._at, self._q, self._qd)
        if self._disturbances:
            packet = self._packet = self._spoil(packet)
        return packet

    def speed(self, qd: list[float]) -> None:
        """Take joint velocities, six, rad/s."""
        self._asked = qd
        self._commanded_at = self._at
        self._brake = None

    def stop(self, deceleration: float) -> None:
        """Ramp to rest at ``deceleration``, rad/s²; the next velocity command ends the ramp."""
        self._brake = deceleration

    def close(self) -> None:
        """Do nothing: the simulated arm belongs to this process."""

    def _cycle(self) -> None:
        if self._brake is not None or self._at - self._commanded_at > _SILENCE:
            self._asked = _ramp(self._asked, (self._brake or 4.0) * PERIOD)
        self._waiting.append(self._asked)
        command = self._waiting.pop(0)
        keep, reach = self._keep, self._reach
        # Exact for a command that is constant over the cycle: qd → u + (qd − u) e^(−T/τ).
        q0, q1, q2, q3, q4, q5 = self._q
        v0, v1, v2, v3, v4, v5 = self._qd
        u0, u1, u2, u3, u4, u5 = command
        v0, v1, v2, v3, v4, v5 = v0 - u0, v1 - u1, v2 - u2, v3 - u3, v4 - u4, v5 - u5
        self._q = [
            q0 + PERIOD * u0 + reach * v0, q1 + PERIOD * u1 + reach * v1, q2 + PERIOD * u2 + reach * v2,
            q3 + PERIOD * u3 + reach * v3, q4 + PERIOD * u4 + reach * v4, q5 + PERIOD * u5 + reach * v5,
        ]  # fmt: skip
        self._qd = [u0 + keep * v0, u1 + keep * v1, u2 + keep * v2, u3 + keep * v3, u4 + keep * v4, u5 + keep * v5]
        self._at += PERIOD

    def _spoil(self, packet: Packet) -> Packet:
        for one in self._disturbances:
            if not one.at <= packet.stamp < one.until:
                continue
            if one.kind == "silence" and self._packet is not None:
                packet = self._packet
            elif one.kind in ("protective_stop", "emergency_stop"):
                packet.safety = PROTECTIVE if one.kind == "protective_stop" else EMERGENCY
                packet.runtime = STOPPED
                self._brake = self._brake or 10.0
            elif one.kind == "slider":
                packet.scaling = 0.5
            elif one.kind == "program":
                packet.runtime = STOPPED
                self._brake = self._brake or 4.0
        return packet


def _ramp(qd: list[float], step: float) -> list[float]:
    most = max(abs(v) for v in qd)
    return [0.0] * 6 if most <= step else [v * (1.0 - step / most) for v in qd]
