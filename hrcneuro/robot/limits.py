"""The last thing a command passes: joint speed, acceleration and range, and the keep-inside box."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, pi, radians, sqrt

from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.tracking import tip

Vector = Sequence[float]

# UR10: user manual 3.13, joint ranges and speeds.
MAX_SPEED = (radians(120), radians(120), radians(180), radians(180), radians(180), radians(180))
MAX_ANGLE = 2 * pi

# Bits of the ``limits`` column of the telemetry.
SPEED, ACCELERATION, RANGE, BOX, INVALID = 1, 2, 4, 8, 16
FATAL = BOX | INVALID


class Limits:
    """Scales commands uniformly, so that the tip keeps its direction, and refuses what leaves the box."""

    def __init__(
        self,
        *,
        acceleration: float,
        box: tuple[Vector, Vector],
        tool: float,
        speed: Vector = MAX_SPEED,
        angle: float = MAX_ANGLE,
        reaction: float = 0.04,
    ) -> None:
        """Fix the limits.

        Args:
            acceleration: Of every joint, rad/s².
            box: Lowest and highest corner (x, y, z) allowed to the tip, metres in ``base``.
            tool: Length of the tool, metres.
            speed: Of each joint, six, rad/s.
            angle: Joints stay within ± this, radians.
            reaction: Time that passes before a stop takes effect, seconds: delay and lag of the arm.
        """
        self.acceleration = acceleration
        self.step = acceleration * PERIOD
        self.speed = tuple(speed)
        self.angle = angle
        self.tool = tool
        self.reaction = reaction
        (self._x0, self._y0, self._z0), (self._x1, self._y1, self._z1) = box

    def __call__(self, q: Vector, qd: list[float], last: Vector) -> tuple[list[float], int]:
        """Return the command that may leave, six, rad/s, and the limits it met as bits.

        Args:
            q: Measured joint angles, six.
            qd: The command asked for.
            last: The command sent a cycle ago.
        """
        met = 0
        if not isfinite(sum(qd)):
            return self._towards([0.0] * 6, last)[0], INVALID
        share = 1.0
        for asked, most in zip(qd, self.speed, strict=True):
            if asked * share > most or -asked * share > most:
                share = most / abs(asked)
                met = SPEED
        fastest = 0.0
        for angle, asked in zip(q, qd, strict=True):
            size = abs(asked)
            fastest = size if size > fastest else fastest
            # Only the end of the range that the joint moves to matters; what is left must suffice to brake.
            left = self.angle - (angle if asked > 0.0 else -angle)
            if left < 1.0 and size * share > (most := self._brakeable(left)):
                share = most / size
                met |= RANGE
        if met:
            qd = [share * v for v in qd]
        qd, held = self._towards(qd, last)
        # The tip after reaction and braking, if this command were followed by a stop.
        ahead = self.reaction + 0.5 * fastest / self.acceleration
        x, y, z = tip([a + ahead * v for a, v in zip(q, qd, strict=True)], self.tool)
        if not (self._x0 <= x <= self._x1 and self._y0 <= y <= self._y1 and self._z0 <= z <= self._z1):
            return self._towards([0.0] * 6, last)[0], met | held | BOX
        return qd, met | held

    def _brakeable(self, left: float) -> float:
        # The speed v from which a joint stops within ``left``: v·reaction + v²/2a, at four fifths of the acceleration.
        a = 0.8 * self.acceleration
        lost = a * self.reaction
        return max(sqrt(max(lost * lost + 2.0 * a * left, 0.0)) - lost, 0.0)

    def _towards(self, qd: list[float], last: Vector) -> tuple[list[float], int]:
        # The whole change is scaled, not its largest part, so that the joints stay in step.
        most = 0.0
        for new, old in zip(qd, last, strict=True):
            change = new - old if new > old else old - new
            most = change if change > most else most
        if most <= self.step:
            return qd, 0
        share = self.step / most
        return [old + share * (new - old) for new, old in zip(qd, last, strict=True)], ACCELERATION
