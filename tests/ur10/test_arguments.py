"""What URScript's built-in functions may be given: types and ranges of the script manual, of all functions."""

import contextlib
import re
from inspect import isgenerator, signature
from math import inf, nan

import pytest
from ur10_robot import Robot

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import START, ZERO
from hrcneuro.ur10.ranges import RANGES
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose

Q, POSE, THREE, AXES = list(START), Pose(geometry.pose(START, ZERO)), [0, 0, 0.1], [1, 1, 1, 0, 0, 0]
LINE, SIGNAL = [0.0, 0.0, 0.0, 0.0, 0.0, 0.1], "s"
FORCE = [POSE, AXES, LINE, 2, LINE]
KINDS = ("standard_", "configurable_", "tool_", "")
SENSOR = [True, 1, THREE, THREE]
# Of every function, all its arguments in order, as a program may give them.
GOOD = {
    **{name: [0.5] for name in ("acos", "asin", "atan", "cos", "sin", "tan", "sqrt", "ceil", "floor", "d2r", "r2d")},
    "atan2": [0.5, 1], "pow": [2, 0.5], "log": [2, 8], "norm": [[3, 4]], "length": ["abc"], "get_list_length": [[1]],
    "binary_list_to_integer": [[True, False]], "integer_to_binary_list": [5],
    **{name: [POSE, POSE] for name in ("pose_trans", "pose_add", "pose_sub", "pose_dist", "point_dist")},
    "pose_inv": [POSE], "interpolate_pose": [POSE, POSE, 0.5], "wrench_trans": [POSE, LINE],
    "rpy2rotvec": [THREE], "rotvec2rpy": [THREE],
    "to_num": ["5"], "to_str": [5], "str_at": ["abc", 0], "str_cat": ["a", "b"], "str_empty": ["a"],
    "str_find": ["abc", "b", 0], "str_len": ["abc"], "str_sub": ["abc", 0, 1],
    "movej": [Q, 1, 1, 0, 0], "movel": [POSE, 1, 0.2, 0, 0], "movep": [POSE, 1, 0.2, 0],
    "movec": [POSE, POSE, 1, 0.2, 0, 0], "speedj": [LINE, 1, 0.1, 0.1], "speedl": [LINE, 1, 0.1, 1, 0.1],
    "servoj": [Q, 0, 0, 0.008, 0.1, 300], "servoc": [POSE, 1, 0.2, 0], "stopj": [2], "stopl": [1, 1],
    "stop_conveyor_tracking": [20], "sleep": [0.1], "get_inverse_kin": [POSE, Q, 0.01, 0.01, Pose(ZERO)],
    "get_inverse_kin_has_solution": [POSE, Q, 0.01, 0.01, Pose(ZERO)], "get_forward_kin": [Q, POSE],
    "is_within_safety_limits": [Q], "set_tcp": [POSE], "set_pos": [Q], "reset_revolution_counter": [Q],
    "get_joint_temp": [0], "get_actual_joint_positions_history": [0], "position_deviation_warning": [True, 0.5],
    "set_payload": [1, THREE], "set_payload_mass": [1], "set_payload_cog": [THREE],
    "set_target_payload": [1, THREE, AXES, 0], "set_gravity": [THREE],
    "force_mode": FORCE, "force_mode_set_damping": [0.5], "force_mode_set_gain_scaling": [1],
    "freedrive_mode": [AXES, "base"], "tool_contact": [LINE],
    "enable_external_ft_sensor": SENSOR,
    "ft_rtde_input_enable": SENSOR,
    **{f"{act}_{way}_{kind}_register": [0] for act in ("read",) for way in ("input", "output")
       for kind in ("boolean", "integer", "float")},
    "write_output_boolean_register": [0, True], "write_output_integer_register": [0, 1],
    "write_output_float_register": [0, 1.5], "get_flag": [0], "set_flag": [0, True],
    **{f"get_{kind}digital_{way}": [0] for way in ("in", "out") for kind in KINDS},
    **{f"set_{kind}digital_out": [0, True] for kind in KINDS},
    **{f"get_{kind}": [0] for kind in ("standard_analog_in", "standard_analog_out", "tool_analog_in", "analog_in",
                                       "analog_out")},
    "set_standard_analog_out": [0, 0.5], "set_analog_out": [0, 0.5], "set_tool_voltage": [12],
    "set_standard_analog_input_domain": [0, 1], "set_tool_analog_input_domain": [0, 1],
    "set_analog_outputdomain": [0, 1], "set_analog_inputrange": [0, 2], "set_safety_mode_transition_hardness": [1],
    "set_runstate_outputs": [[0, 1]],
    **{f"set_{kind}_input_action": [0, "default"]
       for kind in ("standard_digital", "configurable_digital", "tool_digital", "gp_boolean")},
    **{f"set_runstate_{kind}_output_to_value": [0, 1]
       for kind in ("standard_digital", "configurable_digital", "tool_digital", "standard_analog", "gp_boolean")},
    "conveyor_pulse_decode": [1, 0, 1], "encoder_enable_pulse_decode": [1, 1, 0, 1],
    "encoder_enable_set_tick_count": [0, 0], "encoder_get_tick_count": [0], "encoder_set_tick_count": [0, 1],
    "encoder_unwind_delta_tick_count": [0, 1], "set_conveyor_tick_count": [1, 0],
    "track_conveyor_linear": [POSE, 100, 0], "track_conveyor_circular": [POSE, 100, True, 0],
    "modbus_add_signal": ["127.0.0.1", 255, 1, 1, SIGNAL, False, 1], "modbus_delete_signal": [SIGNAL],
    "modbus_send_custom_command": ["127.0.0.1", 255, 6, [17, 32]], "modbus_get_signal_status": [SIGNAL, False],
    "modbus_set_output_register": [SIGNAL, 1, False], "modbus_set_output_signal": [SIGNAL, True, False],
    "modbus_set_signal_update_frequency": [SIGNAL, 10], "modbus_set_runstate_dependent_choice": [SIGNAL, 1],
    "modbus_set_digital_input_action": [SIGNAL, "default"],
    "read_port_bit": [3], "read_port_register": [3], "write_port_bit": [3, True], "write_port_register": [3, 1],
    "get_euromap_input": [0], "get_euromap_output": [0], "set_euromap_output": [0, True],
    "set_euromap_runstate_dependent_choice": [0, 1],
    "textmsg": ["a", 1], "popup": ["a", "b", False, False, False], "rpc_factory": ["xmlrpc", "http://127.0.0.1/"],
    "rtde_set_watchdog": ["input_int_register_0", 10, "stop"],
    "socket_open": ["127.0.0.1", 9, "k"], "socket_close": ["k"],
    **{f"socket_read_{kind}": [1, "k", 1] for kind in ("binary_integer", "byte_list", "ascii_float")},
    "socket_read_line": ["k", 1], "socket_read_string": ["k", "(", ")", False, 1], "socket_get_var": ["n", "k"],
    "socket_set_var": ["n", 1, "k"], "socket_send_byte": [10, "k"], "socket_send_int": [1, "k"],
    "socket_send_string": ["a", "k"], "socket_send_line": ["a", "k"],
}  # fmt: skip
NO_NUMBERS = [nan, inf, -inf, [nan] * 6, [nan] * 3, Pose([inf] * 6)]
NONSENSE = [-1, -0.5, 1.5, 1e300, 2**31, "x", True, [], [1, 2, 3], [True] * 6, [1, [2]], Pose(range(6)), *NO_NUMBERS]
ANYTHING = {"textmsg": (0, 1), "popup": (0,), "to_str": (0,), "str_cat": (0, 1), "socket_send_string": (0,),
            "socket_send_line": (0,), "length": (0,), "get_list_length": (0,)}  # fmt: skip


def built_in():
    """Return the functions of a new robot that has a Modbus signal and an encoder that counts."""
    functions = Robot().controller.programs.functions
    functions["encoder_enable_set_tick_count"](0, 0)
    functions["modbus_add_signal"](*GOOD["modbus_add_signal"])
    return functions


def call(function, given):
    """Call a built-in function; what takes time is looked at up to where it would wait."""
    done = function(*given)
    if isgenerator(done):
        done.close()


def test_the_table_has_every_function_with_all_its_arguments():
    functions = {name: f for name, f in built_in().items() if not name.startswith("_")}
    takes = {name: len(signature(f).parameters) for name, f in functions.items()}
    assert {name: size for name, size in takes.items() if size} == {name: len(given) for name, given in GOOD.items()}


def test_ranges_are_of_parameters_that_exist():
    functions = built_in()
    for name, kinds in RANGES.items():
        names = set(signature(functions[name]).parameters)
        # Every socket function has its socket's name, some have a timeout.
        assert set(kinds) - {"timeout"} <= names, name


@pytest.mark.parametrize("name", GOOD)
def test_nonsense_is_taken_or_refused_in_the_controller_s_words(name):
    """No argument makes Python itself complain, and what is no number is none to a function that does not print it."""
    functions = built_in()
    given = GOOD[name]
    if name != "modbus_get_signal_status":  # no device answers
        call(functions[name], given)
    for at in range(len(given)):
        for value in NONSENSE:
            functions = built_in() if name.startswith("modbus") else functions
            with contextlib.suppress(ScriptError):
                call(functions[name], [*given[:at], value, *given[at + 1 :]])
                assert value not in NO_NUMBERS or at in ANYTHING.get(name, ()), f"argument {at} is {value}"


def answer(robot, call):
    """Return the last that is told of a program with a call, behind which it writes 'on'."""
    robot.run(f"def program():\nq = get_joint_positions()\n{call}\ntextmsg('on')\nend\n", seconds=3.0)
    return robot.log[-1]


@pytest.mark.parametrize(("call", "said"), [
    ("sleep(-1)", "sleep: t is a number of 0 or more, not -1"),
    ("sleep(-0.001)", "sleep: t is"),
    ("speedj([0, 0.3, 0, 0, 0, 0], -1, 0.1)", "speedj: a is a number of 0 or more, not -1"),
    ("speedj([0, 0.3, 0, 0, 0, 0], 1, -0.1)", "speedj: t is a number of 0 or more"),
    ("speedj([0, 0.3, 0, 0, 0, True], 1)", "speedj: qd is a list of 6 numbers"),
    ("speedl([0, 0.1, 0, 0, 0, 0], -1.2, 0.1)", "speedl: a is a number of 0 or more, not -1.2"),
    ("speedl([0, 0.1, 0, 0, 0, 0], 1, 0.1, aRot=-1)", "speedl: aRot is a number of 0 or more, not -1"),
    ("speedl([0, 0.1, 0, 0, 0, 0], 1, t_min=-1)", "speedl: t_min is"),
    ("movej([0, 0, 0, 0, 0, 0], a=-1.4)", "movej: a is a number above 0, not -1.4"),
    ("movej([0, 0, 0, 0, 0, 0], v=0)", "movej: v is a number above 0, not 0"),
    ("movej([0, 0, 0, 0, 0, 0], t=-2)", "movej: t is a number of 0 or more, not -2"),
    ("movej([0, 0, 0, 0, 0, 0], r=-0.01)", "movej: r is a number of 0 or more, not -0.01"),
    ("movel(get_actual_tcp_pose(), a=0)", "movel: a is a number above 0, not 0"),
    ("movel(get_actual_tcp_pose(), v=-0.2)", "movel: v is"),
    ("movel(get_actual_tcp_pose(), t=-1)", "movel: t is"),
    ("movel(get_actual_tcp_pose(), r=-1)", "movel: r is"),
    ("movep(get_actual_tcp_pose(), a=-1)", "movep: a is"),
    ("movec(get_actual_tcp_pose(), get_actual_tcp_pose(), mode=2)", "movec: mode is 0 or 1, not 2"),
    ("stopj(0)", "stopj: a is a number above 0, not 0"),
    ("stopj(-4)", "stopj: a is a number above 0, not -4"),
    ("stopl(-1)", "stopl: a is"),
    ("stopl(1, 0)", "stopl: aRot is"),
    ("stop_conveyor_tracking(0)", "stop_conveyor_tracking: a is"),
    ("servoj(q, gain=99)", "servoj: gain is a number from 100 to 2000, not 99"),
    ("servoj(q, gain=2001)", "servoj: gain is"),
    ("servoj(q, lookahead_time=0.02)", "servoj: lookahead_time is a number from 0.03 to 0.2, not 0.02"),
    ("servoj(q, 0, 0, 0.008, 1.0, 300)", "servoj: lookahead_time is"),
    ("servoj(q, t=-0.008)", "servoj: t is"),
    ("servoc(get_actual_tcp_pose(), v=0)", "servoc: v is"),
    ("set_payload(-1)", "set_payload: m is a number from 0 to 10, not -1"),
    ("set_payload(1e300)", "set_payload: m is a number from 0 to 10, not 1e.300"),
    ("set_payload(10.1)", "set_payload: m is"),
    ("set_payload(1, [0, 0])", "set_payload: cog is a list of 3 numbers"),
    ("set_payload_mass(-0.5)", "set_payload_mass: m is"),
    ("set_target_payload(1, [0, 0, 0], [-1, 0, 0, 0, 0, 0])", "inertia's beginning .* of 0 or more, not .-1, 0, 0."),
    ("set_target_payload(1, [0, 0, 0], [0, 0, 0, 0, 0, 134])", "each a number from -133 to 133"),
    ("write_output_integer_register(0, 1.5)", "value is an integer from -2147483648 to 2147483647, not 1.5"),
    ("write_output_integer_register(0, 2147483648)", "value is an integer .* not 2147483648"),
    ("write_output_integer_register(0, True)", "value is an integer .* not True"),
    ("write_output_integer_register(48, 1)", "no channel 48; 0 … 47 exist"),
    ("write_output_integer_register(-1, 1)", "no channel -1; 0 … 47 exist"),
    ("write_output_float_register(48, 1)", "no channel 48"),
    ("write_output_float_register(0, 'x')", "value is a number, not 'x'"),
    ("write_output_boolean_register(128, True)", "no channel 128; 0 … 127 exist"),
    ("read_input_integer_register(48)", "no channel 48"),
    ("write_port_register(0, 65536)", "value is an integer from -32768 to 65535, not 65536"),
    ("write_port_register(65536, 0)", "no channel 65536"),
    ("set_standard_analog_out(0, 1.01)", "f is a number from 0 to 1, not 1.01"),
    ("set_tool_voltage(False)", "voltage is 0, 12 or 24, not False"),
    ("position_deviation_warning(True, 0)", "threshold is a number above 0 and at most 1, not 0"),
    ("rtde_set_watchdog('input_int_register_0', -1)", "min_frequency is a number of 0 or more"),
    ("rtde_set_watchdog('input_int_register_0', 10, 'dance')", "action is 'ignore', 'pause' or 'stop', not 'dance'"),
    ("rtde_set_watchdog('input_int_register', 10)", "RTDE has no input 'input_int_register'"),
    ("force_mode(p[0,0,0,0,0,0], [0,0,2,0,0,0], [0,0,0,0,0,0], 2, [1,1,1,1,1,1])", "each 0 or 1"),
    ("force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,0,0,0,0], 4, [1,1,1,1,1,1])", "type is 1, 2 or 3, not 4"),
    ("force_mode_set_damping(1.1)", "damping is a number from 0 to 1"),
    ("modbus_set_signal_update_frequency('x', 126)", "update_frequency is an integer from 0 to 125"),
    ("socket_send_byte(256)", "value is an integer from 0 to 255"),
    ("x = socket_read_byte_list(31)", "number is an integer from 1 to 30, not 31"),
    ("socket_open('127.0.0.1', 65536)", "port is an integer from 0 to 65535"),
    ("x = acos(1.1)", "acos: x is a number from -1 to 1"),
    ("x = sqrt(-1)", "sqrt: x is a number of 0 or more, not -1"),
    ("x = log(1, 5)", "log: base is a number other than 1"),
    ("x = pow(10, 400)", "10 to the power of 400 is no finite number"),
    ("x = pow(-1, 0.5)", "-1 to the power of 0.5 is no finite number"),
    ("x = to_num('1e999')", "'1e999' is no number"),
    ("x = to_num('nan')", "'nan' is no number"),
    ("x = to_num('1_000')", "'1_000' is no number"),
    ("x = get_list_length('abc')", "get_list_length: obj is a list, not abc"),
    ("x = length(5)", "length: obj is a list or a string, not 5"),
    ("x = 1e308 * 10\nsleep(x)", "sleep: t is a number of 0 or more, not inf"),
])  # fmt: skip
def test_what_the_manual_does_not_allow_ends_the_program_before_anything_moves(robot, call, said):
    before = list(robot.controller.arm.target_q)
    assert answer(robot, call)[0] == "error"
    assert re.search(said, robot.errors[-1])
    assert "(line " in robot.errors[-1]
    assert robot.controller.arm.target_q == before


@pytest.mark.parametrize("call", [
    "sleep(0)", "speedj([0, 0, 0, 0, 0, 0.1], 1, 0)", "speedj([0, 0, 0, 0, 0, 0], 0, 0.008)",
    "movej(q, a=0, v=-1, t=0.1)",
    "movel(get_actual_tcp_pose(), 0, 0, 1)", "freedrive_mode([1,0,0,0,0,0], 'tool')",
    "servoj(q, -1, 0, 0, 0.03, 100)", "servoj(q, lookahead_time=0.2, gain=2000)", "servoj(q, t=0)",
    "set_payload(0)", "set_payload(10, [0, 0, 0.1])", "write_output_integer_register(47, -2147483648)",
    "write_output_integer_register(0, 2147483647)", "write_output_integer_register(0, 4 / 2)",
    "write_output_boolean_register(127, True)", "write_port_register(0, -32768)", "write_port_register(0, 65535)",
    "set_standard_analog_out(1, 1)", "rtde_set_watchdog('input_double_register_0', 0)",
    "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,0,0,0,0], 1, [1,1,1,1,1,1])",
    "x = socket_read_line(timeout=-1)", "x = pow(-2, 3)", "x = to_num(' -2.5e1 ')", "x = to_num('0x1F')",
])  # fmt: skip
def test_what_the_manual_allows_goes_through_to_its_last_value(robot, call):
    assert answer(robot, call) == ("text", "on")


@pytest.mark.parametrize("call", ["speedj([0, 0, 0, 0, 0, 0])", "speedl([0, 0, 0, 0, 0, 0])", "stopj()", "stopl()"])
def test_an_acceleration_without_a_default_must_be_given(robot, call):
    with pytest.raises(ScriptError, match="missing a required argument: 'a'"):
        robot.compile(call)


def test_registers_of_the_upper_half_came_with_software_3_9(new_robot):
    robot = new_robot(version=(3, 8, 0, 1))
    assert answer(robot, "write_output_integer_register(23, 1)") == ("text", "on")
    answer(robot, "write_output_integer_register(24, 1)")
    assert "no channel 24; 0 … 23 exist" in robot.errors[-1]
    answer(robot, "x = read_input_boolean_register(64)")
    assert "no channel 64; 0 … 63 exist" in robot.errors[-1]
    answer(robot, "rtde_set_watchdog('input_int_register_24', 10)")
    assert "RTDE has no input" in robot.errors[-1]
