"""What the arguments of URScript's built-in functions may be: types and ranges of UR's script manual for the CB3.

docs/robot.md says where the manual gives no range and what was taken instead. Numbers of channels, registers and
places in a string are checked where they are used (:func:`hrcneuro.ur10.urscript.values.index`).
"""

from __future__ import annotations

from hrcneuro.ur10.urscript.arguments import Either, Integer, Kind, Number, Numbers, OneOf, Text

_MOST_PAYLOAD = 10.0  # kg: the UR10's, user manual 3.13
_MOST_INERTIA = 133.0  # kg m²: the script manual's, for set_target_payload

_ANY = Number()
_POSITIVE = Number(above=0.0)
_NOT_NEGATIVE = Number(low=0.0)
_SHARE = Number(0.0, 1.0)
_SINE = Number(-1.0, 1.0)
_WHOLE = Integer()
_BYTE = Integer(0, 255)
_BOOLEAN = OneOf((True, False))
_TEXT = Text()
_NAME = Text(least=1)
_THREE = Numbers(3)
_SIX = Numbers(6)
_AXES = Numbers(6, OneOf((0, 1)))
_ACTION = OneOf(("default", "freedrive"))
_SIGNAL = Text(1, 20)
_NOT_SECONDARY = OneOf((False,))  # the script manual: for internal use, must be False

_MOTION: dict[str, dict[str, Kind]] = {
    # Of movej and movel, a and v count where there is no t: they are looked at there.
    "movej": {"q": _SIX, "a": _ANY, "v": _ANY, "t": _NOT_NEGATIVE, "r": _NOT_NEGATIVE},
    "movel": {"pose": _SIX, "a": _ANY, "v": _ANY, "t": _NOT_NEGATIVE, "r": _NOT_NEGATIVE},
    "movep": {"pose": _SIX, "a": _POSITIVE, "v": _POSITIVE, "r": _NOT_NEGATIVE},
    "movec": {
        "pose_via": _SIX, "pose_to": _SIX, "a": _POSITIVE, "v": _POSITIVE, "r": _NOT_NEGATIVE, "mode": OneOf((0, 1))
    },
    # UR's client library sends an acceleration of 0 where a spline keeps its velocity.
    "speedj": {"qd": _SIX, "a": _NOT_NEGATIVE, "t": _NOT_NEGATIVE, "t_min": _NOT_NEGATIVE},
    "speedl": {"xd": _SIX, "a": _NOT_NEGATIVE, "t": _NOT_NEGATIVE, "aRot": _NOT_NEGATIVE, "t_min": _NOT_NEGATIVE},
    "servoj": {
        "q": _SIX, "a": _ANY, "v": _ANY, "t": _NOT_NEGATIVE, "lookahead_time": Number(0.03, 0.2),
        "gain": Number(100.0, 2000.0)
    },
    "servoc": {"pose": _SIX, "a": _POSITIVE, "v": _POSITIVE, "r": _NOT_NEGATIVE},
    "stopj": {"a": _POSITIVE},
    "stopl": {"a": _POSITIVE, "aRot": _POSITIVE},
    "stop_conveyor_tracking": {"a": _POSITIVE},
    "sleep": {"t": _NOT_NEGATIVE},
    "get_inverse_kin": {
        "x": _SIX, "qnear": _SIX, "maxPositionError": _NOT_NEGATIVE, "maxOrientationError": _NOT_NEGATIVE, "tcp": _SIX
    },
    "get_inverse_kin_has_solution": {
        "pose": _SIX, "qnear": _SIX, "maxPositionError": _NOT_NEGATIVE, "maxOrientationError": _NOT_NEGATIVE,
        "tcp": _SIX
    },
    "get_forward_kin": {"q": _SIX, "tcp": _SIX},
    "is_within_safety_limits": {"target": _SIX},
    "set_tcp": {"pose": _SIX},
    "set_pos": {"q": _SIX},
    "reset_revolution_counter": {"qNear": _SIX},
    "position_deviation_warning": {"enabled": _BOOLEAN, "threshold": Number(above=0.0, high=1.0)},
    "track_conveyor_linear": {"direction": _SIX, "ticks_per_meter": _ANY},
    "track_conveyor_circular": {"center": _SIX, "ticks_per_revolution": _ANY, "rotate_tool": _BOOLEAN},
    "encoder_unwind_delta_tick_count": {"delta_tick_count": _ANY},
}  # fmt: skip

_PAYLOAD: dict[str, dict[str, Kind]] = {
    "set_payload": {"m": Number(0.0, _MOST_PAYLOAD), "cog": _THREE},
    "set_payload_mass": {"m": Number(0.0, _MOST_PAYLOAD)},
    "set_payload_cog": {"CoG": _THREE},
    "set_target_payload": {
        "m": Number(0.0, _MOST_PAYLOAD), "cog": _THREE, "inertia": Numbers(6, Number(-_MOST_INERTIA, _MOST_INERTIA)),
        "transition_time": _NOT_NEGATIVE
    },
    "set_gravity": {"d": _THREE},
}  # fmt: skip

_FORCE: dict[str, dict[str, Kind]] = {
    "force_mode": {
        "task_frame": _SIX, "selection_vector": _AXES, "wrench": _SIX, "type": OneOf((1, 2, 3)), "limits": _SIX
    },
    "force_mode_set_damping": {"damping": _SHARE},
    "force_mode_set_gain_scaling": {"scaling": Number(0.0, 2.0)},
    "freedrive_mode": {"freeAxes": _AXES, "feature": Either((_SIX, OneOf(("base", "tool"))))},
    "tool_contact": {"direction": _SIX},
    **{
        name: {
            "enable": _BOOLEAN, "sensor_mass": _NOT_NEGATIVE, "sensor_measuring_offset": _THREE, "sensor_cog": _THREE
        }
        for name in ("enable_external_ft_sensor", "ft_rtde_input_enable")
    },
}  # fmt: skip

_SIGNALS: dict[str, dict[str, Kind]] = {
    "write_output_integer_register": {"value": _WHOLE},
    "write_output_float_register": {"value": _ANY},
    "set_standard_analog_out": {"f": _SHARE},
    "set_analog_out": {"f": _SHARE},
    "set_tool_voltage": {"voltage": OneOf((0, 12, 24))},
    "rtde_set_watchdog": {"variable_name": _NAME, "min_frequency": _NOT_NEGATIVE, "action": _TEXT},
    "popup": {"title": _TEXT, "warning": _BOOLEAN, "error": _BOOLEAN, "blocking": _BOOLEAN},
    "set_runstate_outputs": {"outputs": Numbers(each=_WHOLE)},
    **{
        f"set_{kind}_input_action": {"action": _ACTION}
        for kind in ("standard_digital", "configurable_digital", "tool_digital", "gp_boolean")
    },
    # 16 bits, with a sign or without.
    "write_port_register": {"value": Integer(-(1 << 15), (1 << 16) - 1)},
    "modbus_add_signal": {
        "IP": _NAME, "slave_number": _BYTE, "signal_address": Integer(0, (1 << 16) - 1),
        "signal_type": OneOf((0, 1, 2, 3, 15, 16)), "signal_name": _SIGNAL, "sequential_mode": _BOOLEAN,
        "register_count": Integer(low=1)
    },
    "modbus_delete_signal": {"signal_name": _SIGNAL},
    "modbus_send_custom_command": {
        "IP": _NAME, "slave_number": _BYTE, "function_code": _BYTE, "data": Numbers(each=_BYTE)
    },
    "modbus_set_output_register": {
        "signal_name": _SIGNAL, "register_value": Integer(0, (1 << 16) - 1), "is_secondary_program": _NOT_SECONDARY
    },
    "modbus_set_output_signal": {
        "signal_name": _SIGNAL, "digital_value": _BOOLEAN, "is_secondary_program": _NOT_SECONDARY
    },
    "modbus_get_signal_status": {"signal_name": _SIGNAL, "is_secondary_program": _NOT_SECONDARY},
    "modbus_set_signal_update_frequency": {"signal_name": _SIGNAL, "update_frequency": Integer(0, 125)},
    "modbus_set_runstate_dependent_choice": {"signal_name": _SIGNAL, "runstate_choice": Integer(0, 2)},
    "modbus_set_digital_input_action": {"signal_name": _SIGNAL, "action": _ACTION},
}  # fmt: skip

_SOCKET: dict[str, Kind] = {"socket_name": _TEXT, "timeout": _ANY}
_TALK: dict[str, dict[str, Kind]] = {
    "socket_open": {"address": _TEXT, "port": Integer(0, (1 << 16) - 1), **_SOCKET},
    "socket_close": _SOCKET,
    **{
        f"socket_read_{kind}": {"number": Integer(1, 30), **_SOCKET}
        for kind in ("binary_integer", "byte_list", "ascii_float")
    },
    "socket_read_line": _SOCKET,
    "socket_read_string": {"prefix": _TEXT, "suffix": _TEXT, "interpret_escape": _BOOLEAN, **_SOCKET},
    "socket_get_var": {"name": _NAME, **_SOCKET},
    "socket_set_var": {"name": _NAME, "value": _WHOLE, **_SOCKET},
    "socket_send_byte": {"value": _BYTE, **_SOCKET},
    "socket_send_int": {"value": _WHOLE, **_SOCKET},
    "socket_send_string": _SOCKET,
    "socket_send_line": _SOCKET,
}

_NUMBER_OF: dict[str, Kind] = {"x": _ANY}
_POSES: dict[str, Kind] = {"a": _SIX, "b": _SIX}
_COMPUTING: dict[str, dict[str, Kind]] = {
    **dict.fromkeys(("atan", "cos", "sin", "tan", "ceil", "floor", "d2r", "r2d"), _NUMBER_OF),
    "acos": {"x": _SINE},
    "asin": {"x": _SINE},
    "sqrt": {"x": _NOT_NEGATIVE},
    "atan2": {"y": _ANY, "x": _ANY},
    "pow": {"x": _ANY, "y": _ANY},
    "log": {"base": _POSITIVE, "value": _POSITIVE},
    "norm": {"value": Either((_ANY, Numbers()))},
    "integer_to_binary_list": {"value": _WHOLE},
    "binary_list_to_integer": {"bits": Numbers(each=_BOOLEAN)},
    **dict.fromkeys(("pose_trans", "pose_add", "pose_sub", "pose_dist", "point_dist"), _POSES),
    "pose_inv": {"a": _SIX},
    "interpolate_pose": {**_POSES, "alpha": _ANY},
    "rpy2rotvec": {"rpy": _THREE},
    "rotvec2rpy": {"v": _THREE},
    "wrench_trans": {"t": _SIX, "w": _SIX},
    "to_num": {"str": _TEXT},
    "str_len": {"obj": _TEXT},
    "str_empty": {"str": _TEXT},
    "str_at": {"src": _TEXT},
    "str_sub": {"src": _TEXT},
    "str_find": {"src": _TEXT, "target": _TEXT},
}

RANGES: dict[str, dict[str, Kind]] = {**_MOTION, **_PAYLOAD, **_FORCE, **_SIGNALS, **_TALK, **_COMPUTING}
"""Function, parameter, and what it may be; a parameter that is not here takes anything, or is checked where used."""
