"""The robot's state as ports 30003 (real-time, 125 Hz), 30001 and 30002 (primary and secondary, 10 Hz) send it.

Layouts: "Client interfaces, CB-series", Universal Robots, software 3.5 and later; big-endian throughout.
"""

from __future__ import annotations

import struct
from math import hypot

from hrcneuro.robot.dh import ALPHA, A, D
from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import MAX_ANGLE, MAX_SPEED, ZERO
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.modes import EMERGENCY, PAUSED, PLAYING, POSITION, PROTECTIVE, RUNNING, TEACH
from hrcneuro.ur10.variables import elbow, joint_modes

ROBOT_STATE = 16
EVERY = 12  # cycles between state messages: 10.4 Hz

_REALTIME = struct.Struct(">i138d")
_SAFETY = struct.Struct(">d")
_SPEEDS = [v for speed in MAX_SPEED for v in (speed, 40.0)]


def realtime(c: Controller) -> bytes:
    """Return port 30003's packet: 1108 bytes with software 3.5 … 3.9, 1116 from 3.10."""
    arm, io = c.arm, c.memory.io
    at, velocity = elbow(c)
    pose, target = arm.pose(), arm.target_pose()
    speed, target_speed = (
        geometry.twist(arm.q, arm.qd, pose[:3]),
        geometry.twist(arm.target_q, arm.target_qd, target[:3]),
    )
    body = (
        c.now, *arm.target_q, *arm.target_qd, *arm.target_qdd, *ZERO, *ZERO, *arm.q, *arm.qd, *ZERO, *ZERO,
        *pose, *speed, *ZERO, *target, *target_speed, float(io.digital_in),
        *(30.0,) * 6, 0.5, 0.0, float(c.robot_mode), *joint_modes(c), float(c.safety_mode), *ZERO, *arm.accelerometer(),
        *ZERO, c.speed_scaling, 10.0 * hypot(*speed[:3]), 0.0, 0.0, 48.0, 48.0, 0.5, *(48.0,) * 6,
        float(io.digital_out),
        float(c.runtime_state), *at, *velocity,
    )  # fmt: skip
    if c.version[:2] < (3, 10):
        return _REALTIME.pack(_REALTIME.size, *body)
    return _REALTIME.pack(_REALTIME.size + 8, *body) + _SAFETY.pack(c.safety_mode)


def state(c: Controller) -> bytes:
    """Return the robot state message of ports 30001 and 30002."""
    arm, io, memory = c.arm, c.memory.io, c.memory
    power = c.robot_mode > 3
    parts = [
        _part(
            0, ">Q7?2B3d", int(c.now * 1e6), True, True, power, c.safety_mode == EMERGENCY, c.safety_mode == PROTECTIVE,
            c.runtime_state == PLAYING, c.runtime_state == PAUSED, c.robot_mode, TEACH if c.freedrive else POSITION,
            c.slider, c.speed_scaling, 1.0,
        ),
        _part(1, ">" + "3d4fB" * 6, *_joints(c)),
        _part(
            2, ">2b2dfB2fB", io.tool_analog_types & 1, io.tool_analog_types >> 1 & 1, *io.tool_analog_in, 48.0,
            io.tool_voltage, 0.0, 30.0, joint_modes(c)[0],
        ),
        _masterboard(c),
        _part(4, ">12d", *arm.pose(), *arm.tcp),
        _part(5, ">6I24dI", *(0,) * 6, *ZERO, *A, *D, *ALPHA, 0),
        _part(
            6, ">12d12d5d24d4i", *(-MAX_ANGLE, MAX_ANGLE) * 6, *_SPEEDS, 1.05, 1.4, 0.25, 1.2, 0.0, *A, *D, *ALPHA,
            *ZERO, 0, 3, 2, 0,
        ),
        _part(7, ">7d", *ZERO, 1.0),
        _part(8, ">B?", 0, c.robot_mode == RUNNING and memory.payload >= 0.0),
    ]  # fmt: skip
    body = b"".join(parts)
    return struct.pack(">iB", 5 + len(body), ROBOT_STATE) + body


def _masterboard(c: Controller) -> bytes:
    io = c.memory.io
    form, more = ">ii2b2d2b2d4f2BbI2B", [0] * (c.version[:2] >= (3, 14))  # one more byte, for UR's own software
    return _part(
        3, form + "B" * len(more), io.digital_in, io.digital_out, io.analog_types & 1, io.analog_types >> 1 & 1,
        *io.analog_in, io.analog_types >> 2 & 1, io.analog_types >> 3 & 1, *io.analog_out, 35.0,
        48.0 if c.robot_mode > 3 else 0.0, 0.5, 0.02, c.safety_mode, 0, 0, 0, 0, 0, *more,
    )  # fmt: skip


def _part(kind: int, form: str, *values: object) -> bytes:
    body = struct.pack(form, *values)
    return struct.pack(">iB", 5 + len(body), kind) + body


def _joints(c: Controller) -> list[float]:
    arm, values = c.arm, []
    for q, target, qd, mode in zip(arm.q, arm.target_q, arm.qd, joint_modes(c), strict=True):
        values += [q, target, qd, 0.0, 48.0, 30.0, 30.0, mode]
    return values
