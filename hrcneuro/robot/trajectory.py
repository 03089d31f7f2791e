"""Paths: minimum-jerk tile moves (paper Eq 1–2), and jerk-limited approaches, homing and stops by ruckig.

A path knows its ``duration`` and answers ``at(t)`` with position and velocity; beyond its ends it rests.
Ruckig: Berscheid & Kröger, RSS 2021, doi:10.15607/RSS.2021.XVII.015.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import ruckig

from hrcneuro.robot.parameters import Bounds

Vector = Sequence[float]
MotionState = tuple[Vector, Vector, Vector]  # position, velocity, acceleration


class NoPath(ValueError):
    """No trajectory keeps within the bounds."""


class Trajectory(Protocol):
    """What the loop follows: tip positions or joint angles."""

    duration: float

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return position and velocity at ``t`` seconds after the start."""

    def state(self, t: float) -> MotionState:
        """Return position, velocity and acceleration at ``t``: what a path that takes over starts from."""


class TileMove:
    """Eq 1–2: from one tip position to another in ``duration`` seconds, at rest on both ends."""

    def __init__(self, start: Vector, end: Vector, duration: float) -> None:
        """Fix start and end, (x, y, z) in metres, and the duration t_f in seconds."""
        self.duration = float(duration)
        self._start = tuple(float(v) for v in start)
        self._way = tuple(float(b) - float(a) for a, b in zip(start, end, strict=True))

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return position (m) and velocity (m/s), each (x, y, z), at ``t`` seconds."""
        u = t / self.duration
        u = 0.0 if u < 0.0 else 1.0 if u > 1.0 else u
        s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
        rate = u * (1.0 - u)
        rate *= 30.0 * rate / self.duration
        (x, y, z), (dx, dy, dz) = self._start, self._way
        return (x + s * dx, y + s * dy, z + s * dz), (rate * dx, rate * dy, rate * dz)

    def state(self, t: float) -> MotionState:
        """Return position, velocity and acceleration at ``t`` seconds."""
        u = min(max(t / self.duration, 0.0), 1.0)
        acceleration = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / self.duration**2
        return *self.at(t), tuple(acceleration * v for v in self._way)


class MovingStart:
    """The quintic of least jerk from a tip in motion to rest: a tile move that takes over from the one before."""

    def __init__(self, motion: MotionState, end: Vector, duration: float) -> None:
        """Fix where the tip is and how it moves (m, m/s, m/s²), where it comes to rest, and the duration, seconds."""
        self.duration = t_f = float(duration)
        # Of each axis: p(t) = c0 + c1 t + … + c5 t⁵ with p, p', p'' given at 0 and at t_f.
        self._axes = []
        for x, v, a, goal in zip(*motion, end, strict=True):
            d = goal - x
            c3 = (20.0 * d - 12.0 * v * t_f - 3.0 * a * t_f**2) / (2.0 * t_f**3)
            c4 = (-30.0 * d + 16.0 * v * t_f + 3.0 * a * t_f**2) / (2.0 * t_f**4)
            c5 = (12.0 * d - 6.0 * v * t_f - a * t_f**2) / (2.0 * t_f**5)
            self._axes.append((x, v, 0.5 * a, c3, c4, c5))

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return position (m) and velocity (m/s) at ``t`` seconds."""
        position, velocity, _ = self.state(t)
        return position, velocity

    def state(self, t: float) -> MotionState:
        """Return position, velocity and acceleration at ``t`` seconds."""
        t = min(max(t, 0.0), self.duration)
        p, v, a = [], [], []
        for c0, c1, c2, c3, c4, c5 in self._axes:
            p.append(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))
            v.append(c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))))
            a.append(2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)))
        return p, v, a


class BoundedPath:
    """Time-optimal within bounds, from any motion to rest: approach and retargeting (metres), homing (radians)."""

    def __init__(
        self, start: Vector, end: Vector, bounds: Bounds, *, velocity: Vector = (), acceleration: Vector = ()
    ) -> None:
        """Plan from ``start`` (moving at ``velocity``, ``acceleration``; at rest where empty) to rest at ``end``.

        Raises:
            NoPath: Ruckig finds no trajectory.
        """
        n = len(start)
        given = ruckig.InputParameter(n)
        given.current_position = [float(v) for v in start]
        given.current_velocity = _clamped(velocity or [0.0] * n, bounds.velocity)
        given.current_acceleration = _clamped(acceleration or [0.0] * n, bounds.acceleration)
        given.target_position = [float(v) for v in end]
        given.max_velocity = [bounds.velocity] * n
        given.max_acceleration = [bounds.acceleration] * n
        given.max_jerk = [bounds.jerk] * n
        # All axes in proportion: from rest the tip runs along a straight line, so it keeps its height.
        given.synchronization = ruckig.Synchronization.Phase
        self._path = _plan(given)
        self.duration = float(self._path.duration)

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return position and velocity at ``t`` seconds."""
        position, velocity, _ = self._path.at_time(min(max(t, 0.0), self.duration))
        return position, velocity

    def state(self, t: float) -> MotionState:
        """Return position, velocity and acceleration at ``t`` seconds."""
        return self._path.at_time(min(max(t, 0.0), self.duration))


class Stop:
    """Joint velocities that bring a moving arm to rest within acceleration and jerk bounds."""

    def __init__(self, qd: Vector, bounds: Bounds, *, qdd: Vector = ()) -> None:
        """Plan from joint velocities ``qd`` (rad/s) and accelerations ``qdd`` to rest.

        Raises:
            NoPath: Ruckig finds no trajectory.
        """
        n = len(qd)
        given = ruckig.InputParameter(n)
        given.control_interface = ruckig.ControlInterface.Velocity
        given.current_position = [0.0] * n
        given.current_velocity = _clamped(qd, bounds.velocity)
        given.current_acceleration = _clamped(qdd or [0.0] * n, bounds.acceleration)
        given.target_velocity = [0.0] * n
        given.max_velocity = [bounds.velocity] * n
        given.max_acceleration = [bounds.acceleration] * n
        given.max_jerk = [bounds.jerk] * n
        given.synchronization = ruckig.Synchronization.Phase
        self._path = _plan(given)
        self.duration = float(self._path.duration)

    def at(self, t: float) -> list[float]:
        """Return the joint velocities at ``t`` seconds, rad/s; zero once the stop is over."""
        if t >= self.duration:
            return [0.0] * self._path.degrees_of_freedom
        return list(self._path.at_time(max(t, 0.0))[1])


def _clamped(values: Vector, bound: float) -> list[float]:
    # A measured state may exceed the bounds by a rounding error, and ruckig would then plan a brake first.
    return [min(max(float(v), -bound), bound) for v in values]


def _plan(given: Any) -> Any:
    path = ruckig.Trajectory(given.degrees_of_freedom)
    try:
        result = ruckig.Ruckig(given.degrees_of_freedom).calculate(given, path)
    except ruckig.RuckigError as error:
        raise NoPath(f"no jerk-limited path: {str(error).strip().splitlines()[0]}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished) or not math.isfinite(path.duration):
        raise NoPath(f"no jerk-limited path: ruckig answers {result}")
    return path
