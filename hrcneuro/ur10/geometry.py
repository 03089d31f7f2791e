"""The UR10's geometry in plain floats, for one configuration at a time: fast enough for a cycle, closed-form inverse.

Rotations are nine numbers, row by row. ``hrcneuro.robot.kinematics`` is the reference that tests hold this against.
The inverse follows the arm's structure (three parallel axes): Hawkins, "Analytic inverse kinematics for the Universal
Robots UR-5/UR-10 arms", 2013, hdl.handle.net/1853/50782.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import acos, asin, atan2, cos, hypot, pi, sin, sqrt, tau

from hrcneuro.robot.dh import A, D
from hrcneuro.robot.tracking import ldl6

Vector = Sequence[float]
Rotation = tuple[float, float, float, float, float, float, float, float, float]

_D1, _D4, _D5, _D6 = D[0], D[3], D[4], D[5]
_A2, _A3 = A[1], A[2]
MAX_ANGLE = tau


def rotation(v: Vector) -> Rotation:
    """Return the rotation of a rotation vector (axis times angle)."""
    x, y, z = v
    angle2 = x * x + y * y + z * z
    if angle2 < 1e-24:
        return (1.0, -z, y, z, 1.0, -x, -y, x, 1.0)
    angle = sqrt(angle2)
    c, s = cos(angle), sin(angle) / angle
    k = (1.0 - c) / angle2
    return (
        c + k * x * x, k * x * y - s * z, k * x * z + s * y,
        k * x * y + s * z, c + k * y * y, k * y * z - s * x,
        k * x * z - s * y, k * y * z + s * x, c + k * z * z,
    )  # fmt: skip


def rotation_vector(r: Rotation) -> tuple[float, float, float]:
    """Return the rotation vector, of length 0 … π."""
    x, y, z = r[7] - r[5], r[2] - r[6], r[3] - r[1]
    sine, cosine = 0.5 * sqrt(x * x + y * y + z * z), 0.5 * (r[0] + r[4] + r[8] - 1.0)
    angle = atan2(sine, cosine)
    if sine > 1e-7:
        k = 0.5 * angle / sine
        return k * x, k * y, k * z
    if cosine > 0.0:
        return 0.5 * x, 0.5 * y, 0.5 * z
    # Half a turn: R = 2 n nᵀ − 1. The column of the largest diagonal element is the best conditioned.
    i = max(range(3), key=lambda k: r[4 * k])
    column = [r[3 * k + i] + (k == i) for k in range(3)]
    k = angle / sqrt(sum(v * v for v in column))
    return k * column[0], k * column[1], k * column[2]


def times(a: Rotation, b: Rotation) -> Rotation:
    """Return the product of two rotations."""
    a0, a1, a2, a3, a4, a5, a6, a7, a8 = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8 = b
    return (
        a0 * b0 + a1 * b3 + a2 * b6, a0 * b1 + a1 * b4 + a2 * b7, a0 * b2 + a1 * b5 + a2 * b8,
        a3 * b0 + a4 * b3 + a5 * b6, a3 * b1 + a4 * b4 + a5 * b7, a3 * b2 + a4 * b5 + a5 * b8,
        a6 * b0 + a7 * b3 + a8 * b6, a6 * b1 + a7 * b4 + a8 * b7, a6 * b2 + a7 * b5 + a8 * b8,
    )  # fmt: skip


def turned(r: Rotation, v: Vector) -> tuple[float, float, float]:
    """Return a vector turned by a rotation."""
    x, y, z = v
    return r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z


def transposed(r: Rotation) -> Rotation:
    """Return the inverse rotation."""
    return r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]


def pose_trans(a: Vector, b: Vector) -> list[float]:
    """Return pose ``b``, given in the frame of pose ``a``, in the frame of ``a`` itself."""
    ra = rotation(a[3:])
    x, y, z = turned(ra, b[:3])
    return [a[0] + x, a[1] + y, a[2] + z, *rotation_vector(times(ra, rotation(b[3:])))]


def pose_inv(a: Vector) -> list[float]:
    """Return the inverse of a pose."""
    back = transposed(rotation(a[3:]))
    x, y, z = turned(back, a[:3])
    return [-x, -y, -z, *rotation_vector(back)]


def between(a: Vector, b: Vector) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the way from pose ``a`` to ``b``: a displacement and a rotation vector, both in ``base``."""
    turn = times(rotation(b[3:]), transposed(rotation(a[3:])))
    return tuple(v - u for u, v in zip(a[:3], b[:3], strict=True)), rotation_vector(turn)


def along(a: Vector, way: tuple[Vector, Vector], s: float) -> list[float]:
    """Return the pose a fraction ``s`` of ``way`` (see :func:`between`) from pose ``a``."""
    turn = times(rotation([s * v for v in way[1]]), rotation(a[3:]))
    return [u + s * v for u, v in zip(a[:3], way[0], strict=True)] + list(rotation_vector(turn))


def flange(q: Vector) -> tuple[tuple[float, float, float], Rotation]:
    """Return position and rotation of UR's ``tool0`` in ``base`` at six joint angles."""
    q1, q2, q3, q4, q5, q6 = q
    c1, s1, q23 = cos(q1), sin(q1), q2 + q3
    c, s, c5, s5, c6, s6 = cos(q23 + q4), sin(q23 + q4), cos(q5), sin(q5), cos(q6), sin(q6)
    # With x along the arm: i, j are wrist 2's x and y; u is the last axis.
    ix, iy, iz = c5 * c, -s5, c5 * s
    ux, uy, uz = -s5 * c, -c5, -s5 * s
    px = _A2 * cos(q2) + _A3 * cos(q23) + _D5 * s + _D6 * ux
    py = -_D4 + _D6 * uy
    pz = _D1 + _A2 * sin(q2) + _A3 * sin(q23) - _D5 * c + _D6 * uz
    xx, xy, xz = c6 * ix - s6 * s, c6 * iy, c6 * iz + s6 * c
    yx, yy, yz = -c6 * s - s6 * ix, -s6 * iy, c6 * c - s6 * iz
    return (c1 * px - s1 * py, s1 * px + c1 * py, pz), (
        c1 * xx - s1 * xy, c1 * yx - s1 * yy, c1 * ux - s1 * uy,
        s1 * xx + c1 * xy, s1 * yx + c1 * yy, s1 * ux + c1 * uy,
        xz, yz, uz,
    )  # fmt: skip


def pose(q: Vector, tcp: Vector) -> list[float]:
    """Return the pose of a tool centre point, given in the flange's frame, at six joint angles."""
    (x, y, z), r = flange(q)
    dx, dy, dz = turned(r, tcp[:3])
    if tcp[3] or tcp[4] or tcp[5]:
        r = times(r, rotation(tcp[3:]))
    return [x + dx, y + dy, z + dz, *rotation_vector(r)]


def columns(q: Vector, tip: Vector) -> list[tuple[float, ...]]:
    """Return the Jacobian's six columns (vx vy vz wx wy wz) in ``base`` for a point ``tip`` fixed to the flange."""
    q1, q2, q3, q4, q5, _ = q
    c1, s1, q23 = cos(q1), sin(q1), q2 + q3
    c, s, c5, s5 = cos(q23 + q4), sin(q23 + q4), cos(q5), sin(q5)
    x2, z2 = _A2 * cos(q2), _D1 + _A2 * sin(q2)
    x3, z3 = x2 + _A3 * cos(q23), z2 + _A3 * sin(q23)
    tx, ty, tz = tip
    px, py = c1 * tx + s1 * ty, c1 * ty - s1 * tx
    x5, z5 = x3 + _D5 * s, z3 - _D5 * c
    ux, uy, uz = -s5 * c, -c5, -s5 * s
    dx, dy, dz = px - x3, py + _D4, tz - z3
    ex, ez = px - x5, tz - z5
    arm = (
        (-py, px, 0.0, 0.0, 0.0, 1.0),
        (_D1 - tz, 0.0, px, 0.0, -1.0, 0.0),
        (z2 - tz, 0.0, px - x2, 0.0, -1.0, 0.0),
        (z3 - tz, 0.0, px - x3, 0.0, -1.0, 0.0),
        (c * dy, -c * dx - s * dz, s * dy, s, 0.0, -c),
        (uy * ez - uz * dy, uz * ex - ux * ez, ux * dy - uy * ex, ux, uy, uz),
    )
    return [(c1 * a - s1 * b, s1 * a + c1 * b, z, c1 * d - s1 * e, s1 * d + c1 * e, f) for a, b, z, d, e, f in arm]


def joint_rates(q: Vector, tip: Vector, twist: Vector, *, damping: float = 1e-3) -> list[float]:
    """Return the joint velocities that give the point ``tip`` a ``twist``, by damped least squares."""
    jac = columns(q, tip)
    upper = [
        sum(column[i] * column[k] for column in jac) + (damping * damping if i == k else 0.0)
        for i in range(6)
        for k in range(i, 6)
    ]
    y = ldl6(upper, twist)
    return [sum(a * b for a, b in zip(column, y, strict=True)) for column in jac]


def twist(q: Vector, qd: Vector, tip: Vector) -> list[float]:
    """Return the velocity (vx vy vz wx wy wz) of a point fixed to the flange."""
    jac = columns(q, tip)
    return [sum(column[i] * v for column, v in zip(jac, qd, strict=True)) for i in range(6)]


def inverse(target: Vector, tcp: Vector, near: Vector) -> list[float] | None:
    """Return the joint angles nearest to ``near`` that bring the tool centre point to a pose; None: out of reach."""
    wrist = pose_trans(target, pose_inv(tcp)) if any(tcp) else list(target)
    best, least = None, float("inf")
    for solution in _solutions(wrist[:3], rotation(wrist[3:]), near):
        # Each joint turns ±360°: of the equivalent angles, the nearest one within range counts.
        q = [_nearest(angle, other) for angle, other in zip(solution, near, strict=True)]
        distance = sum((a - b) ** 2 for a, b in zip(q, near, strict=True))
        if distance < least:
            best, least = q, distance
    return best


def _nearest(angle: float, near: float) -> float:
    angle += tau * round((near - angle) / tau)
    if angle > MAX_ANGLE:
        return angle - tau
    return angle + tau if angle < -MAX_ANGLE else angle


def _solutions(p: Vector, r: Rotation, near: Vector) -> Iterator[tuple[float, ...]]:
    x, y, z = p[0] - _D6 * r[2], p[1] - _D6 * r[5], p[2] - _D6 * r[8] - _D1
    reach = hypot(x, y)
    if reach < _D4:
        return
    shoulder = asin(_D4 / reach)
    for q1 in (atan2(y, x) + shoulder, atan2(y, x) + pi - shoulder):
        c1, s1 = cos(q1), sin(q1)
        x6y, y6y, uy = c1 * r[3] - s1 * r[0], c1 * r[4] - s1 * r[1], c1 * r[5] - s1 * r[2]
        wrist = acos(min(max(-uy, -1.0), 1.0))
        for q5 in (wrist, -wrist):
            s5 = sin(q5)
            # Straight wrist: only q4 + q6 or q4 − q6 is determined; the last joint stays.
            q6 = near[5] if abs(s5) < 1e-9 else atan2(y6y / s5, -x6y / s5)
            c6, s6 = cos(q6), sin(q6)
            jx = s6 * (c1 * r[0] + s1 * r[3]) + c6 * (c1 * r[1] + s1 * r[4])
            q234 = atan2(-jx, s6 * r[6] + c6 * r[7])
            px, pz = c1 * x + s1 * y - _D5 * sin(q234), z + _D5 * cos(q234)
            c3 = (px * px + pz * pz - _A2 * _A2 - _A3 * _A3) / (2.0 * _A2 * _A3)
            if abs(c3) > 1.0 + 1e-12:
                continue
            elbow = acos(min(max(c3, -1.0), 1.0))
            for q3 in (elbow, -elbow):
                q2 = atan2(pz, px) - atan2(_A3 * sin(q3), _A2 + _A3 * cos(q3))
                yield q1, q2, q3, q234 - q2 - q3, q5, q6
