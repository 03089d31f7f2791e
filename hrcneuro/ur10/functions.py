"""URScript's built-in functions of a line each: state, payload, registers, inputs and outputs.

``one_liners`` gathers them for a controller; each group below is the functions of one thing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, ZERO, Arm
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.memory import Bank, Io, Memory
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose, Routine

Vector = Sequence[float]
Functions = dict[str, Callable[..., Any]]


def one_liners(controller: Controller) -> Functions:
    """Return the functions of a controller by their names in a script."""
    memory = controller.memory
    return {
        **_state(controller.arm),
        **_payload(memory),
        **_force(),
        **_registers(memory.inputs, memory.outputs),
        **_digital(memory.io),
        **_analog(memory.io),
    }


def _state(arm: Arm) -> Functions:
    def tip() -> list[float]:
        return arm.pose()[:3]

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
        "get_joint_temp": lambda j: 30.0, "get_controller_temp": lambda: 35.0, "get_tool_current": lambda: 0.0,
        "get_steptime": lambda: CYCLE,
        "is_steady": lambda: arm.at_rest,
    }  # fmt: skip


def _payload(memory: Memory) -> Functions:
    def set_payload(m: float, cog: Vector = ()) -> None:
        memory.payload = float(m)
        memory.cog = list(cog or memory.cog)

    return {
        "set_payload": set_payload,
        "set_payload_mass": lambda m: set_payload(m), "set_payload_cog": lambda cog: set_payload(memory.payload, cog),
        "get_target_payload": lambda: memory.payload, "get_target_payload_mass": lambda: memory.payload,
        "get_target_payload_cog": lambda: list(memory.cog),
    }  # fmt: skip


def _force() -> Functions:
    # The arm weighs nothing and cannot be pushed: these are taken, and it holds still.
    nothing: Callable[..., None] = lambda *_, **__: None  # noqa: E731
    return {
        "get_tcp_force": lambda: list(ZERO), "get_joint_torques": lambda: list(ZERO), "force": lambda: 0.0,
        "set_gravity": nothing,
        "force_mode": nothing, "end_force_mode": nothing, "force_mode_set_damping": nothing,
        "force_mode_set_gain_scaling": nothing, "zero_ftsensor": nothing,
        "enable_external_ft_sensor": nothing, "end_teach_mode": nothing,
        "teach_mode": _nothing_takes_time, "freedrive_mode": nothing, "end_freedrive_mode": nothing,
    }  # fmt: skip


def _nothing_takes_time() -> Routine:
    return
    yield


def _registers(inputs: Bank, outputs: Bank) -> Functions:
    def read(values: list[Any]) -> Callable[[int], Any]:
        return lambda address: values[_index(address, len(values))]

    def write(values: list[Any], kind: Callable[[Any], Any]) -> Callable[[int, Any], None]:
        def put(address: int, value: Any) -> None:
            values[_index(address, len(values))] = kind(value)

        return put

    return {
        "read_input_integer_register": read(inputs.ints), "read_input_float_register": read(inputs.doubles),
        "read_input_boolean_register": read(inputs.bits), "read_output_integer_register": read(outputs.ints),
        "read_output_float_register": read(outputs.doubles), "read_output_boolean_register": read(outputs.bits),
        "write_output_integer_register": write(outputs.ints, _int32),
        "write_output_float_register": write(outputs.doubles, float),
        "write_output_boolean_register": write(outputs.bits, bool),
    }  # fmt: skip


def _digital(io: Io) -> Functions:
    def get(word: str, first: int, size: int) -> Callable[[int], bool]:
        return lambda n: bool(getattr(io, word) >> _index(n, size) + first & 1)

    def put(first: int, size: int) -> Callable[[int, bool], None]:
        return lambda n, b: io.set_out(_index(n, size) + first, bool(b))

    functions: Functions = {}
    for kind, first, size in (("standard_", 0, 8), ("configurable_", 8, 8), ("tool_", 16, 2), ("", 0, 18)):
        functions[f"get_{kind}digital_in"] = get("digital_in", first, size)
        functions[f"get_{kind}digital_out"] = get("digital_out", first, size)
        functions[f"set_{kind}digital_out"] = put(first, size)
    return functions


def _analog(io: Io) -> Functions:
    def put(n: int, f: float) -> None:
        # A share of the range: 4 … 20 mA or 0 … 10 V.
        share = min(max(float(f), 0.0), 1.0)
        voltage = io.analog_types >> 2 + _index(n, 2) & 1
        io.analog_out[n] = 10.0 * share if voltage else 0.004 + 0.016 * share

    return {
        "get_standard_analog_in": lambda n: io.analog_in[_index(n, 2)],
        "get_standard_analog_out": lambda n: io.analog_out[_index(n, 2)],
        "get_tool_analog_in": lambda n: io.tool_analog_in[_index(n, 2)],
        "set_standard_analog_out": put, "set_analog_out": put,
        "set_tool_voltage": lambda v: setattr(io, "tool_voltage", int(v)),
    }  # fmt: skip


def _index(value: Any, size: int) -> int:
    if not 0 <= int(value) < size:
        raise ScriptError(f"runtime error: no channel {value}; 0 … {size - 1} exist")
    return int(value)


def _int32(value: Any) -> int:
    return (int(value) + 2**31) % 2**32 - 2**31
