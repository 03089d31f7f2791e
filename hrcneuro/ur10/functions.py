"""URScript's built-in functions of a line each: state, payload, registers, inputs and outputs.

``one_liners`` gathers them for a controller; each group below is the functions of one thing. Parameters have the script
manual's names: programs may write them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, ZERO, Arm
from hrcneuro.ur10.configuration import configuration
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.conveyor import conveyor
from hrcneuro.ur10.fieldbus import fieldbus
from hrcneuro.ur10.memory import FLAGS, Bank, Io, Memory
from hrcneuro.ur10.urscript.arguments import Number, Numbers, require
from hrcneuro.ur10.urscript.runtime import Pose, Routine
from hrcneuro.ur10.urscript.values import Values, index
from hrcneuro.ur10.variables import UPPER

Vector = Sequence[float]
_MOMENTS = Numbers(3, Number(low=0.0))  # the script manual: Ixx, Iyy and Izz are not negative
Functions = dict[str, Callable[..., Any]]


def one_liners(controller: Controller) -> Functions:
    """Return the functions of a controller by their names in a script."""
    memory = controller.memory
    return {
        **_state(controller.arm),
        **_payload(memory),
        **_force(),
        **_registers(memory.inputs, memory.outputs, controller.version[:2] < UPPER),
        **_digital(memory.io),
        **_analog(memory.io),
        **_flags(memory.flags),
        **configuration(memory.io),
        **conveyor(memory.encoders),
        **fieldbus(memory),
    }


def _state(arm: Arm) -> Functions:
    def tip() -> list[float]:
        return arm.pose()[:3]

    def past(steps: int = 0) -> list[float]:
        return list(arm.history[-1 - index(steps, len(arm.history))])

    def joint_temperature(j: int) -> float:
        index(j, 6)
        return 30.0

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
        "get_actual_joint_positions_history": past,
        "get_joint_temp": joint_temperature, "get_controller_temp": lambda: 35.0, "get_tool_current": lambda: 0.0,
        "get_tool_accelerometer_reading": arm.accelerometer,
        # The real arm's joints stay where they are: one that PolyScope only shows would be set, and a joint without
        # end would count its turns anew.
        "set_pos": lambda q: None,
        "reset_revolution_counter": lambda qNear=ZERO: None,
        "get_steptime": lambda: CYCLE,
        "is_steady": lambda: arm.steady,
    }  # fmt: skip


def _payload(memory: Memory) -> Functions:
    def set_payload(m: float, cog: Vector = ()) -> None:
        memory.payload = float(m)
        memory.cog = [float(v) for v in cog or memory.cog]

    def set_target_payload(m: float, cog: Vector, inertia: Vector = ZERO, transition_time: float = 0.0) -> None:
        require("set_target_payload", "inertia's beginning", _MOMENTS, list(inertia[:3]))
        set_payload(m, cog)
        memory.inertia = [float(v) for v in inertia]

    return {
        "set_payload": set_payload, "set_target_payload": set_target_payload,
        "set_payload_mass": lambda m: set_payload(m), "set_payload_cog": lambda CoG: set_payload(memory.payload, CoG),
        "get_target_payload": lambda: memory.payload, "get_target_payload_mass": lambda: memory.payload,
        "get_target_payload_cog": lambda: list(memory.cog), "get_target_payload_inertia": lambda: list(memory.inertia),
    }  # fmt: skip


def _force() -> Functions:
    # The arm weighs nothing and cannot be pushed: these are taken, and it holds still.
    def sensor(
        enable: bool, sensor_mass: float = 0.0, sensor_measuring_offset: Vector = (), sensor_cog: Vector = ()
    ) -> None:
        return

    def teach_mode() -> Routine:
        return
        yield

    return {
        "get_tcp_force": lambda: list(ZERO), "get_joint_torques": lambda: list(ZERO), "force": lambda: 0.0,
        "tool_contact": lambda direction=ZERO: 0,
        "set_gravity": lambda d: None,
        "force_mode": lambda task_frame, selection_vector, wrench, type, limits: None, "end_force_mode": lambda: None,
        "force_mode_set_damping": lambda damping: None, "force_mode_set_gain_scaling": lambda scaling: None,
        "zero_ftsensor": lambda: None, "enable_external_ft_sensor": sensor, "ft_rtde_input_enable": sensor,
        "teach_mode": teach_mode, "end_teach_mode": lambda: None,
        "freedrive_mode": lambda freeAxes=(), feature="base": None, "end_freedrive_mode": lambda: None,
    }  # fmt: skip


def _registers(inputs: Bank, outputs: Bank, lower_half_only: bool) -> Functions:
    def size(values: list[Any]) -> int:
        return len(values) // 2 if lower_half_only else len(values)

    def read(values: list[Any]) -> Callable[[int], Any]:
        return lambda address: values[index(address, size(values))]

    def write(values: list[Any], kind: Callable[[Any], Any]) -> Callable[[int, Any], None]:
        def put(address: int, value: Any) -> None:
            values[index(address, size(values))] = kind(value)

        return put

    return {
        "read_input_integer_register": read(inputs.ints), "read_input_float_register": read(inputs.doubles),
        "read_input_boolean_register": read(inputs.bits), "read_output_integer_register": read(outputs.ints),
        "read_output_float_register": read(outputs.doubles), "read_output_boolean_register": read(outputs.bits),
        "write_output_integer_register": write(outputs.ints, int),
        "write_output_float_register": write(outputs.doubles, float),
        "write_output_boolean_register": write(outputs.bits, Values.boolean),
    }  # fmt: skip


def _digital(io: Io) -> Functions:
    # The functions without a kind are from before there were kinds: 0 … 7 standard, 8 and 9 the tool's.
    kinds: dict[str, Sequence[int]] = {
        "standard_": range(8), "configurable_": range(8, 16), "tool_": (16, 17), "": (*range(8), 16, 17)
    }  # fmt: skip

    def get(word: str, bits: Sequence[int]) -> Callable[[int], bool]:
        return lambda n: bool(getattr(io, word) >> bits[index(n, len(bits))] & 1)

    def put(bits: Sequence[int]) -> Callable[[int, bool], None]:
        return lambda n, b: io.set_out(bits[index(n, len(bits))], Values.boolean(b))

    functions: Functions = {}
    for kind, bits in kinds.items():
        functions[f"get_{kind}digital_in"] = get("digital_in", bits)
        functions[f"get_{kind}digital_out"] = get("digital_out", bits)
        functions[f"set_{kind}digital_out"] = put(bits)
    return functions


def _analog(io: Io) -> Functions:
    def put(n: int, f: float) -> None:
        # A share of the range: 4 … 20 mA or 0 … 10 V.
        voltage = io.analog_types >> 2 + index(n, 2) & 1
        io.analog_out[index(n, 2)] = 10.0 * f if voltage else 0.004 + 0.016 * f

    def tool_voltage(voltage: int) -> None:
        io.tool_voltage = int(voltage)

    def get_analog_in(n: int) -> float:
        return (*io.analog_in, *io.tool_analog_in)[index(n, 4)]

    return {
        "get_standard_analog_in": lambda n: io.analog_in[index(n, 2)],
        "get_standard_analog_out": lambda n: io.analog_out[index(n, 2)],
        "get_tool_analog_in": lambda n: io.tool_analog_in[index(n, 2)],
        "get_analog_in": get_analog_in, "get_analog_out": lambda n: io.analog_out[index(n, 2)],
        "set_standard_analog_out": put, "set_analog_out": put, "set_tool_voltage": tool_voltage,
    }  # fmt: skip


def _flags(flags: list[bool]) -> Functions:
    def set_flag(n: int, b: bool) -> None:
        flags[index(n, FLAGS)] = Values.boolean(b)

    return {"get_flag": lambda n: flags[index(n, FLAGS)], "set_flag": set_flag}
