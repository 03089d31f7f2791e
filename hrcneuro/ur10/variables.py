"""RTDE's fields: name, type, where the value comes from or goes, and the first software that has it.

"RTDE guide", Universal Robots. Of two fields it does not say when they came: tcp_offset is of 3.12 (UR's client
library, pull request 110), joint_position_deviation_ratio is taken to be of CB3's last software only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Any

from hrcneuro.robot.dh import A, D
from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import ZERO
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.memory import BITS, DOUBLES, INTEGERS, Bank
from hrcneuro.ur10.modes import RUNNING

FORMATS = {
    "BOOL": "?", "UINT8": "B", "UINT32": "I", "UINT64": "Q", "INT32": "i", "DOUBLE": "d",
    "VECTOR3D": "3d", "VECTOR6D": "6d", "VECTOR6INT32": "6i", "VECTOR6UINT32": "6I",
}  # fmt: skip
JOINT_RUNNING, JOINT_POWER_OFF = 253, 239
UPPER = (3, 9)  # the software that brought the upper half of the registers


@dataclass(frozen=True)
class Output:
    """A field that clients read."""

    type: str
    read: Callable[[Controller], Any]
    since: tuple[int, int] = (3, 0)


@dataclass(frozen=True)
class Input:
    """A field that clients write; masked ones take effect with their mask, whatever the order in the recipe."""

    type: str
    write: Callable[[Controller, Any], None]
    since: tuple[int, int] = (3, 0)


def joint_modes(c: Controller) -> list[int]:
    """Return the joints' modes."""
    return [JOINT_RUNNING if c.robot_mode == RUNNING else JOINT_POWER_OFF] * 6


def momentum(c: Controller) -> float:
    """Return a rough norm of the linear momentum: nothing here weighs the arm's links."""
    return 10.0 * hypot(*geometry.twist(c.arm.q, c.arm.qd, c.arm.pose()[:3])[:3])


def elbow(c: Controller) -> tuple[list[float], list[float]]:
    """Return position and velocity of the elbow."""
    (q1, q2, *_), (w1, w2, *_) = c.arm.q, c.arm.qd
    x, z = A[1] * cos(q2), A[1] * sin(q2)
    at = [x * cos(q1), x * sin(q1), D[0] + z]
    return at, [-w1 * at[1] - w2 * z * cos(q1), w1 * at[0] - w2 * z * sin(q1), w2 * x]


def tcp_speed(c: Controller) -> list[float]:
    """Return the velocity of the tool centre point, as the joints move."""
    return geometry.twist(c.arm.q, c.arm.qd, c.arm.pose()[:3])


def target_tcp_speed(c: Controller) -> list[float]:
    """Return the velocity of the tool centre point, as the targets move."""
    return geometry.twist(c.arm.target_q, c.arm.target_qd, c.arm.target_pose()[:3])


def _value(value: Any) -> Callable[[Controller], Any]:
    return lambda c: value


def _outputs() -> dict[str, Output]:
    six, three = "VECTOR6D", "VECTOR3D"
    table = {
        "timestamp": Output("DOUBLE", lambda c: c.now),
        "target_q": Output(six, lambda c: c.arm.target_q),
        "target_qd": Output(six, lambda c: c.arm.target_qd),
        "target_qdd": Output(six, lambda c: c.arm.target_qdd),
        "target_current": Output(six, _value(ZERO)),
        "target_moment": Output(six, _value(ZERO)),
        "actual_q": Output(six, lambda c: c.arm.q),
        "actual_qd": Output(six, lambda c: c.arm.qd),
        "actual_current": Output(six, _value(ZERO)),
        "joint_control_output": Output(six, _value(ZERO)),
        "actual_TCP_pose": Output(six, lambda c: c.arm.pose()),
        "actual_TCP_speed": Output(six, tcp_speed),
        "actual_TCP_force": Output(six, _value(ZERO)),
        "target_TCP_pose": Output(six, lambda c: c.arm.target_pose()),
        "target_TCP_speed": Output(six, target_tcp_speed),
        "actual_digital_input_bits": Output("UINT64", lambda c: c.memory.io.digital_in),
        "joint_temperatures": Output(six, _value((30.0,) * 6)),
        "actual_execution_time": Output("DOUBLE", _value(0.0005)),
        "robot_mode": Output("INT32", lambda c: c.robot_mode),
        "joint_mode": Output("VECTOR6INT32", joint_modes),
        "safety_mode": Output("INT32", lambda c: c.safety_mode),
        "safety_status": Output("INT32", lambda c: c.safety_mode, (3, 10)),
        "actual_tool_accelerometer": Output(three, lambda c: c.arm.accelerometer()),
        "speed_scaling": Output("DOUBLE", lambda c: c.speed_scaling),
        "target_speed_fraction": Output("DOUBLE", lambda c: c.slider),
        "actual_momentum": Output("DOUBLE", momentum),
        "actual_main_voltage": Output("DOUBLE", _value(48.0)),
        "actual_robot_voltage": Output("DOUBLE", lambda c: 48.0 if c.robot_mode > 3 else 0.0),
        "actual_robot_current": Output("DOUBLE", lambda c: 0.5 if c.robot_mode > 3 else 0.0),
        "actual_joint_voltage": Output(six, _value((48.0,) * 6)),
        "actual_digital_output_bits": Output("UINT64", lambda c: c.memory.io.digital_out),
        "runtime_state": Output("UINT32", lambda c: c.runtime_state),
        "elbow_position": Output(three, lambda c: elbow(c)[0], (3, 5)),
        "elbow_velocity": Output(three, lambda c: elbow(c)[1], (3, 5)),
        "robot_status_bits": Output("UINT32", lambda c: c.status_bits),
        "safety_status_bits": Output("UINT32", lambda c: c.safety_bits),
        "analog_io_types": Output("UINT32", lambda c: c.memory.io.analog_types),
        "io_current": Output("DOUBLE", _value(0.02)),
        "euromap67_input_bits": Output("UINT32", _value(0)),
        "euromap67_output_bits": Output("UINT32", lambda c: c.memory.io.euromap_out),
        "euromap67_24V_voltage": Output("DOUBLE", _value(0.0)),
        "euromap67_24V_current": Output("DOUBLE", _value(0.0)),
        "tool_mode": Output("UINT32", lambda c: JOINT_RUNNING if c.robot_mode == RUNNING else JOINT_POWER_OFF),
        "tool_analog_input_types": Output("UINT32", lambda c: c.memory.io.tool_analog_types),
        "tool_output_voltage": Output("INT32", lambda c: c.memory.io.tool_voltage),
        "tool_output_current": Output("DOUBLE", _value(0.0)),
        "tool_temperature": Output("DOUBLE", _value(30.0)),
        "tool_output_mode": Output("UINT8", _value(0)),
        "tool_digital_output0_mode": Output("UINT8", _value(0)),
        "tool_digital_output1_mode": Output("UINT8", _value(0)),
        "tcp_force_scalar": Output("DOUBLE", _value(0.0)),
        "payload": Output("DOUBLE", lambda c: c.memory.payload, (3, 11)),
        "payload_cog": Output(three, lambda c: c.memory.cog, (3, 11)),
        "payload_inertia": Output(six, lambda c: c.memory.inertia, (3, 15)),
        "tcp_offset": Output(six, lambda c: c.arm.tcp, (3, 12)),
        "joint_position_deviation_ratio": Output("DOUBLE", lambda c: c.arm.deviation, (3, 15)),
        "script_control_line": Output("UINT32", _value(0), (3, 14)),
    }
    for i in (0, 1):
        table[f"standard_analog_input{i}"] = Output("DOUBLE", _channel("analog_in", i))
        table[f"standard_analog_output{i}"] = Output("DOUBLE", _channel("analog_out", i))
        table[f"tool_analog_input{i}"] = Output("DOUBLE", _channel("tool_analog_in", i))
    for direction in ("output", "input"):
        table.update(_registers(direction, f"{direction}s"))
    return table


def _registers(prefix: str, bank: str) -> dict[str, Output]:
    table = {}
    for first in (0, 32):
        table[f"{prefix}_bit_registers{first}_to_{first + 31}"] = Output("UINT32", _word(bank, first))
    for i in range(64, BITS):
        table[f"{prefix}_bit_register_{i}"] = Output("BOOL", _register(bank, "bits", i), UPPER)
    for i in range(INTEGERS):
        table[f"{prefix}_int_register_{i}"] = Output("INT32", _register(bank, "ints", i), _half(i))
    for i in range(DOUBLES):
        table[f"{prefix}_double_register_{i}"] = Output("DOUBLE", _register(bank, "doubles", i), _half(i))
    return table


def _half(i: int) -> tuple[int, int]:
    return (3, 0) if i < INTEGERS // 2 else UPPER


def _channel(kind: str, i: int) -> Callable[[Controller], Any]:
    return lambda c: getattr(c.memory.io, kind)[i]


def _register(bank: str, kind: str, i: int) -> Callable[[Controller], Any]:
    return lambda c: getattr(getattr(c.memory, bank), kind)[i]


def _word(bank: str, first: int) -> Callable[[Controller], Any]:
    return lambda c: getattr(c.memory, bank).word(first)


def _inputs() -> dict[str, Input]:
    table: dict[str, Input] = {"external_force_torque": Input("VECTOR6D", lambda c, v: None)}

    def masked(group: str, mask_type: str, fields: dict[str, str]) -> None:
        table[f"{group}_mask"] = Input(mask_type, lambda c, v: c.memory.masks.__setitem__(group, v))
        for name, kind in fields.items():
            table[name] = Input(kind, _masked(group, name))

    masked("speed_slider", "UINT32", {"speed_slider_fraction": "DOUBLE"})
    for group in _FIRST_BIT:
        masked(group, "UINT8", {group: "UINT8"})
    masked(
        "standard_analog_output",
        "UINT8",
        {
            "standard_analog_output_type": "UINT8",
            "standard_analog_output_0": "DOUBLE",
            "standard_analog_output_1": "DOUBLE",
        },
    )
    for first in (0, 32):
        table[f"input_bit_registers{first}_to_{first + 31}"] = Input("UINT32", _put_word(first))
    for i in range(64, BITS):
        table[f"input_bit_register_{i}"] = Input("BOOL", _put("bits", i), UPPER)
    for i in range(INTEGERS):
        table[f"input_int_register_{i}"] = Input("INT32", _put("ints", i), _half(i))
    for i in range(DOUBLES):
        table[f"input_double_register_{i}"] = Input("DOUBLE", _put("doubles", i), _half(i))
    return table


def _put(kind: str, i: int) -> Callable[[Controller, Any], None]:
    def write(c: Controller, value: Any) -> None:
        bank: Bank = c.memory.inputs
        getattr(bank, kind)[i] = value

    return write


def _put_word(first: int) -> Callable[[Controller, Any], None]:
    return lambda c, value: c.memory.inputs.set_word(first, value)


def _masked(group: str, name: str) -> Callable[[Controller, Any], None]:
    return lambda c, value: _apply(c, group, name, value)


_FIRST_BIT = {"standard_digital_output": 0, "configurable_digital_output": 8, "tool_digital_output": 16}


def _apply(c: Controller, group: str, name: str, value: Any) -> None:
    mask, io = c.memory.masks.get(group, 0), c.memory.io
    if group in _FIRST_BIT:
        for bit in range(8 if _FIRST_BIT[group] < 16 else 2):
            if mask >> bit & 1:
                io.set_out(_FIRST_BIT[group] + bit, bool(value >> bit & 1))
    elif group == "speed_slider":
        if mask & 1 and 0.0 <= value <= 1.0:
            c.slider = value
    elif name.endswith("_type"):
        for bit in (0, 1):
            if mask >> bit & 1:
                io.analog_types = io.analog_types & ~(4 << bit) | (value >> bit & 1) << 2 + bit
    elif mask >> int(name[-1]) & 1 and 0.0 <= value <= 1.0:
        voltage = io.analog_types >> 2 + int(name[-1]) & 1
        io.analog_out[int(name[-1])] = 10.0 * value if voltage else 0.004 + 0.016 * value


OUTPUTS = _outputs()
INPUTS = _inputs()
