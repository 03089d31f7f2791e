"""The drivers of hrcneuro against the controller: they follow, they refuse, and the arm stops when they die."""

import contextlib
import os
import re
import resource
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from ur10_robot import new_address

from hrcneuro.arms.clock import Stamps, WallClock
from hrcneuro.arms.dashboard import check_delay, check_ready
from hrcneuro.arms.script import ScriptArm
from hrcneuro.arms.ur import UrArm
from hrcneuro.arms.ursim import UrSim
from hrcneuro.errors import HardwareError
from hrcneuro.robot.backend import PERIOD

TARGET_QD, QD, SAFETY, PROGRAM = slice(7, 13), slice(37, 43), 101, 131
KINDS = ["script", "rtde"]


def connect(kind, host):
    if kind == "rtde":
        pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
        return UrArm(host, WallClock())
    return ScriptArm(host, WallClock())


def drive(arm, qd, cycles=60):
    clock = WallClock()
    begin = clock.now()
    for i in range(cycles):
        clock.wait_until(begin + i * PERIOD)
        arm.speed(qd)
    return arm.state()


@pytest.mark.parametrize("kind", KINDS)
def test_a_driver_moves_the_arm_and_stops_it(kind, served, stream):
    one = served()
    packets = stream(one)
    arm = connect(kind, one.address)
    try:
        before = packets.packet()
        arm.align()
        assert np.abs(packets.packet()[QD]).max() == 0.0, "nothing moves on connecting"
        state = drive(arm, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
        assert state.qd[2] == pytest.approx(0.1, abs=5e-3)
        assert (state.safety, state.runtime, state.scaling) == (1, 2, 1.0)
        assert state.q[2] > before[33]
        arm.stop(4.0)
        packets.until(lambda p: max(map(abs, p[QD])) < 1e-3)
        one.fault("slider=0.5")
        packets.until(lambda p: p[117] == 0.5)
        time.sleep(PERIOD)
        assert arm.state().scaling == 0.5
        one.fault("protective_stop")
        packets.until(lambda p: p[SAFETY] == 3.0)
        deadline = time.monotonic() + 2.0
        while arm.state().safety == 1 and time.monotonic() < deadline:
            time.sleep(PERIOD)
        assert arm.state().safety & 4
    finally:
        arm.close()


def test_a_command_to_rest_is_heard_though_it_comes_once(served):
    """A sign of life that took its place in the robot's registers would leave the arm creeping."""
    arm = connect("rtde", served().address)
    clock, moved = WallClock(), 0
    try:
        for _ in range(30):
            moved += drive(arm, [0.0, 0.0, 0.05, 0.0, 0.0, 0.0], cycles=12).qd[2] > 0.02
            arm.speed([0.0] * 6)
            until = clock.now() + 1.0
            while (moving := max(map(abs, arm.state().qd)) > 1e-3) and clock.now() < until:
                clock.wait_until(clock.now() + PERIOD)
            assert not moving
        assert moved
    finally:
        arm.close()


@pytest.fixture
def driver():
    """Start a driver in a process of its own that moves the arm for ever; it ends with the test."""
    started = []

    def start(kind, address, packets):
        if kind == "rtde":
            pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
        program = f"""
from hrcneuro.arms import connect
arm, clock = connect("ur", host={address!r}, driver={kind!r})
print(arm._process.pid if {kind!r} == "rtde" else 0, flush=True)
begin = clock.now()
for i in range(10 ** 6):
    clock.wait_until(begin + 0.008 * i)
    arm.state()
    arm.speed([0.4, 0.0, 0.3, 0.0, 0.0, 0.0])
"""
        # On a machine under load the watchdog may stop a driver before the arm is under way.
        for _ in range(5):
            started.append(subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE))
            own = int(started[-1].stdout.readline())
            with contextlib.suppress(AssertionError):
                packets.until(lambda p: abs(p[QD][0] - 0.4) < 1e-2, seconds=3.0)
                return started[-1], own
            started[-1].kill()
            packets.until(lambda p: not any(p[TARGET_QD]) and p[PROGRAM] == 1.0)
        raise AssertionError("the driver never got the arm moving")

    yield start
    for one in started:
        one.kill()
        one.wait()
        one.stdout.close()


def speed_of(packet):
    return max(map(abs, packet[QD]))


@pytest.mark.parametrize(
    ("way", "kind"),
    [("killed", "script"), ("cut", "script"), ("killed", "rtde"), ("ur_rtde killed", "rtde"), ("cut", "rtde")],
)
def test_an_arm_whose_driver_is_gone_comes_to_rest_and_stays(way, kind, served, stream, driver):
    one = served()
    packets = stream(one)
    process, own = driver(kind, one.address, packets)
    begin = packets.newest()[0]
    if way == "cut":
        one.fault("cut")
        with pytest.raises((AssertionError, OSError)):
            packets.until(lambda p: False)
        packets = stream(one)
    else:
        os.kill(own if way == "ur_rtde killed" else process.pid, signal.SIGKILL)
    rest = packets.until(lambda p: speed_of(p) < 0.01)
    # On the controller's clock. The arm would move on if someone connected and uploaded ur_rtde's program again.
    assert rest[0] - begin < 0.25
    packets.until(lambda p: p[0] > rest[0] + 0.5 or speed_of(p) > 0.01)
    assert speed_of(packets.packet()) < 0.01


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("moving", [True, False])
def test_a_session_that_is_suspended_moves_nothing_when_it_wakes(kind, moving, served, stream, tmp_path):
    """At rest, too: a driver that kept the arm awake would let it move after the gap."""
    if kind == "rtde":
        pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
    one = served()
    packets = stream(one)
    program = f"""
import math, os, sys
from hrcneuro.arms import connect
arm, clock = connect("ur", host={one.address!r}, driver={kind!r})
begin, last = clock.now(), clock.now()
for i in range(10 ** 6):
    clock.wait_until(begin + 0.008 * i)
    arm.state()
    if clock.now() - last > 0.5:
        break
    last = clock.now()
    if i == 50:
        print(flush=True)
    arm.speed([{0.4 if moving else 0.0}, 0.0, 0.0, 0.0, 0.0, 0.0])
# What a loop without a look at its own lateness would do now.
for i in range(50):
    arm.speed([0.4, 0.0, 0.0, 0.0, 0.0, 0.0] if {kind == "rtde"} else [0.0] * 6)
    clock.wait_until(clock.now() + 0.008)
print(arm.state().runtime, flush=True)
os._exit(0)
"""
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        process.stdout.readline()
        process.send_signal(signal.SIGSTOP)
        begin = packets.newest()[0]
        rest = packets.until(lambda p: p[0] > begin and speed_of(p) < 0.01)
        assert rest[0] - begin < 0.35
        packets.until(lambda p: p[0] > begin + 1.0)
        assert packets.newest()[PROGRAM] == 1.0, "nothing keeps the controller's program awake"
        process.send_signal(signal.SIGCONT)
        runtime = process.stdout.readline()
        assert kind == "script" or runtime == "1\n"
        assert speed_of(packets.until(lambda p: p[0] > begin + 1.3 or speed_of(p) > 0.01)) < 0.01
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("latency", [0.0, 0.06])
def test_a_delay_that_is_even_is_measured_there_and_back(served, latency):
    one = served()
    if not latency:
        check_delay(one.address, 0.05)
        return
    one.fault(f"latency={latency}")
    with pytest.raises(HardwareError, match=r"answers after \d+ ms at the quickest; 50 ms are allowed") as error:
        check_delay(one.address, 0.05)
    assert (error.value.exit_code, "nothing has moved" in error.value.problem) == (4, True)


def test_a_robot_without_rtde_is_left_to_its_driver():
    check_delay(new_address(), 0.05)


def test_the_command_a_killed_driver_left_behind_moves_nothing_on_connecting(served, stream, driver):
    one = served()
    packets = stream(one)
    process, _ = driver("rtde", one.address, packets)
    process.kill()
    packets.until(lambda p: not any(p[TARGET_QD]))
    arm = UrArm(one.address, WallClock())
    try:
        since = packets.newest()[0]
        assert arm.state().runtime == 2
        packets.until(lambda p: p[0] > since + 0.3 or any(p[TARGET_QD]))
        assert not any(packets.packet()[TARGET_QD])
    finally:
        arm.close()


def test_ur_rtde_cannot_connect_a_second_time(served):
    pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
    one = served()
    arm = UrArm(one.address, WallClock())
    try:
        assert resource.prlimit(arm._process.pid, resource.RLIMIT_NOFILE) == (3, 3)
        one.fault("cut")
        begin = time.monotonic()
        while arm._clock.now() - arm.state().stamp < 0.2:
            time.sleep(PERIOD)
        arm.stop(4.0)
        # The program that stops the arm may still be running; none may come after it.
        while one.ask("running") != ["Program running: false"]:
            assert time.monotonic() - begin < 3.0
            time.sleep(PERIOD)
    finally:
        arm.close()
    assert time.monotonic() - begin < 3.0, "a driver that hangs is not waited for"
    assert arm._process.returncode is not None


def test_the_own_controller_ends_with_its_driver():
    started = []

    class Arm:
        def __init__(self, host):
            started.append(host)
            check_ready(host)

        def close(self):
            pass

    arm = UrSim(Arm)
    arm.close()
    with pytest.raises(HardwareError, match="no robot answers"):
        check_ready(started[0])

    def refuse(host):
        started.append(host)
        raise HardwareError("no")

    with pytest.raises(HardwareError, match="no"):
        UrSim(refuse)
    with pytest.raises(HardwareError, match="no robot answers"):
        check_ready(started[1])


def test_a_controller_dies_with_a_killed_driver():
    program = (
        "import time\nfrom hrcneuro.arms.ursim import UrSim\n"
        "arm = UrSim(lambda host: print(host, flush=True))\ntime.sleep(60)"
    )
    done = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    host = done.stdout.readline().decode().strip()
    check_ready(host)
    done.kill()
    done.wait()
    done.stdout.close()
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:
        try:
            check_ready(host)
        except HardwareError:
            return
    raise AssertionError("the controller outlived its driver")


def test_robots_that_are_not_ready_are_refused_with_a_cure(served):
    with pytest.raises(HardwareError, match="no robot answers at 127"):
        check_ready(new_address())
    off = served("--power-off")
    with pytest.raises(HardwareError, match="not running") as error:
        check_ready(off.address)
    assert "pendant" in error.value.cure
    on = served()
    on.fault("protective_stop")
    with pytest.raises(HardwareError, match="PROTECTIVE_STOP"):
        check_ready(on.address)


def test_a_program_of_someone_else_is_not_ended(served, stream, tmp_path):
    (tmp_path / "wave.script").write_text("def wave():\nwhile True:\nsync()\nend\nend\n")
    one = served("--programs", str(tmp_path))
    one.ask("load wave.script", "play")
    stream(one).until(lambda p: p[PROGRAM] == 2.0)
    with pytest.raises(HardwareError, match=r"a program is on the robot at .* already \(PLAYING wave") as error:
        check_ready(one.address)
    assert (error.value.exit_code, "pendant" in error.value.cure) == (4, True)
    assert one.ask("pause") == ["Pausing program"]
    with pytest.raises(HardwareError, match="PAUSED"):
        check_ready(one.address)


@pytest.mark.parametrize(
    ("welcome", "answers", "part"),
    [
        ("Connected: Universal Robots Dashboard Server", {"PolyscopeVersion": "URSoftware 5.11.1.108318"}, "5.11.1"),
        ("Connected: Universal Robots Dashboard Server", {"PolyscopeVersion": ""}, "unknown software"),
        ("220 mail.example ESMTP", {}, "no robot's dashboard: it said b'220 mail.example"),
    ],
)
def test_what_is_no_cb3_is_refused(welcome, answers, part):
    """Of an e-Series arm there is no simulation here, so its dashboard is played line by line."""
    address = new_address()

    def answer():
        link, _ = listening.accept()
        with link, link.makefile("rwb") as lines:
            lines.write(welcome.encode() + b"\n")
            lines.flush()
            for line in lines:
                lines.write(answers.get(line.decode().strip(), "").encode() + b"\n")
                lines.flush()

    with socket.create_server((address, 29999)) as listening:
        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(HardwareError, match=re.escape(part)) as error:
            check_ready(address)
        thread.join()
    assert (error.value.exit_code, bool(error.value.cure)) == (4, True)


def test_inputs_that_another_client_holds_are_an_error(served):
    pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
    one = served()
    with one.connect(30004) as link:
        for kind, payload in ((b"V", b"\0\2"), (b"I", b"input_int_register_0")):
            link.sendall((3 + len(payload)).to_bytes(2, "big") + kind + payload)
            link.recv(100)
        with pytest.raises(HardwareError, match="another client holds the RTDE inputs") as error:
            UrArm(one.address, WallClock())
    assert (error.value.exit_code, "EtherNet/IP" in error.value.cure) == (4, True)


def test_stamps_show_delay_as_age():
    stamps = Stamps()
    for i in range(100):
        stamps.local(i * 0.008, 50.0 + i * 0.008 + (0.0 if i % 10 == 0 else 0.003))
    assert 50.8 + 0.030 - stamps.local(0.8, 50.8 + 0.030) == pytest.approx(0.030, abs=1e-4)
