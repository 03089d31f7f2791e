"""The joints: what is commanded (target) and what they do (actual), one cycle late and with a first-order lag."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import exp, radians

from hrcneuro.ur10 import geometry

CYCLE = 0.008  # s: the CB3 controls at 125 Hz
# UR10: user manual 3.13, joint speeds and ranges.
MAX_SPEED = (radians(120), radians(120), radians(180), radians(180), radians(180), radians(180))
MAX_ANGLE = geometry.MAX_ANGLE
START = tuple(radians(v) for v in (-9.4, -39.6, 84.7, -135.1, -90.0, -99.4))
ZERO = (0.0,) * 6
GRAVITY = 9.81  # m/s²
_HISTORY = 375  # cycles that are remembered: 3 s
_MOST_DEVIATION = 0.2  # rad between joint and target, taken as what stops a real arm
_STEADY = 63  # cycles without a target velocity: 0.5 s

Vector = Sequence[float]


class Arm:
    """Targets, and the joints that follow them."""

    def __init__(self, q: Vector = START, *, lag: float = 0.015) -> None:
        """Place the arm at rest at joint angles ``q``; ``lag`` is the joints' time constant, seconds."""
        self.target_q = [float(v) for v in q]
        self.target_qd: list[float] = list(ZERO)
        self.target_qdd: list[float] = list(ZERO)
        self.q = list(self.target_q)
        self.qd: list[float] = list(ZERO)
        self.tcp: list[float] = list(ZERO)
        self.history: deque[list[float]] = deque([self.q], maxlen=_HISTORY)  # joint angles, the newest last
        self._still = _STEADY  # cycles
        self._late_q, self._late_qd = list(self.target_q), list(ZERO)
        self._lag, self._keep = lag, exp(-CYCLE / lag) if lag > 0.0 else 0.0

    def cycle(self, qd: Vector) -> None:
        """Hold the target velocity ``qd`` for a cycle; the joints follow the target of the cycle before."""
        late, keep, lag = self._late_qd, self._keep, self._lag
        self._late_q = [a + CYCLE * u for a, u in zip(self._late_q, late, strict=True)]
        self.qd = [u + keep * (v - u) for v, u in zip(self.qd, late, strict=True)]
        # A first-order lag trails its input by lag × velocity, always: positions never drift from their targets.
        self.q = [a - lag * v for a, v in zip(self._late_q, self.qd, strict=True)]
        self.history.append(self.q)
        self._still = 0 if any(qd) else self._still + 1
        self._late_qd = list(qd)
        self.target_qdd = [(new - old) / CYCLE for new, old in zip(qd, self.target_qd, strict=True)]
        self.target_qd = list(qd)
        self.target_q = [a + CYCLE * v for a, v in zip(self.target_q, qd, strict=True)]

    @property
    def at_rest(self) -> bool:
        """Whether neither target nor joints move."""
        return not any(self.target_qd) and all(abs(v) < 1e-4 for v in self.qd)

    @property
    def steady(self) -> bool:
        """Whether the arm has stood still for half a second: is_steady of the script manual."""
        return self._still >= _STEADY and self.at_rest

    @property
    def deviation(self) -> float:
        """How far the joints are from their targets, as a share of what would stop a real arm."""
        return max(abs(a - b) for a, b in zip(self.q, self.target_q, strict=True)) / _MOST_DEVIATION

    def pose(self) -> list[float]:
        """Return the pose of the tool centre point as the joints stand."""
        return geometry.pose(self.q, self.tcp)

    def accelerometer(self) -> list[float]:
        """Return what the tool's accelerometer reads, m/s²: an axis that points upwards reads gravity."""
        turn = geometry.rotation(self.pose()[3:])
        return [GRAVITY * v for v in turn[6:]]

    def target_pose(self) -> list[float]:
        """Return the pose of the tool centre point as the targets stand."""
        return geometry.pose(self.target_q, self.tcp)
