"""URScript's built-in functions of a line each: state, registers, inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, ZERO
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose, Routine

Vector = Sequence[float]


def plain(c: Controller) -> dict[str, Callable[..., Any]]:
    """Return the functions of a line each."""
    arm, memory, io = c.arm, c.memory, c.memory.io
    given, taken = memory.inputs, memory.outputs

    def set_payload(m: float, cog: Vector = ()) -> None:
        memory.payload = float(m)
        memory.cog = list(cog or memory.cog)

    def tip() -> list[float]:
        return arm.pose()[:3]

    def bit(word: str, first: int, last: int) -> Callable[[int], bool]:
        return lambda n: bool(getattr(io, word) >> _index(n, last) + first & 1)

    def out(first: int, last: int) -> Callable[[int, bool], None]:
        return lambda n, b: io.set_out(_index(n, last) + first, bool(b))

    def put(bank: list[Any], kind: Callable[[Any], Any]) -> Callable[[int, Any], None]:
        def write(address: int, value: Any) -> None:
            bank[_index(address, len(bank))] = kind(value)

        return write

    def take(bank: list[Any]) -> Callable[[int], Any]:
        return lambda address: bank[_index(address, len(bank))]

    def set_analog(n: int, f: float) -> None:
        # A share of the range: 4 … 20 mA or 0 … 10 V.
        share = min(max(float(f), 0.0), 1.0)
        voltage = io.analog_types >> 2 + _index(n, 2) & 1
        io.analog_out[n] = 10.0 * share if voltage else 0.004 + 0.016 * share

    nothing: Callable[..., None] = lambda *_, **__: None  # noqa: E731
    return {
        "get_actual_joint_positions": lambda: list(arm.q), "get_joint_positions": lambda: list(arm.q),
        "get_actual_joint_speeds": lambda: list(arm.qd), "get_joint_speeds": lambda: list(arm.qd),
        "get_target_joint_positions": lambda: list(arm.target_q),
        "get_target_joint_speeds": lambda: list(arm.target_qd),
        "get_target_joint_accelerations": lambda: list(arm.target_qdd),
        "get_actual_tcp_pose": lambda: Pose(arm.pose()), "get_tcp_pose": lambda: Pose(arm.pose()),
        "get_target_tcp_pose": lambda: Pose(arm.target_pose()),
        "get_target_waypoint": lambda: Pose(arm.target_pose()),
        "get_actual_tool_flange_pose": lambda: Pose(geometry.pose(arm.q, ZERO)),
        "get_actual_tcp_speed": lambda: geometry.twist(arm.q, arm.qd, tip()),
        "get_target_tcp_speed": lambda: geometry.twist(arm.target_q, arm.target_qd, arm.target_pose()[:3]),
        "get_tcp_offset": lambda: Pose(arm.tcp),
        "get_tcp_force": lambda: list(ZERO), "get_joint_torques": lambda: list(ZERO), "force": lambda: 0.0,
        "get_joint_temp": lambda j: 30.0, "get_controller_temp": lambda: 35.0, "get_tool_current": lambda: 0.0,
        "get_steptime": lambda: CYCLE,
        "is_steady": lambda: arm.at_rest,
        "set_payload": set_payload,
        "set_payload_mass": lambda m: set_payload(m), "set_payload_cog": lambda cog: set_payload(memory.payload, cog),
        "get_target_payload": lambda: memory.payload, "get_target_payload_mass": lambda: memory.payload,
        "get_target_payload_cog": lambda: list(memory.cog),
        "set_gravity": nothing, "set_tool_voltage": lambda v: setattr(io, "tool_voltage", int(v)),
        # The arm cannot be pushed: these are taken, and it holds still.
        "force_mode": nothing, "end_force_mode": nothing, "force_mode_set_damping": nothing,
        "force_mode_set_gain_scaling": nothing, "zero_ftsensor": nothing,
        "enable_external_ft_sensor": nothing, "end_teach_mode": nothing,
        "teach_mode": _nothing_takes_time, "freedrive_mode": nothing, "end_freedrive_mode": nothing,
        "read_input_integer_register": take(given.ints), "read_input_float_register": take(given.doubles),
        "read_input_boolean_register": take(given.bits), "read_output_integer_register": take(taken.ints),
        "read_output_float_register": take(taken.doubles), "read_output_boolean_register": take(taken.bits),
        "write_output_integer_register": put(taken.ints, _int32),
        "write_output_float_register": put(taken.doubles, float),
        "write_output_boolean_register": put(taken.bits, bool),
        "get_standard_digital_in": bit("digital_in", 0, 8), "get_standard_digital_out": bit("digital_out", 0, 8),
        "get_configurable_digital_in": bit("digital_in", 8, 8),
        "get_configurable_digital_out": bit("digital_out", 8, 8),
        "get_tool_digital_in": bit("digital_in", 16, 2), "get_tool_digital_out": bit("digital_out", 16, 2),
        "get_digital_in": bit("digital_in", 0, 18), "get_digital_out": bit("digital_out", 0, 18),
        "set_standard_digital_out": out(0, 8), "set_configurable_digital_out": out(8, 8),
        "set_tool_digital_out": out(16, 2), "set_digital_out": out(0, 18),
        "get_standard_analog_in": lambda n: io.analog_in[_index(n, 2)],
        "get_standard_analog_out": lambda n: io.analog_out[_index(n, 2)],
        "get_tool_analog_in": lambda n: io.tool_analog_in[_index(n, 2)],
        "set_standard_analog_out": set_analog, "set_analog_out": set_analog,
    }  # fmt: skip


def _nothing_takes_time() -> Routine:
    return
    yield


def _index(value: Any, size: int) -> int:
    if not 0 <= int(value) < size:
        raise ScriptError(f"runtime error: no channel {value}; 0 … {size - 1} exist")
    return int(value)


def _int32(value: Any) -> int:
    return (int(value) + 2**31) % 2**32 - 2**31
