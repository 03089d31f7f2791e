"""URScript's sockets: what programs send and read, on the controller's clock, over real connections of this machine."""

import contextlib
import socket
import struct

import pytest

from hrcneuro.ur10.sockets import Sockets


@pytest.fixture
def peer():
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(5.0)
        yield server


@pytest.fixture
def talk(robot, peer):
    """Run a program that opens a socket; return what it wrote, and what the other side was sent."""
    links = []

    def run(body, data=b"", *, close=False, seconds=1.0):
        port = peer.getsockname()[1]
        robot.controller.start(robot.compile(f'def p():\nsocket_open("127.0.0.1", {port})\n{body}\nend\n'))
        robot.wait(0.03)
        link, _ = peer.accept()
        links.append(link)
        link.sendall(data)
        if close:
            link.shutdown(socket.SHUT_WR)
        link.settimeout(0.2)
        robot.wait(seconds)
        received = b""
        with contextlib.suppress(OSError):
            while piece := link.recv(1000):
                received += piece
        return [text for kind, text in robot.log if kind == "text"], received

    yield run
    for link in links:
        link.close()


@pytest.mark.parametrize(("read", "data", "answer"), [
    ("socket_read_binary_integer(2)", struct.pack(">ii", -5, 7), "[2, -5, 7]"),
    ("socket_read_binary_integer(2, timeout=0.2)", b"\0\0\0\1", "[0, -1, -1]"),
    ("socket_read_byte_list(3)", b"abc", "[3, 97, 98, 99]"),
    ("socket_read_ascii_float(3)", b"xx ( 1.5 , -2, 3e1 )", "[3, 1.5, -2, 30]"),
    ("socket_read_ascii_float(2, timeout=0.2)", b"(1, 2, 3)", "[0, nan, nan]"),
    ("socket_read_line()", b"one\r\ntwo\n", "one"),
    ("socket_read_line(timeout=0.2)", b"no end", ""),
    ("socket_read_string()", b"all of it", "all of it"),
    ("socket_read_string(prefix='>', suffix='<')", b"..>in<out", "in"),
    ("socket_read_string(suffix='\\n', interpret_escape=True)", b"a line\nmore", "a line"),
    ("socket_get_var('POS')", b"POS 42\n", "42"),
])  # fmt: skip
def test_what_is_read(talk, read, data, answer):
    said, _ = talk(f"textmsg('got ', {read})", data)
    assert said == [f"got {answer}"]


def test_what_is_sent(talk):
    body = """ok = socket_send_byte(2) and socket_send_int(-1)
ok = ok and socket_send_string("a") and socket_send_line([1, True])
socket_set_var("X", 7)
socket_close()
textmsg(ok, socket_send_byte(1))"""
    said, received = talk(body)
    assert said == ["TrueFalse"]
    assert received == b"\x02\xff\xff\xff\xffa[1, True]\nSET X 7\n"


def test_what_is_left_of_a_message_is_read_next(talk):
    said, _ = talk("textmsg(socket_read_line(), socket_read_byte_list(2))", b"first\nab")
    assert said == ["first[2, 97, 98]"]


def test_a_read_without_end_ends_where_the_other_side_hangs_up(talk):
    said, _ = talk('textmsg(socket_read_binary_integer(1, "socket_0", 0))', close=True)
    assert said == ["[0, -1]"]


def test_connections_end_with_the_program(talk, robot):
    _, received = talk("sleep(0.1)")
    assert received == b"", "the other side sees the end"
    assert robot.controller.program is None


def test_nobody_there_is_false_and_the_program_goes_on(robot):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    said = robot.run(f'def p():\ntextmsg("opened ", socket_open("127.0.0.1", {port}))\nend\n')
    assert said[-1] == "opened False"


def test_other_machines_are_reached_only_where_that_is_allowed(robot):
    assert robot.run('def p():\ntextmsg(socket_open("192.0.2.1", 80))\nend\n')[-1] == "False"
    with pytest.raises(OSError, match="not an address of this machine"):
        Sockets().open("a", "192.0.2.1", 80)
    for address in ("example", "127.0.0.1; x", "::1"):
        with pytest.raises(ValueError):
            Sockets(anywhere=True).open("a", address, 80)


def test_sockets_have_a_number(robot, peer):
    port = peer.getsockname()[1]
    opened = "".join(f'textmsg(socket_open("127.0.0.1", {port}, "s{i}"))\n' for i in range(33))
    said = robot.run(f"def p():\n{opened}end\n")
    assert (said.count("True"), said[-1]) == (32, "False")


def test_a_connection_takes_a_cycle_but_for_a_secondary_program(robot, peer):
    opened = f'textmsg(socket_open("127.0.0.1", {peer.getsockname()[1]}, "NAME"))\n'
    program = "def p():\n" + opened.replace("NAME", "a") + opened.replace("NAME", "b") + "end\n"
    robot.controller.start(robot.compile(program))
    said = []
    for _ in range(3):
        robot.controller.cycle()
        said.append(sum(text == "True" for _, text in robot.log))
    assert said == [0, 1, 2]
    robot.controller.start(robot.compile("sec s():\n" + opened.replace("NAME", "c") + 'socket_close("c")\nend\n'))
    robot.controller.cycle()
    assert robot.log[-1] == ("text", "True")


def test_who_reads_on_and_on_does_not_use_too_much_time(talk, robot):
    talk("while True:\nx = socket_read_byte_list(1)\nend", b"x" * 60_000, seconds=2.0)
    assert robot.controller.program is not None
    assert not robot.errors
    robot.controller.stop_program()


def test_one_that_waits_for_the_network_keeps_nobody_out_of_a_critical_section(talk):
    body = """global n = 0
thread t():
  while True:
    enter_critical
    n = n + 1
    sync()
    exit_critical
  end
end
run t()
enter_critical
x = socket_read_line(timeout=0.4)
m = n
sleep(0.1)
textmsg(m > 40, n - m)
exit_critical"""
    said, _ = talk(body)
    assert said == ["True0"]
