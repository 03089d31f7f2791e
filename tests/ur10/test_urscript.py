"""URScript: the language as programs use it, and what is refused."""

import contextlib
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ur10_robot import Robot

from hrcneuro.ur10.urscript.lexer import ScriptError, Splitter

LANGUAGE = {
    "arithmetic": ("textmsg(1 + 2 * 3 - 8 / 4)", "5"),
    "precedence": ("textmsg(not False and True or False)", "True"),
    "xor": ("textmsg(True xor True)", "False"),
    "unary": ("textmsg(-2 + +3)", "1"),
    "an integer of more than 32 bits is a float": (
        "x = 2147483648\ny = 0xFFFFFFFF\ntextmsg(x - 1 == 2147483647, y)\nif x:\n textmsg(to_str(-2147483648))\nend",
        "-2147483648"),
    "leading zeros": ("textmsg(007)", "7"),
    "hexadecimal": ("textmsg(0x1F % 10)", "1"),
    "exponent": ("textmsg(1e-3 < .01)", "True"),
    "strings": ("textmsg('a', \"b # c\")", "ab # c"),
    "list": ("x = [1, 2.5, True]\ntextmsg(x)", "[1, 2.5, True]"),
    "element": ("x = [1, 2]\nx[1] = x[0] + 4\ntextmsg(x[1])", "5"),
    "pose": ("x = p[1, 0, 0, 0, 0, 0]\nx[2] = 3\ntextmsg(x)", "p[1, 0, 3, 0, 0, 0]"),
    "lists are values": ("x = [1, 2]\ny = x\ny[0] = 9\ntextmsg(x)", "[1, 2]"),
    "if": ("if 1 > 2:\n textmsg(1)\nelif 2 > 1:\n textmsg(2)\nelse:\n textmsg(3)\nend", "2"),
    "while": (
        "i = 0\nwhile i < 5:\n i = i + 1\n if i == 2:\n continue\n end\n if i == 4:\n break\n end\nend\n"
        "textmsg(i)", "4"),
    "function": ("def f(a, b=2):\n return a * b\nend\ntextmsg(f(3) + f(3, b=4))", "18"),
    "late function": ("def f():\n return g()\nend\ndef g():\n return 7\nend\ntextmsg(f())", "7"),
    "arguments are values": ("def f(x):\n x[0] = 9\n return x\nend\ny = [1]\nz = f(y)\ntextmsg(y)", "[1]"),
    "globals": ("global n = 1\ndef f():\n n = n + 1\nend\nf()\nf()\ntextmsg(n)", "3"),
    "local hides global": ("global n = 1\ndef f():\n local n = 5\n return n\nend\nf()\ntextmsg(n)", "1"),
    "a variable named p": ("def f(p):\n p[0] = p[0] * 2\n return p\nend\ntextmsg(f([3])[0])", "6"),
    "names of Python": ("lambda = 1\nclass = 2\nasync = lambda + class\ntextmsg(async)", "3"),
    "comment in a statement": ("global x = # where to begin\n4\ntextmsg(x)", "4"),
    "statement behind a value": ("global x = # a comment\n4 textmsg(x)", "4"),
    "newline in a call": ("textmsg(1 +\n  1)", "2"),
    "thread": (
        "global n = 0\nthread t():\n while True:\n n = n + 1\n sync()\n end\nend\n"
        "h = run t()\nsleep(0.08)\nkill h\nm = n\nsleep(0.08)\ntextmsg(n - m)", "0"),
    "join": ("global n = 0\nthread t():\n sleep(0.1)\n n = 5\nend\njoin run t()\ntextmsg(n)", "5"),
    "critical section": (
        "global n = 0\nthread t():\n while True:\n n = n + 1\n sync()\n end\nend\nh = run t()\nsync()\n"
        "enter_critical\nm = n\nsleep(0.1)\ntextmsg(n - m)\nexit_critical\nkill h", "0"),
    "a loop without sync": ("i = 0\nwhile i < 9000:\n i = i + 1\nend\ntextmsg(i)", "9000"),
    "halt": ("textmsg(1)\nhalt\ntextmsg(2)", "1"),
    "poses": ("textmsg(pose_trans(p[1,0,0,0,0,0], p[0,2,0,0,0,0]))", "p[1, 2, 0, 0, 0, 0]"),
    "outputs of old": ("digital_out[2] = True\ntextmsg(get_digital_out(2))", "True"),
    "a list named as one": ("digital_out = [1, 2]\ndigital_out[0] = 5\ntextmsg(digital_out)", "[5, 2]"),
    "speedl until t_min": ("speedl([0, 0.05, 0, 0, 0, 0], a=1, t_min=0.1)\nstopl(1)\ntextmsg(is_steady())", "False"),
    "a label": ("$ 2 \"MoveJ\" \"noBreak\"\ntextmsg(1)", "1"),
    "an empty string as a condition": ("if '':\n textmsg(1)\nelse:\n textmsg(2)\nend", "2"),
    "a float as a condition": ("if 4 / 2:\n textmsg(1)\nend", "1"),
    "a negative number": ("x = 3\ntextmsg(-x - -2)", "-1"),
    "characters": ("textmsg(str_at('Hello', 1), str_sub('abcde', 2, 50))", "ecde"),
    "a part of length 0": ("textmsg(str_len(str_sub('abcde', 5)) + str_len(str_sub('abcde', 2, 0)))", "0"),
    "six decimals": ("textmsg(to_str(2.123456123456), to_num('10') + to_num('2.50'))", "2.12345612.5"),
    "flags": ("set_flag(31, True)\ntextmsg(get_flag(31), get_flag(0))", "TrueFalse"),
    "ports": ("write_port_register(3, 40000)\ntextmsg(read_port_register(3), read_port_bit(63))", "-25536True"),
    "the tool's old outputs": ("set_digital_out(8, True)\ntextmsg(get_tool_digital_out(0))", "True"),
    "domains": ("set_analog_outputdomain(1, 0)\nset_analog_out(1, 0.5)\ntextmsg(get_analog_out(1))", "0.012"),
    "a past": ("sleep(0.1)\ntextmsg(get_list_length(get_actual_joint_positions_history(10)))", "6"),
    "not, as the manual's example has it": ("if ! False:\n textmsg(1)\nend\ntextmsg(not ! True)", "True"),
    "an accelerometer": ("textmsg(get_tool_accelerometer_reading()[2] < -9.8)", "True"),
    "gravity": ("set_gravity([0, 0, 9.82])\ntextmsg(1)", "1"),
    "a simulated arm's place": ("set_pos([0, 0, 0, 0, 0, 0])\ntextmsg(get_actual_joint_positions()[2] > 1)", "True"),
    "turns": ("reset_revolution_counter()\nreset_revolution_counter(qNear=[0, 0, 0, 0, 0, 0])\ntextmsg(1)", "1"),
    "a conveyor of old": ("set_conveyor_tick_count(24543, 2)\ntextmsg(get_conveyor_tick_count())", "24543"),
    "a conveyor's pulses": ("conveyor_pulse_decode(2, 3)\nconveyor_pulse_decode(1, 0, 1)\ntextmsg(1)", "1"),
    "tracking": (
        "track_conveyor_linear(p[1, 0, 0, 0, 0, 0], 1000.0)\nstop_conveyor_tracking(a=15)\n"
        "track_conveyor_circular(p[0.5, 0.5, 0, 0, 0, 0], 500, True, 1)\nstop_conveyor_tracking()\ntextmsg(1)", "1"),
    "registers": ("write_output_integer_register(3, 7)\ntextmsg(read_output_integer_register(3))", "7"),
}  # fmt: skip


@pytest.mark.parametrize("name", LANGUAGE)
def test_the_language(robot, name):
    script, answer = LANGUAGE[name]
    assert robot.run(f"def program():\n{script}\nend\n")[-1:] == [answer], robot.errors
    assert robot.controller.program is None
    assert not robot.errors


@pytest.mark.parametrize(("script", "part"), [
    ("movej(", "line 1"),
    ("fly([1])", "no function 'fly'"),
    ("textmsg(x)", "no variable 'x'"),
    ("def f():\n textmsg(1)\n", "'end' is missing"),
    ("x = 3 4", "unexpected '4'"),
    ("break", "outside of a loop"),
    ("set_digital_out(1)", "missing a required argument: 'b'"),
    ("sleep(1, 2)", "too many positional arguments"),
    ("\nmovej([0, 0, 0, 0, 0, 0], z=1)", "line 2: movej.*unexpected keyword argument 'z'"),
    ("set_gravity()", "missing a required argument: 'd'"),
    ("y = 1\ndef f(a, b=1):\n return a\nend\nx = f()", "line 5: f.*missing a required argument: 'a'; it takes a, .b."),
    ("_label(1, 'x')", "no function '_label'"),
    ("$ MoveJ", "a label is an integer of 32 bits and a text"),
    ("$ 2147483648 'MoveJ'", "a label is an integer of 32 bits and a text"),
    ("\nx = 1e999", "line 2: 1e999 is beyond the greatest number, 1.8e308"),
    ("x = -1e400", "1e400 is beyond"),
    ("x = " + "9" * 5000, "9{40} is beyond"),
    ("x = 0x" + "F" * 300, "0xF{38} is beyond"),
    ("x = nan", "no variable 'nan'"),
    ("x = \u0663", "unexpected character"),
    ("x = 1 @ 2", "unexpected character '@'"),
    ("x = " + "(" * 3000 + "1" + ")" * 3000, "too deeply nested"),
    ("if True:\n" * 200 + "textmsg(1)\n" + "end\n" * 200, "too deeply nested"),
])  # fmt: skip
def test_a_wrong_program_is_refused_with_its_line(robot, script, part):
    with pytest.raises(ScriptError, match=part.replace("'", ".")):
        robot.compile(script)


@pytest.mark.parametrize(("script", "part"), [
    ("x = [1, 2]\ntextmsg(x[5])", "index out of range: 5, of 2"),
    ("x = [1, 2]\ntextmsg(x[0 - 1])", "index out of range: -1"),
    ("x = [1, 2]\nx[2] = 1", "index out of range: 2"),
    ("x = [1, 2]\ntextmsg(x[0.5])", "an index is an integer"),
    ("x = 5\ntextmsg(x[0])", "no elements in 5"),
    ("textmsg(str_at('abc', 3))", "index out of range: 3"),
    ("textmsg(str_at('', 0))", "index out of range: 0"),
    ("textmsg(str_sub('abc', -1))", "index out of range: -1"),
    ("textmsg(str_sub('abc', 1, -1))", "index out of range: -1"),
    ("textmsg(to_num('123abc'))", "is no number"),
    ("x = 'a'\nwhile True:\n x = str_cat(x, x)\nend", "more than 1023 characters"),
    ("if 1:\n textmsg(1)\nend", "type error: a condition is True or False, not 1"),
    ("while [True]:\n sync()\nend", "type error: a condition is True or False, not a list"),
    ("if False:\nelif 0:\n textmsg(1)\nend", "type error"),
    ("x = not 0", "type error: expected True or False, got 0"),
    ("x = True and 1", "type error"),
    ("x = 1 or True", "type error"),
    ("x = 'a' xor True", "type error"),
    ("set_flag(32, True)", "no channel 32"),
    ("set_digital_out(0, 1)", "type error"),
    ("set_digital_out(10, True)", "no channel 10"),
    ("set_tool_voltage(5)", "voltage is 0, 12 or 24, not 5"),
    ("get_joint_temp(6)", "no channel 6; 0 … 5"),
    ("set_standard_digital_input_action(0, 'dance')", "'default' or 'freedrive', not 'dance'"),
    ("modbus_set_output_signal('x', True)", "no Modbus signal 'x'"),
    ("modbus_add_signal('127.0.0.1', 255, 0, 0, 'x')\nmodbus_get_signal_status('x')", "no device answers"),
    ("modbus_add_signal('127.0.0.1', 255, 0, 7, 'x')", "signal_type is 0, 1, 2, 3, 15 or 16, not 7"),
    ("x = [1, 2] + [3, 4]", "before software 3.14"),
    ("x = 1\nx = 2\ntextmsg(1 / 0)", "line 4"),
    ("textmsg(1 / 0)", "division by zero"),
    ("textmsg(1 % 0)", "division by zero"),
    ("x = 1 < [1]", "type error: only numbers are less or greater, not a list"),
    ("x = True < 2", "type error: only numbers are less or greater, not True"),
    ("x = 'a' >= 'b'", "type error: only numbers are less or greater, not 'a'"),
    ("def f():\n if False:\n x = 1\n end\n return x\nend\nf()", "before it has a value"),
    ("movej([1, 2, 3])", "movej: q is a list of 6 numbers, not .1, 2, 3."),
    ("x = True + 1", "type error: no arithmetic with True"),
    ("x = 2 * False", "type error: no arithmetic with False"),
    ("x = -True", "type error: no arithmetic with True"),
    ("x = 7 % True", "type error: no arithmetic with True"),
    ("set_gravity([0, 0])", "d is a list of 3 numbers, not .0, 0."),
    ("set_gravity([0, 0, True])", "a list of 3 numbers"),
    ("set_pos([0, 1])", "a list of 6 numbers"),
    ("reset_revolution_counter([0])", "qNear is a list of 6 numbers"),
    ("position_deviation_warning(1)", "enabled is True or False, not 1"),
    ("position_deviation_warning(True, 1.5)", "threshold is a number above 0 and at most 1, not 1.5"),
    ("conveyor_pulse_decode(5, 0, 1)", "no channel 5; 0 … 4"),
    ("conveyor_pulse_decode(1, 0, 4)", "no channel 4; 0 … 3"),
    ("encoder_enable_set_tick_count(2, 0)", "no channel 2; 0 … 1"),
    ("encoder_set_tick_count(0, 1)", "encoder 0 is not enabled"),
    ("x = encoder_unwind_delta_tick_count(1, 5)", "encoder 1 is not enabled"),
    ("encoder_enable_set_tick_count(0, 1)\nencoder_set_tick_count(0, 256)", "no tick count 256: 0 … 255"),
    ("encoder_enable_set_tick_count(0, 1)\nencoder_set_tick_count(0, 1.5)", "a tick count is an integer, not 1.5"),
    ("track_conveyor_linear([1, 0, 0, 0, 0, 0], 1000)", "is a pose, not .1, 0"),
    ("track_conveyor_linear(p[1, 0, 0, 0, 0, 0], 0)", "other than 0 ticks"),
    ("rpc_factory('json', 'http://127.0.0.1/')", "xmlrpc is the only type, not json"),
    ("rpc_factory('xmlrpc', 'ftp://127.0.0.1/')", "http://ADDRESS:PORT/PATH is taken, not ftp"),
    ("x = 5\nx.look()", "5 has no functions"),
    ("movej([0, 0, 9, 0, 0, 0])", "beyond ±360°"),
    ("movel(p[5, 0, 0, 0, 0, 0], v=2)", "Protective stop"),
    ("set_digital_out(40, True)", "no channel 40"),
    ("def f():\n f()\nend\nf()", "too many calls within calls"),
    ("get_inverse_kin(p[5, 0, 0, 0, 0, 0])", "out of reach"),
])  # fmt: skip
def test_a_program_that_goes_wrong_ends_and_is_reported(robot, script, part):
    robot.run(f"def program():\n{script}\nend\n", seconds=2.0)
    assert re.search(part, robot.errors[-1])


@pytest.mark.parametrize(("expression", "answer"), [
    ("[1, 2] + [3, 4.5]", "[4, 6.5]"), ("[1, 2] - [3, 4]", "[-2, -2]"), ("2 * [1, 2]", "[2, 4]"),
    ("[1, 2] * 0.5", "[0.5, 1]"), ("[1, 2] / 2", "[0.5, 1]"), ("-[1, 2]", "[-1, -2]"),
])  # fmt: skip
def test_lists_compute_from_software_3_14_on(new_robot, expression, answer):
    robot = new_robot(version=(3, 14, 3, 1))
    assert robot.run(f"def program():\ntextmsg({expression})\nend\n") == [answer]


@pytest.mark.parametrize("expression", ["[1] + [1, 2]", "[1] + 1", "[1] * [1]", "p[1,0,0,0,0,0] * 2", "['a'] * 2"])
def test_lists_that_do_not_fit_are_errors(new_robot, expression):
    robot = new_robot(version=(3, 14, 3, 1))
    assert robot.run(f"def program():\ntextmsg({expression})\nend\n") == []
    assert "runtime error" in robot.errors[-1]


@given(st.sampled_from([(0, 2**32), (1, 2**8), (2, 2**16), (3, 2**24), (4, 2**32)]), st.data())
@settings(max_examples=30, deadline=None)
def test_a_way_over_the_end_of_an_encoder_s_range_is_unwound(kind, data):
    number, counts = kind
    way = data.draw(st.integers(1 - counts // 2, counts // 2 - 1))
    start = data.draw(st.integers(0, counts - 1))
    wrapped = (start + way) % counts - start
    robot = Robot()
    body = f"encoder_enable_set_tick_count(1, {number})\nx = encoder_unwind_delta_tick_count(1, {wrapped})\n"
    assert robot.run(f"def p():\n{body}textmsg(x == {way})\nend\n") == ["True"], robot.errors


def test_a_thread_that_waits_for_a_critical_section_gets_it(robot):
    """Two threads that hold the section over each cycle take turns; one that waits for the network keeps nobody out."""
    other = "thread other():\nwhile True:\nenter_critical\nn = n + 1\nsync()\nexit_critical\nend\nend\n"
    mine = "i = 0\nwhile i < 20:\nenter_critical\ni = i + 1\nsync()\nexit_critical\nend\n"
    said = robot.run(f"def program():\nglobal n = 0\n{other}run other()\n{mine}textmsg(n)\nend\n", seconds=2.0)
    assert 15 <= int(said[-1]) <= 25


@pytest.mark.parametrize("before", [0, 90, 97, 98, 99])
def test_what_a_loop_costs_does_not_hang_on_where_it_stands(robot, before):
    loop = "i = 0\nwhile i < 60:\ni = i + 1\nj = i\nend\n"
    robot.controller.start(robot.compile("def program():\n" + "x = 0\n" * before + f"{loop}end\n"))
    robot.wait(0.008)
    assert robot.controller.program is None


def test_others_run_beside_a_motion_in_a_critical_section(robot):
    """As UR's external control program needs it: its trajectory moves in a section, and the main thread cancels it."""
    mover = "thread mover():\nenter_critical\nspeedj([0, 0, 0, 0, 0, 0.1], 1, 5)\nexit_critical\nend\nh = run mover()\n"
    count = "i = 0\nwhile i < 20:\nenter_critical\ni = i + 1\nexit_critical\nsync()\nend\n"
    mine = f"{count}kill h\nstopj(5)\ntextmsg(i)\n"
    assert robot.run(f"def program():\n{mover}{mine}end\n", seconds=1.0) == ["20"]


def test_a_script_cannot_reach_python(robot):
    for script in ("__import__('os')", "textmsg(rt)", "textmsg(program)", "x = [1]\ntextmsg(x.__class__)", "b_movej()"):
        with pytest.raises(ScriptError):
            robot.compile(script)


@given(st.text("def sec end if while thread x1 \n:()[]=+#'\"p,.", max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_text_is_translated_or_refused(text):
    from hrcneuro.ur10.urscript.runtime import compiled

    with contextlib.suppress(ScriptError):
        compiled(text, frozenset(["textmsg"]), frozenset(["sync"]))


def test_the_splitter_waits_for_the_end_whatever_the_pieces(monkeypatch):
    script = 'def f():\n if True: # end end\n  textmsg("end")\n end\nend\n'
    for size in (1, 3, 7, 100):
        splitter, found = Splitter(), []
        for i in range(0, len(script), size):
            found += splitter.feed(script[i : i + size])
        assert found == [script]
    assert Splitter().feed("a()\n\nb()\nc(") == ["a()\n", "b()\n"]
    assert Splitter().feed("\ufeff# one\n  # two\n\t\nsec s():\n # in it\nend\n") == ["sec s():\n # in it\nend\n"]
    monkeypatch.setattr(Splitter, "LIMIT", 1000)
    with pytest.raises(ScriptError, match="more than 1000"):
        Splitter().feed("def f():\n" + "x = 1\n" * 200)
