"""Motions: each answers, cycle by cycle, which joint velocities the targets take next.

``step`` is asked once a cycle with the arm's targets and the speed scaling; ``done`` says that nothing is left to do.
Accelerations are linear in joint or tool space, as URScript's manual gives them for each command.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import acos, atan2, cos, hypot, inf, sin, sqrt
from typing import Protocol

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, MAX_SPEED, ZERO, Arm

Vector = Sequence[float]
_TRIALS = 8  # how often a cycle's way is shortened for a joint that cannot follow
_FASTEST = 5.0  # m/s (rad/s) of the tool, however short the time that is asked for
_SLOWEST = 0.05  # of its speed: a path that demands more than that of the joints cannot be followed
_GENTLE = 4.0  # rad/s², of a motion that is abandoned: its thread was killed or its program ended


class MotionFault(Exception):
    """The motion cannot go on: the controller answers with a protective stop."""


class Motion(Protocol):
    """What moves the targets."""

    done: bool

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the joint velocities of the next cycle, six, rad/s."""


def ramped(old: Vector, new: Vector, step: float) -> list[float]:
    """Return ``old`` moved towards ``new``, the largest change being ``step``; all joints in proportion."""
    most = max(abs(b - a) for a, b in zip(old, new, strict=True))
    if most <= step:
        return list(new)
    return [a + step / most * (b - a) for a, b in zip(old, new, strict=True)]


class Trapezoid:
    """The way covered with a speed that rises, stays and falls: of length ``way``, at rest on both ends."""

    def __init__(self, way: float, a: float, v: float, t: float = 0.0, *, most: float = inf) -> None:
        """Fix the profile; a duration ``t`` > 0 overrides ``a`` and ``v``; ``most`` bounds any speed."""
        if t > 0.0:
            # A sixth each to speed up and slow down.
            v = way / (t * 5.0 / 6.0)
            a = v / (t / 6.0) if v > 0.0 else 1.0
        v = min(v, most)
        self._way, self._a = way, max(a, 1e-9)
        self._v = min(max(v, 1e-9), sqrt(way * self._a)) if way > 0.0 else 0.0
        self._ramp = self._v / self._a
        self.duration = way / self._v + self._ramp if way > 0.0 else 0.0

    def at(self, t: float) -> float:
        """Return the fraction of the way, 0 … 1, covered at ``t`` seconds."""
        if t >= self.duration:
            return 1.0
        if t < self._ramp:
            covered = 0.5 * self._a * t * t
        elif t <= self.duration - self._ramp:
            covered = self._v * (t - 0.5 * self._ramp)
        else:
            covered = self._way - 0.5 * self._a * (self.duration - t) ** 2
        return covered / self._way


class _Timed(ABC):
    """A motion along a path parameter; the speed slider slows its time."""

    def __init__(self, profile: Trapezoid) -> None:
        self._profile, self._t, self.done = profile, 0.0, False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the joint velocities that reach the path's next point."""
        cycle = ahead = CYCLE * scaling
        left = self._profile.duration - self._t
        for _ in range(_TRIALS):
            q = self._goal(arm, self._profile.at(self._t + ahead))
            qd = [(b - a) / CYCLE for a, b in zip(arm.target_q, q, strict=True)]
            excess = max(abs(speed) / most for speed, most in zip(qd, MAX_SPEED, strict=True))
            if excess <= 1.0:
                break
            # The robot slows down along the way where a joint cannot follow: UR's client library tests that.
            ahead = min(ahead, left) * 0.99 / excess  # beyond the end there is no more way
            if ahead < _SLOWEST * cycle < left:
                raise MotionFault("the path comes too close to a singularity")
        self._t += ahead
        if self._t >= self._profile.duration + CYCLE:
            self.done = True
        return qd

    @abstractmethod
    def _goal(self, arm: Arm, s: float) -> Vector:
        """Return the joint angles at the fraction ``s`` of the path."""


class MoveJ(_Timed):
    """movej: straight in joint space; acceleration and speed are the leading axis's."""

    def __init__(self, arm: Arm, goal: Vector, a: float, v: float, t: float = 0.0) -> None:
        """Plan from the arm's targets to ``goal``, rad, rad/s² and rad/s."""
        self._start = list(arm.target_q)
        self._way = [b - a for a, b in zip(self._start, goal, strict=True)]
        longest = max(map(abs, self._way))
        # A joint that is slower than asked for slows them all.
        ways = zip(self._way, MAX_SPEED, strict=True)
        most = min((speed * longest / abs(way) for way, speed in ways if abs(way) > 0.0), default=inf)
        super().__init__(Trapezoid(longest, a, v, t, most=most))

    def _goal(self, arm: Arm, s: float) -> Vector:
        return [a + s * way for a, way in zip(self._start, self._way, strict=True)]


class MoveL(_Timed):
    """movel and movep: straight in tool space."""

    def __init__(self, arm: Arm, goal: Vector, a: float, v: float, t: float = 0.0) -> None:
        """Plan from the arm's target pose to ``goal``, m/s² and m/s (rad where the tool only turns)."""
        self._start = arm.target_pose()
        self._way = geometry.between(self._start, goal)
        length, angle = (sqrt(sum(x * x for x in part)) for part in self._way)
        super().__init__(Trapezoid(length if length > 1e-6 else angle, a, v, t, most=_FASTEST))

    def _goal(self, arm: Arm, s: float) -> Vector:
        return _reached(geometry.along(self._start, self._way, s), arm)


class MoveC(_Timed):
    """movec: along the circle through the present position, ``via`` and ``goal``."""

    def __init__(self, arm: Arm, via: Vector, goal: Vector, a: float, v: float, *, fixed: bool = False) -> None:
        """Plan the arc, m/s² and m/s; the orientation is turned along the arc, or kept where ``fixed``."""
        self._start = arm.target_pose()
        turn = geometry.between(self._start, goal)[1]
        self._turn = (0.0, 0.0, 0.0) if fixed else turn
        self._centre, self._x, self._y, self._angle = _arc(self._start[:3], via[:3], goal[:3])
        super().__init__(Trapezoid(hypot(*self._x) * self._angle, a, v))

    def _goal(self, arm: Arm, s: float) -> Vector:
        c, k = cos(s * self._angle), sin(s * self._angle)
        at = [m + c * x + k * y for m, x, y in zip(self._centre, self._x, self._y, strict=True)]
        turned = geometry.along(self._start, ((0.0, 0.0, 0.0), self._turn), s)
        return _reached(at + turned[3:], arm)


def _reached(pose: Vector, arm: Arm) -> list[float]:
    q = geometry.inverse(pose, arm.tcp, arm.target_q)
    if q is None:
        raise MotionFault("the path leaves the arm's reach")
    return q


def _arc(a: Vector, b: Vector, c: Vector) -> tuple[list[float], list[float], list[float], float]:
    """Return centre, first radius, the radius a quarter on, and angle of the arc from a through b to c."""
    u, w = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
    uu, ww, uw = _dot(u, u), _dot(w, w), _dot(u, w)
    area = uu * ww - uw * uw
    if area < 1e-12 * max(uu * ww, 1e-12):
        raise MotionFault("movec's three positions lie on a line")
    k, m = ww * (uu - uw) / (2.0 * area), uu * (ww - uw) / (2.0 * area)
    centre = [x + k * i + m * j for x, i, j in zip(a, u, w, strict=True)]
    radius = [x - o for x, o in zip(a, centre, strict=True)]
    r2 = _dot(radius, radius)
    # A quarter of a turn on, in the direction of b.
    toward = [i - _dot(u, radius) / r2 * x for i, x in zip(u, radius, strict=True)]
    size = sqrt(_dot(toward, toward))
    quarter = [x * sqrt(r2) / size for x in toward]
    end = [x - o for x, o in zip(c, centre, strict=True)]
    angle = atan2(_dot(end, quarter), _dot(end, radius))
    via = [x - o for x, o in zip(b, centre, strict=True)]
    passed = atan2(_dot(via, quarter), _dot(via, radius))
    if angle <= 0.0 or passed > angle:
        angle += 2.0 * acos(-1.0)
    return centre, radius, quarter, angle


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


class SpeedJ:
    """speedj: joint velocities, reached with acceleration ``a``, kept until another command."""

    def __init__(self, qd: Vector, a: float) -> None:
        """Fix velocities, rad/s, and acceleration, rad/s²."""
        self._qd, self._a, self.done = [float(v) for v in qd], a, False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the next velocities on the ramp."""
        goal = [scaling * v for v in self._qd]
        qd = ramped(arm.target_qd, goal, self._a * CYCLE)
        self.done = qd == goal
        return qd


class SpeedL:
    """speedl: a velocity of the tool, reached with acceleration ``a``, kept until another command."""

    def __init__(self, xd: Vector, a: float, turn: float) -> None:
        """Fix the twist, m/s and rad/s, and its accelerations, m/s² and rad/s²."""
        self._xd, self._a, self._turn, self.done = [float(v) for v in xd], a, turn, False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the joint velocities of the next twist on the ramp."""
        tip = arm.target_pose()[:3]
        now = geometry.twist(arm.target_q, arm.target_qd, tip)
        goal = [scaling * v for v in self._xd]
        xd = ramped(now[:3], goal[:3], self._a * CYCLE) + ramped(now[3:], goal[3:], self._turn * CYCLE)
        self.done = xd == goal
        return geometry.joint_rates(arm.target_q, tip, xd)


class ServoJ:
    """servoj: towards joint angles within the look-ahead time, stiffer with a higher gain."""

    _ACCELERATION = 40.0  # rad/s²

    def __init__(self, q: Vector, lookahead: float, gain: float) -> None:
        """Fix the goal, rad; ``lookahead`` 0.03 … 0.2 s and ``gain`` 100 … 2000 as the manual bounds them."""
        self._q, self._rate, self.done = list(q), min(gain / 300.0 / lookahead, 0.9 / CYCLE), False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the next velocities towards the goal."""
        error = [b - a for a, b in zip(arm.target_q, self._q, strict=True)]
        self.done = max(map(abs, error)) < 1e-6
        return ramped(arm.target_qd, [self._rate * e for e in error], self._ACCELERATION * CYCLE)


class StopJ:
    """stopj, and what becomes of an abandoned motion: joint velocities fall to zero."""

    def __init__(self, a: float = _GENTLE) -> None:
        """Fix the deceleration, rad/s²."""
        self._a, self.done = a, False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the next velocities on the ramp."""
        self.done = not any(arm.target_qd)
        return ramped(arm.target_qd, ZERO, self._a * CYCLE)


class StopL:
    """stopl: the tool's velocity falls to zero, m/s²; the path is kept, since the joints stay in proportion."""

    def __init__(self, a: float, turn: float | None = None) -> None:
        """Fix the decelerations, m/s² and rad/s² (of a tool that only turns, ten times ``a`` where None)."""
        self._a, self._turn, self.done = a, 10.0 * a if turn is None else turn, False

    def step(self, arm: Arm, scaling: float) -> Vector:
        """Return the joint velocities scaled down by a cycle's deceleration."""
        qd = arm.target_qd
        self.done = not any(qd)
        xd = geometry.twist(arm.target_q, qd, arm.target_pose()[:3])
        share = max(hypot(*xd[:3]) / (self._a * CYCLE), hypot(*xd[3:]) / (self._turn * CYCLE))
        return ZERO if share <= 1.0 else [v * (1.0 - 1.0 / share) for v in qd]
