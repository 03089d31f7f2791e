"""The tracking law: resolved rates with feed-forward and damping, written in plain floats for the 125 Hz loop.

qd = Jᵀ (J Jᵀ + λ² I)⁻¹ (v_ref(t + lead) + Kp e). Paper § 2.3.2; Wampler, IEEE Trans. Syst. Man Cybern. 1986,
doi:10.1109/TSMC.1986.289285. All vectors are turned by −q₁ about the base's axis: the law does not notice, the arm
becomes planar but for its wrist, and most of J Jᵀ's terms vanish. ``kinematics`` is the plain form that tests hold
against it. Importing this loads no NumPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

from hrcneuro.contract import option
from hrcneuro.robot.dh import A, D

Vector = Sequence[float]

_D1, _D4, _D5, _D6 = D[0], D[3], D[4], D[5]
_A2, _A3 = A[1], A[2]


def tip(q: Vector, tool: float) -> tuple[float, float, float]:
    """Return the tool tip in ``base`` (x, y, z), metres, at joint angles ``q`` with a tool of length ``tool``."""
    q1, q2, q3, q4, q5, _ = q
    c1, s1, q23 = cos(q1), sin(q1), q2 + q3
    c234, s234, s5, end = cos(q23 + q4), sin(q23 + q4), sin(q5), _D6 + tool
    px = _A2 * cos(q2) + _A3 * cos(q23) + _D5 * s234 - end * s5 * c234
    py = -_D4 - end * cos(q5)
    pz = _D1 + _A2 * sin(q2) + _A3 * sin(q23) - _D5 * c234 - end * s5 * s234
    return c1 * px - s1 * py, s1 * px + c1 * py, pz


@dataclass(frozen=True)
class Tracking:
    """What can be set of the law (paper § 2.3.2)."""

    gain: float = option(8.0, "feedback of the tracking law", unit="1/s", low=0.0, high=30.0)
    damping: float = option(0.01, "damping of the tracking law", low=1e-6, high=1.0)
    lead_s: float | None = option(None, "lead of the feed-forward; none: measured", unit="s", low=0.0, high=0.2)


class ResolvedRate:
    """The law for one tool and one constant orientation of it."""

    def __init__(self, tracking: Tracking, *, tool: float, orientation: Sequence[Vector]) -> None:
        """Fix what does not change from cycle to cycle.

        Args:
            tracking: Its gain Kp and its damping λ, in the units of J (metres).
            tool: Length of the tool, metres.
            orientation: The rotation matrix that the tool keeps in ``base``, rows, shape (3, 3).
        """
        self.tool = float(tool)
        self.gain = float(tracking.gain)
        self._end = _D6 + float(tool)
        self._lambda2 = float(tracking.damping) ** 2
        self._axes = [[float(row[i]) for row in orientation] for i in range(3)]

    def __call__(self, q: Vector, at: Vector, v: Vector) -> tuple[list[float], float, float, float]:
        """Return the joint velocities, six, rad/s, and the position error ``at`` − tip (x, y, z), metres.

        Args:
            q: Joint angles, six.
            at: Where the tip should be now, (x, y, z) in ``base``.
            v: The velocity to feed forward, (x, y, z), m/s.
        """
        q1, q2, q3, q4, q5, q6 = q
        c1, s1, q23, q234, end = cos(q1), sin(q1), q2 + q3, q2 + q3 + q4, self._end
        c, s, c5, s5, c6, s6 = cos(q234), sin(q234), cos(q5), sin(q5), cos(q6), sin(q6)

        # Position, with x along the arm: p2, p3 are joints 3 and 4; the last axis is (ux, uy, uz).
        x2, z2 = _A2 * cos(q2), _A2 * sin(q2)
        x3, z3 = x2 + _A3 * cos(q23), z2 + _A3 * sin(q23)
        ux, uy, uz = -s5 * c, -c5, -s5 * s
        px, py, pz = x3 + _D5 * s + end * ux, -_D4 + end * uy, z3 - _D5 * c + end * uz

        atx, aty, atz = at
        ex, ey, ez = c1 * atx + s1 * aty - px, c1 * aty - s1 * atx - py, atz - _D1 - pz
        wx, wy, wz = self._turn(c1, s1, c, s, ux, uy, uz, c5, s5, c6, s6)

        # Columns of J: 1 (−py, px, 0 | 0, 0, 1); 2, 3, 4 (−z, 0, x | 0, −1, 0); 5 (b | s, 0, −c); 6 (0 | u).
        bx, by, bz = end * c * uy, -end * (c * ux + s * uz), end * s * uy
        py, z2, x2, z3, x3 = -py, pz - z2, px - x2, pz - z3, px - x3
        damping, gain, (vx, vy, vz) = self._lambda2, self.gain, v
        # J Jᵀ + λ²I, upper triangle; then Jᵀ times the solution.
        y0, y1, y2, y3, y4, y5 = ldl6(
            (
                py * py + pz * pz + z2 * z2 + z3 * z3 + bx * bx + damping,
                py * px + bx * by,
                bx * bz - pz * px - z2 * x2 - z3 * x3,
                bx * s,
                pz + z2 + z3,
                py - bx * c,
                px * px + by * by + damping,
                by * bz,
                by * s,
                0.0,
                px - by * c,
                px * px + x2 * x2 + x3 * x3 + bz * bz + damping,
                bz * s,
                -(px + x2 + x3),
                -bz * c,
                s * s + ux * ux + damping,
                ux * uy,
                ux * uz - s * c,
                3.0 + uy * uy + damping,
                uy * uz,
                1.0 + c * c + uz * uz + damping,
            ),
            (
                c1 * vx + s1 * vy + gain * ex,
                c1 * vy - s1 * vx + gain * ey,
                vz + gain * ez,
                gain * wx,
                gain * wy,
                gain * wz,
            ),
        )
        qd = [
            py * y0 + px * y1 + y5,
            px * y2 - pz * y0 - y4,
            x2 * y2 - z2 * y0 - y4,
            x3 * y2 - z3 * y0 - y4,
            bx * y0 + by * y1 + bz * y2 + s * y3 - c * y5,
            ux * y3 + uy * y4 + uz * y5,
        ]
        return qd, c1 * ex - s1 * ey, s1 * ex + c1 * ey, ez

    def _turn(
        self, c1: float, s1: float, c: float, s: float, ux: float, uy: float, uz: float, c5: float, s5: float,
        c6: float, s6: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        # Half the sum of the axes' cross products is the rotation vector for the small angles that occur here. x5 is
        # (c5 c, −s5, c5 s) and y5 (−s, 0, c); turned by q6 they are the tool's x and y, and its z is (ux, uy, uz).
        a, b = c5 * c, c5 * s
        xx, xy, xz = c6 * a - s6 * s, c6 * -s5, c6 * b + s6 * c
        yx, yy, yz = c6 * -s - s6 * a, -s6 * -s5, c6 * c - s6 * b
        (ax, ay, az), (bx, by, bz), (dx, dy, dz) = self._axes
        ax, ay = c1 * ax + s1 * ay, c1 * ay - s1 * ax
        bx, by = c1 * bx + s1 * by, c1 * by - s1 * bx
        dx, dy = c1 * dx + s1 * dy, c1 * dy - s1 * dx
        return (
            0.5 * (xy * az - xz * ay + (yy * bz - yz * by) + (uy * dz - uz * dy)),
            0.5 * (xz * ax - xx * az + (yz * bx - yx * bz) + (uz * dx - ux * dz)),
            0.5 * (xx * ay - xy * ax + (yx * by - yy * bx) + (ux * dy - uy * dx)),
        )


def ldl6(upper: Vector, b: Vector) -> tuple[float, ...]:
    """Return x with M x = b for a symmetric positive definite 6 × 6 M, by LDLᵀ written out.

    Args:
        upper: M's upper triangle, row by row, 21 numbers.
        b: Six numbers.
    """
    # In CPython this takes 2 µs, a loop of the same 10 µs and numpy.linalg.solve 12 µs; it also rounds the same
    # everywhere, which a BLAS does not.
    (m00, m01, m02, m03, m04, m05, m11, m12, m13, m14, m15, m22, m23, m24, m25, m33, m34, m35, m44, m45, m55) = upper
    t0, t1, t2, t3, t4, t5 = b
    f1, f2, f3, f4, f5 = m01 / m00, m02 / m00, m03 / m00, m04 / m00, m05 / m00
    m11, m12, m13, m14, m15 = m11 - f1 * m01, m12 - f1 * m02, m13 - f1 * m03, m14 - f1 * m04, m15 - f1 * m05
    m22, m23, m24, m25 = m22 - f2 * m02, m23 - f2 * m03, m24 - f2 * m04, m25 - f2 * m05
    m33, m34, m35, m44, m45 = m33 - f3 * m03, m34 - f3 * m04, m35 - f3 * m05, m44 - f4 * m04, m45 - f4 * m05
    m55 -= f5 * m05
    t1, t2, t3, t4, t5 = t1 - f1 * t0, t2 - f2 * t0, t3 - f3 * t0, t4 - f4 * t0, t5 - f5 * t0

    f2, f3, f4, f5 = m12 / m11, m13 / m11, m14 / m11, m15 / m11
    m22, m23, m24, m25 = m22 - f2 * m12, m23 - f2 * m13, m24 - f2 * m14, m25 - f2 * m15
    m33, m34, m35, m44, m45 = m33 - f3 * m13, m34 - f3 * m14, m35 - f3 * m15, m44 - f4 * m14, m45 - f4 * m15
    m55 -= f5 * m15
    t2, t3, t4, t5 = t2 - f2 * t1, t3 - f3 * t1, t4 - f4 * t1, t5 - f5 * t1

    f3, f4, f5 = m23 / m22, m24 / m22, m25 / m22
    m33, m34, m35, m44, m45 = m33 - f3 * m23, m34 - f3 * m24, m35 - f3 * m25, m44 - f4 * m24, m45 - f4 * m25
    m55 -= f5 * m25
    t3, t4, t5 = t3 - f3 * t2, t4 - f4 * t2, t5 - f5 * t2

    f4, f5 = m34 / m33, m35 / m33
    m44, m45, m55 = m44 - f4 * m34, m45 - f4 * m35, m55 - f5 * m35
    t4, t5 = t4 - f4 * t3, t5 - f5 * t3

    f5 = m45 / m44
    x5 = (t5 - f5 * t4) / (m55 - f5 * m45)
    x4 = (t4 - m45 * x5) / m44
    x3 = (t3 - m34 * x4 - m35 * x5) / m33
    x2 = (t2 - m23 * x3 - m24 * x4 - m25 * x5) / m22
    x1 = (t1 - m12 * x2 - m13 * x3 - m14 * x4 - m15 * x5) / m11
    x0 = (t0 - m01 * x1 - m02 * x2 - m03 * x3 - m04 * x4 - m05 * x5) / m00
    return x0, x1, x2, x3, x4, x5
