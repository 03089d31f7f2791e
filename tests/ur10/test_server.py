"""The controller on real sockets, from outside."""

import os
import random
import signal
import socket
import struct
import subprocess
import sys

import numpy as np
import pytest
from ur10_robot import Served, new_address

Q, QD, POSE, SAFETY, PROGRAM = slice(31, 37), slice(37, 43), slice(55, 61), 101, 131
PORTS = (29999, 30001, 30002, 30003, 30004)


def test_speed_lines_move_the_arm_and_silence_stops_it(shared, stream):
    packets = stream(shared)
    packets.packet()
    packets.link.sendall(b"speedj([0,0,0.2,0,0,0],5,0.1)\n")
    packets.until(lambda p: abs(p[QD][2] - 0.2) < 0.01 and p[PROGRAM] == 2.0)
    packets.until(lambda p: max(map(abs, p[QD])) < 1e-4 and p[PROGRAM] == 1.0)


def test_all_script_ports_take_programs(shared, stream):
    packets = stream(shared)
    for port, bit in ((30001, 1), (30002, 2), (30003, 4)):
        with shared.connect(port) as link:
            link.sendall(f"set_standard_digital_out({bit}, True)\n".encode())
            packets.until(lambda p, bit=bit: int(p[130]) >> bit & 1)


def test_the_secondary_port_speaks_first_of_its_version(shared):
    with shared.connect(30002) as link:
        head = link.recv(4096)
    assert head[4] == 20
    assert b"URControl" in head


def test_a_wrong_program_is_reported_on_the_primary_port(shared):
    with shared.connect(30001) as link:
        link.sendall(b"def f():\n fly()\nend\n")
        text = b""
        while b"no function 'fly'" not in text:
            text += link.recv(65536)


def test_what_does_not_speak_the_protocols_is_survived(shared, stream):
    noise = random.Random(7)
    for port in PORTS * 4:
        with shared.connect(port) as link:
            try:
                for _ in range(5):
                    link.sendall(noise.randbytes(noise.randint(1, 3000)))
            except OSError:
                pass  # it hung up, as it may
    with shared.connect(30004) as link:
        link.sendall(struct.pack(">HB", 2, ord("V")))
        assert link.recv(10) == b"", "a package shorter than its header closes the connection"
    with shared.connect(30004) as link:
        link.sendall(struct.pack(">HBH", 5, ord("V"), 2))
        assert link.recv(10) == b"\0\4V\1"
    first = stream(shared).packet()
    assert first[PROGRAM] == 1.0
    assert shared.process.poll() is None


def test_a_client_that_does_not_read_holds_nobody_up(shared, stream):
    with shared.connect(30003):
        packets = stream(shared)
        times = [packets.packet()[0] for _ in range(250)]
    np.testing.assert_allclose(np.diff(times), 0.008, atol=1e-9)


def test_faults_are_brought_about_on_their_port(served, stream):
    one = served("--fault", "slider=0.7")
    packets = stream(one)
    packets.until(lambda p: p[117] == 0.7)
    one.fault("drop=0.5", "slider=0.4")
    packets.until(lambda p: p[117] == 0.4)
    times = [packets.packet()[0] for _ in range(20)]
    np.testing.assert_allclose(np.diff(times), 0.016, atol=1e-9)
    assert one.ask("dance", port=29998)[0].startswith("error: no fault 'dance'")
    one.fault("protective_stop")
    packets.until(lambda p: p[SAFETY] == 3.0)
    one.fault("cut")
    with pytest.raises((AssertionError, OSError)):
        packets.until(lambda p: False)


def test_power_comes_with_the_brakes_released(served, stream):
    one = served("--power-off")
    assert one.ask("robotmode", "brake release") == ["Robotmode: POWER_OFF", "Brake releasing"]
    stream(one).until(lambda p: p[94] == 7.0)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_it_in_order(number):
    one = Served()
    with one.connect(30003):
        one.process.send_signal(number)
        assert one.process.wait(10) == 0
    one.process.stdin.close()
    one.process.stdout.close()
    with pytest.raises(OSError):
        socket.create_connection((one.address, 30004), 1.0)


@pytest.mark.parametrize(("arguments", "code", "part"), [
    (["--address", "192.168.0.7"], 2, "can be reached from outside"),
    (["--address", "robot"], 2, "no IPv4 address"),
    (["--software", "5.11.0.1"], 2, "no CB3 software"),
    (["--software", "3"], 2, "no CB3 software"),
    (["--software", "3.4"], 2, "3.5 or later"),
    (["--software", "3.9.x"], 2, "give 3.9,"),
    (["--software", "3.15.8.1.2"], 2, "no CB3 software"),
    (["--fault", "drops=1"], 2, "did you mean 'drop'"),
    (["--programs", __file__ + ".none"], 2, "No such file"),
    (["--programs", ""], 2, "an empty name is no folder"),
    (["--programs", __file__], 2, "Not a directory"),
])  # fmt: skip
def test_bad_arguments_are_refused(arguments, code, part):
    done = subprocess.run([sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", new_address(), *arguments],
                          capture_output=True, text=True, timeout=30)  # fmt: skip
    assert (done.returncode, part in done.stderr) == (code, True), done.stderr


def test_a_short_version_is_one_too(served):
    one = served("--software", "3.15")
    assert one.ask("PolyscopeVersion") == ["URSoftware 3.15.0.0 (Jan 01 2019)"]


def test_a_taken_address_is_an_error_with_a_cure(shared):
    done = subprocess.run([sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", shared.address],
                          capture_output=True, text=True, timeout=30)  # fmt: skip
    assert done.returncode == 4
    assert "cannot listen" in done.stderr
    assert "cure:" in done.stderr


def test_it_runs_before_the_machines_other_work_where_that_is_allowed(shared):
    allowed = subprocess.run(
        [sys.executable, "-c", "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))"], check=False,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    if allowed.returncode:
        pytest.skip("this account may not")
    assert os.sched_getscheduler(shared.process.pid) == os.SCHED_FIFO


def test_the_lateness_of_cycles_is_told_in_the_end():
    from hrcneuro.ur10.punctuality import Punctuality

    one = Punctuality()
    for late in [1e-4] * 98 + [2e-3, 5.0]:
        one.add(late)
    assert [one.quantile(share) for share in (0.5, 0.99, 1.0)] == pytest.approx([1.5e-4, 2.05e-3, 5.0])
    assert str(one) == "100 cycles, 0 skipped; late by 0.15 (median), 2.05 (p99), 5000.00 (most) ms"
    address = new_address()
    done = subprocess.run(
        [sys.executable, "-m", "hrcneuro", "ur10", "serve", "--address", address, "--verbose", "--until-stdin-closes"],
        input=b"", capture_output=True, timeout=30,
    )  # fmt: skip
    assert b"cycles, 0 skipped; late by" in done.stderr


def test_scripts_arrive_in_pieces_with_a_byte_order_mark_and_comments(shared, stream):
    packets = stream(shared)
    script = "\ufeff# Grüße\r\nsec s():\r\n  set_standard_digital_out(5, True)\r\nend\r\n".encode()
    with shared.connect(30002) as link:
        for byte in script:
            link.sendall(bytes([byte]))
        packets.until(lambda p: int(p[130]) >> 5 & 1)


def test_what_a_program_tells_of_itself_comes_on_the_primary_port(shared):
    with shared.connect(30001) as link:
        link.sendall(b'def named():\n $ 3 "a label"\n textmsg(1, 2)\nend\n')
        said = b""
        while b"PROGRAM_XXX_STOPPEDnamed" not in said:
            said += link.recv(65536)
    assert said.index(b"PROGRAM_XXX_STARTEDnamed") < said.index(b"a label") < said.index(b"12")
