"""Clients and programs that mean harm: the controller goes on, in bounded time and memory."""

import contextlib
import random
import re
import socket
import struct
import threading
import time
from pathlib import Path

import pytest

# Each would take all time or memory if nothing bounded it.
HOSTILE = {
    "a loop without sync": "while True:\nx = 1\nend",
    "powers": "x = 3\nwhile True:\nx = x * x\nend",
    "doubling": "x = 3\nwhile True:\nx = x + x\nend",
    "repetition": "x = [1, 2] * 1000000000",
    "a text's repetition": "x = 'a' * 1000000000",
    "a list's doubling": "x = [1]\nwhile True:\nx = x + x\nend",
    "a text's doubling": "x = 'a'\nwhile True:\nx = str_cat(x, x)\nend",
    "a format": "x = '%1000000000d' % 5",
    "nesting": "x = [1, 2]\nwhile True:\nx = [x, x]\nend",
    "a list in itself": "x = [1, 2]\ni = 0\nwhile i < 64:\nx[0] = x\nx[1] = x\ni = i + 1\nend\ntextmsg(x)",
    "calls of calls": "def f(n):\nif n > 0:\nf(n - 1)\nf(n - 1)\nend\nend\nf(60)",
    "kinematics": "while True:\nq = get_inverse_kin(get_actual_tcp_pose())\nend",
    "threads": (
        "thread t():\nwhile True:\nx = 1\nend\nend\n"
        "i = 0\nwhile i < 45:\nrun t()\ni = i + 1\nend\nwhile True:\nx = 1\nend"
    ),
    "threads of threads": "thread t():\nrun t()\nrun t()\nsync()\nend\nrun t()\nsleep(9)",
    "a script without end": "x = 1\n" * 20_000,
    "messages": "while True:\ntextmsg('abc')\nend",
    "a long sleep": "sleep(1e300)",
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_program_takes_its_share_of_a_cycle_only(robot, name):
    script = robot.compile(f"def program():\n{HOSTILE[name]}\nend\n")
    robot.controller.start(script)
    longest = 0.0
    for _ in range(30):
        begin = time.process_time()
        robot.controller.cycle()
        longest = max(longest, time.process_time() - begin)
    # Much more than it takes, much less than it would.
    assert longest < 0.25


@pytest.mark.parametrize("waits", ["sync()", "sleep(0.01)", "speedj([0, 0, 0, 0, 0, 0.1], 1, 0.008)"])
@pytest.mark.parametrize("where", ["program", "thread"])
def test_who_computes_for_a_second_without_waiting_ends_the_program(new_robot, where, waits):
    loop = "while True:\nx = 1\n{}end\n"
    scripts = {
        "program": f"def program():\n{loop}end\n",
        "thread": f"def program():\nthread other():\n{loop}end\nrun other()\nwhile True:\nsync()\nend\nend\n",
    }
    polite, robot = new_robot(), new_robot()
    polite.run(scripts[where].format(f"{waits}\n"), seconds=3.0)
    assert polite.controller.program is not None
    assert not polite.errors
    robot.run(scripts[where].format(""), seconds=0.95)
    assert robot.controller.program is not None
    robot.wait(0.1)
    assert robot.controller.program is None
    assert re.search(r"used too much time .* sync\(\) or sleep\(\) .*\(line \d", robot.errors[-1])


def test_secondary_programs_have_one_cycle_each_and_a_few_have_a_cycle(robot):
    script = robot.compile("sec s():\nwhile True:\nx = 1\nend\nend\n")
    for _ in range(100):
        robot.controller.start(script)
    robot.controller.cycle()
    assert len(robot.errors) == 10
    robot.wait(1.0)
    assert len(robot.errors) == 100
    assert all("Runtime is too much behind" in error for error in robot.errors)


def flood(one, port, data, most=3.0):
    """Send all of ``data``, or as much as is taken in ``most`` seconds."""
    with contextlib.suppress(OSError), one.connect(port) as link:
        link.settimeout(most)
        link.sendall(data)
        link.shutdown(socket.SHUT_WR)
        deadline = time.monotonic() + most
        while time.monotonic() < deadline and link.recv(1 << 16):
            pass


def memory(one):
    return int(Path(f"/proc/{one.process.pid}/statm").read_text().split()[1]) * 4096


def test_floods_are_survived(served, stream):
    one = served()
    packets = stream(one)
    before, begin = memory(one), packets.newest()[0]
    noise = random.Random(3)
    lines = b"".join(
        b"set_digital_out(%d, %s)\n" % (i % 8, noise.choice((b"True", b"False", b"x"))) for i in range(9999)
    )
    floods = [
        (29999, b"\n" * 1_000_000), (29999, b"popup x\nplay\nload y\n" * 20_000), (29999, b"x" * 1_000_000),
        (30001, b"x" * 1_000_000), (30002, b"def f():\n" * 50_000), (30003, lines), (30003, noise.randbytes(500_000)),
        (30004, b"\0\3x" * 200_000), (30004, struct.pack(">HB", 65535, 86) + bytes(1_000_000)),
        (30004, b"\0\5V\0\2" * 100_000), (29998, b"slider=1\n" * 50_000),
        (30004, b"\0\5V\0\2" + (b"\0\x18I" + b"input_int_register_7,") * 20_000),
    ]  # fmt: skip
    threads = [threading.Thread(target=flood, args=(one, *what)) for what in floods]
    for thread in threads:
        thread.start()
    seen = 0
    while any(thread.is_alive() for thread in threads):
        packets.packet()
        seen += 1
    for thread in threads:
        thread.join()
    assert one.process.poll() is None
    answers_again(one)
    assert packets.newest()[0] - begin > 0.1
    assert memory(one) - before < 100e6
    assert seen > 10, "the stream goes on during a flood"


def test_more_clients_than_a_port_takes_are_refused_and_the_others_stay(served):
    one = served()
    links = []
    for _ in range(40):
        with contextlib.suppress(OSError):
            links.append(socket.create_connection((one.address, 29999), 5.0))
    welcomed = 0
    for link in links:
        link.settimeout(5.0)
        with contextlib.suppress(OSError):
            welcomed += link.recv(100).startswith(b"Connected")
    assert welcomed == 32
    for link in links:
        link.close()
    answers_again(one)


def answers_again(one):
    """Wait until clients that left count no more, and the dashboard answers a new one."""
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError):
            if one.ask("robotmode") == ["Robotmode: RUNNING"]:
                return
    raise AssertionError("the dashboard does not answer")


def test_mutated_packets_are_survived(served, stream):
    """What clients really send, with bytes changed, left out and doubled."""
    one = served()
    packets = stream(one)
    good = {
        30004: b"\0\5V\0\2\0\3v" + b"\0\x1eO" + struct.pack(">d", 125.0) + b"timestamp,actual_q" + b"\0\3S"
        + b"\0\x17I" + b"input_int_register_7" + b"\0\x08U\1\0\0\0\5" + b"\0\3P",
        30003: b"def f():\n movej([0.1, 2, 3e-1, 0, 0, 0], a=1)\n x = p[1,2,3,4,5,6]\n textmsg(x[2])\nend\n",
        29999: b"robotmode\nload x.urp\nplay\npopup hello\nsafetymode\n",
    }  # fmt: skip
    source = random.Random(11)
    for _ in range(150):
        port = source.choice(list(good))
        data = bytearray(good[port])
        for _ in range(source.randint(1, 6)):
            at = source.randrange(len(data))
            kind = source.randrange(3)
            if kind == 0:
                data[at] = source.randrange(256)
            elif kind == 1:
                del data[at : at + source.randint(1, 8)]
            else:
                data[at:at] = data[max(0, at - 8) : at]
            data = data or bytearray(b"x")
        with contextlib.suppress(OSError), one.connect(port) as link:
            link.sendall(data)
    assert one.process.poll() is None
    answers_again(one)
    packets.newest()
