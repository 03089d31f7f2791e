"""The last thing a command passes: joint speed, acceleration and range, and the keep-inside box."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from math import ceil, isfinite, pi, radians, sqrt

from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.parameters import Bounds, Safety
from hrcneuro.robot.tracking import tip

Vector = Sequence[float]

# UR10: user manual 3.13, joint ranges and speeds.
MAX_SPEED = (radians(120), radians(120), radians(180), radians(180), radians(180), radians(180))
MAX_ANGLE = 2 * pi

# Bits of the ``limits`` column of the telemetry.
SPEED, ACCELERATION, RANGE, BOX, INVALID = 1, 2, 4, 8, 16
FATAL = BOX | INVALID

# The tip's way into a stop is looked at whenever the joints have turned by this together, radians: between two looks
# it bends by R·0.05²/8, 0.4 mm at the arm's full reach.
_ARC = 0.05


class Limits:
    """Scales commands uniformly, so that the tip keeps its direction, and refuses what leaves the box."""

    def __init__(
        self,
        safety: Safety,
        *,
        box: tuple[Vector, Vector],
        tool: float,
        speed: Vector = MAX_SPEED,
        angle: float = MAX_ANGLE,
        reaction: float = 0.04,
        stop: Bounds | None = None,
    ) -> None:
        """Fix the limits.

        Args:
            safety: Its greatest acceleration, of every joint.
            box: Lowest and highest corner (x, y, z) allowed to the tip, metres in ``base``.
            tool: Length of the tool, metres.
            speed: Of each joint, six, rad/s.
            angle: Joints stay within ± this, radians.
            reaction: Time that passes before a stop takes effect, seconds: delay and lag of the arm.
            stop: Of the stop that would follow, rad and s; the loop puts its own here. By default at the greatest
                acceleration at once.
        """
        self.acceleration = safety.max_acceleration
        self.step = self.acceleration * PERIOD
        self.speed = tuple(speed)
        self.angle = angle
        self.tool = tool
        self.reaction = reaction
        (self._x0, self._y0, self._z0), (self._x1, self._y1, self._z1) = box
        self._stop_for(stop or Bounds(max(speed), self.acceleration, float("inf")))

    def stopping(self, stop: Bounds) -> Limits:
        """Return these limits for a loop whose controlled stops have the bounds ``stop`` (rad and s)."""
        limits = copy(self)
        limits._stop_for(stop)
        return limits

    def __call__(self, q: Vector, qd: list[float], last: Vector) -> tuple[list[float], int]:
        """Return the command that may leave, six, rad/s, and the limits it met as bits.

        Args:
            q: Measured joint angles, six.
            qd: The command asked for.
            last: The command sent a cycle ago.
        """
        if not isfinite(sum(qd)):
            return self._towards([0.0] * 6, last)[0], INVALID
        met = 0
        if not self._is_free(q, qd):
            qd, met = self._scaled(q, qd)
        qd, slowed = self._towards(qd, last)
        if not self._stays_inside(q, qd):
            return self._towards([0.0] * 6, last)[0], met | slowed | BOX
        return qd, met | slowed

    def _is_free(self, q: Vector, qd: Vector) -> bool:
        # Whether no joint is too quick or near an end of its range: nearly always so, and known sooner than by what
        # share a command would be scaled.
        q0, q1, q2, q3, q4, q5 = q
        v0, v1, v2, v3, v4, v5 = qd
        m0, m1, m2, m3, m4, m5 = self.speed
        free = self._free
        return (
            -m0 <= v0 <= m0 and -m1 <= v1 <= m1 and -m2 <= v2 <= m2
            and -m3 <= v3 <= m3 and -m4 <= v4 <= m4 and -m5 <= v5 <= m5
            and -free <= q0 <= free and -free <= q1 <= free and -free <= q2 <= free
            and -free <= q3 <= free and -free <= q4 <= free and -free <= q5 <= free
        )  # fmt: skip

    def _scaled(self, q: Vector, qd: list[float]) -> tuple[list[float], int]:
        # The command within the joints' speeds and ranges, and which of the two it met.
        met, share = 0, 1.0
        for asked, most in zip(qd, self.speed, strict=True):
            if asked * share > most or -asked * share > most:
                share = most / abs(asked)
                met = SPEED
        for angle, asked in zip(q, qd, strict=True):
            size = abs(asked)
            # Only the end of the range that the joint moves to matters; what is left must suffice to brake.
            left = self.angle - (angle if asked > 0.0 else -angle)
            if left < self._near and size * share > (most := self._brakeable(left)):
                share = most / size
                met |= RANGE
        return ([share * v for v in qd] if met else qd), met

    def _stop_for(self, stop: Bounds) -> None:
        self._a, self._j = stop.acceleration, stop.jerk
        # Near a range's end the command itself brakes, but a stop may come while it does: four fifths of the milder. At
        # twice the reaction it creeps up without overshoot: speed over angle left is then less than 1/(e·reaction).
        self._mild = 0.8 * min(self.acceleration, stop.acceleration)
        self._lost = self._mild * (2.0 * self.reaction + 0.5 * stop.acceleration / stop.jerk)
        most = max(self.speed)
        self._near = most * (self._lost + 0.5 * most) / self._mild
        # Within ± this, a joint is not near an end of its range, however that is rounded.
        self._free = self.angle - self._near - 1e-9

    def _stays_inside(self, q: Vector, qd: Vector) -> bool:
        # The tip's way through reaction and braking, if this command were followed by a stop. A stop from v takes
        # v/a + a/j, or 2·√(v/j) where it never comes to brake at a, and half of that at v is its distance.
        q0, q1, q2, q3, q4, q5 = q
        v0, v1, v2, v3, v4, v5 = qd
        sizes = abs(v0), abs(v1), abs(v2), abs(v3), abs(v4), abs(v5)
        fastest, a, j, tool = max(sizes), self._a, self._j, self.tool
        braking = fastest / a + a / j if fastest * j >= a * a else 2.0 * sqrt(fastest / j)
        ahead = self.reaction + 0.5 * braking
        looks = ceil(ahead * sum(sizes) / _ARC) or 1
        for look in range(looks, 0, -1):
            t = ahead * look / looks
            x, y, z = tip((q0 + t * v0, q1 + t * v1, q2 + t * v2, q3 + t * v3, q4 + t * v4, q5 + t * v5), tool)
            if not (self._x0 <= x <= self._x1 and self._y0 <= y <= self._y1 and self._z0 <= z <= self._z1):
                return False
        return True

    def _brakeable(self, left: float) -> float:
        # The speed v from which a joint stops within ``left``: v·(2·reaction + a/2j) + v²/2a.
        return max(sqrt(max(self._lost * self._lost + 2.0 * self._mild * left, 0.0)) - self._lost, 0.0)

    def _towards(self, qd: list[float], last: Vector) -> tuple[list[float], int]:
        # The whole change is scaled, not its largest part, so that the joints stay in step.
        v0, v1, v2, v3, v4, v5 = qd
        u0, u1, u2, u3, u4, u5 = last
        most = max(abs(v0 - u0), abs(v1 - u1), abs(v2 - u2), abs(v3 - u3), abs(v4 - u4), abs(v5 - u5))
        if most <= self.step:
            return qd, 0
        share = self.step / most
        return [old + share * (new - old) for new, old in zip(qd, last, strict=True)], ACCELERATION
