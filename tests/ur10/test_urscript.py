"""URScript: the language as programs use it, and what is refused."""

import contextlib
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.ur10.urscript.lexer import ScriptError, Splitter

LANGUAGE = {
    "arithmetic": ("textmsg(1 + 2 * 3 - 8 / 4)", "5"),
    "precedence": ("textmsg(not False and True or False)", "True"),
    "xor": ("textmsg(True xor True)", "False"),
    "unary": ("textmsg(-2 + +3)", "1"),
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
    ("x = 1 @ 2", "unexpected character '@'"),
    ("x = " + "(" * 3000 + "1" + ")" * 3000, "too deeply nested"),
    ("if True:\n" * 200 + "textmsg(1)\n" + "end\n" * 200, "too deeply nested"),
])  # fmt: skip
def test_a_wrong_program_is_refused_with_its_line(robot, script, part):
    with pytest.raises(ScriptError, match=part.replace("'", ".")):
        robot.compile(script)


@pytest.mark.parametrize(("script", "part"), [
    ("x = [1, 2]\ntextmsg(x[5])", "IndexError"),
    ("textmsg(1 / 0)", "ZeroDivisionError"),
    ("def f():\n if False:\n x = 1\n end\n return x\nend\nf()", "before it has a value"),
    ("movej([1, 2, 3])", "expected six numbers"),
    ("movej([0, 0, 9, 0, 0, 0])", "beyond ±360°"),
    ("movel(p[5, 0, 0, 0, 0, 0], v=2)", "Protective stop"),
    ("set_digital_out(40, True)", "no channel 40"),
    ("def f():\n f()\nend\nf()", "RecursionError"),
    ("get_inverse_kin(p[5, 0, 0, 0, 0, 0])", "out of reach"),
])  # fmt: skip
def test_a_program_that_goes_wrong_ends_and_is_reported(robot, script, part):
    robot.run(f"def program():\n{script}\nend\n", seconds=2.0)
    assert re.search(part, robot.errors[-1])


def test_a_script_cannot_reach_python(robot):
    for script in ("__import__('os')", "textmsg(rt)", "textmsg(program)", "x = [1]\ntextmsg(x.__class__)", "b_movej()"):
        with pytest.raises(ScriptError):
            robot.compile(script)


@given(st.text("def sec end if while thread x1 \n:()[]=+#'\"p,.", max_size=60))
@settings(max_examples=300)
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
    monkeypatch.setattr(Splitter, "LIMIT", 1000)
    with pytest.raises(ScriptError, match="more than 1000"):
        Splitter().feed("def f():\n" + "x = 1\n" * 200)
