"""ur_rtde, unmodified, against the controller: the table of docs/robot.md, call by call."""

import contextlib
import re
import time
from pathlib import Path

import numpy as np
import pytest

START = (-0.16406, -0.69115, 1.47829, -2.35794, -1.57080, -1.73486)


class Rig:
    """ur_rtde's interfaces to one controller."""

    def __init__(self, modules, address):
        control, receive, dashboard = modules
        self.receive = receive.RTDEReceiveInterface(address)
        self.control = control.RTDEControlInterface(address)
        self.dashboard = dashboard.DashboardClient(address)
        self.dashboard.connect()

    def until(self, condition, seconds=5.0):
        """Wait for a packet that meets ``condition``."""
        deadline = time.monotonic() + seconds
        last = -1.0
        while time.monotonic() < deadline:
            stamp = self.receive.getTimestamp()
            if stamp != last and condition():
                return
            last = stamp
            time.sleep(1e-3)
        raise AssertionError("the condition was not met in time")

    def upload(self):
        """Upload ur_rtde's program anew; its call returns before the program runs, and that finds the last command."""
        assert self.control.reuploadScript()
        self.until(self.control.isProgramRunning)
        assert self.control.speedStop()

    def still(self):
        return max(map(abs, self.receive.getActualQd())) < 1e-3

    def stream(self, call, *arguments, cycles=40):
        for _ in range(cycles):
            begin = self.control.initPeriod()
            call(*arguments)
            self.control.waitPeriod(begin)


@pytest.fixture(scope="module")
def rig(shared):
    modules = [
        pytest.importorskip(n, reason="ur-rtde is not installed")
        for n in ("rtde_control", "rtde_receive", "dashboard_client")
    ]
    one = Rig(modules, shared.address)
    yield one
    with contextlib.suppress(Exception):
        one.control.stopScript()
        one.control.disconnect()
        one.receive.disconnect()


@pytest.fixture(autouse=True)
def at_start(rig):
    if not rig.control.isProgramRunning():
        rig.upload()
    rig.control.moveJ(START, 3.0, 8.0)
    rig.until(rig.still)


def close(a, b, tolerance=2e-3):
    return np.abs(np.subtract(a, b)).max() < tolerance


def test_moveJ(rig):
    goal = [START[0] + 0.2, *START[1:]]
    assert rig.control.moveJ(goal, 1.0, 2.0)
    rig.until(lambda: close(rig.receive.getActualQ(), goal, 1e-4))


def test_moveJ_asynchronous_and_stopJ(rig):
    assert rig.control.moveJ([START[0] + 1.0, *START[1:]], 0.5, 2.0, True)
    rig.until(lambda: rig.receive.getActualQd()[0] > 0.3)
    rig.control.stopJ(5.0)
    rig.until(rig.still)
    assert rig.receive.getActualQ()[0] < START[0] + 0.9


def test_moveL_and_moveJ_IK(rig):
    pose = rig.receive.getActualTCPPose()
    goal = [pose[0], pose[1] + 0.1, *pose[2:]]
    assert rig.control.moveL(goal, 0.5, 2.0)
    rig.until(lambda: close(rig.receive.getActualTCPPose(), goal, 1e-4))
    assert rig.control.moveJ_IK(pose, 2.0, 4.0)
    rig.until(lambda: close(rig.receive.getActualTCPPose(), pose, 1e-4))


def test_moveL_asynchronous_and_stopL(rig):
    pose = rig.receive.getActualTCPPose()
    assert rig.control.moveL([pose[0], pose[1] + 0.4, *pose[2:]], 0.2, 1.0, True)
    rig.until(lambda: rig.receive.getActualTCPSpeed()[1] > 0.15)
    rig.control.stopL(2.0)
    rig.until(rig.still)


def test_moveL_FK(rig):
    goal = [START[0] + 0.1, *START[1:]]
    assert rig.control.moveL_FK(goal, 0.5, 2.0)
    rig.until(lambda: close(rig.receive.getActualQ(), goal, 1e-4))


def test_speedJ_and_speedStop(rig):
    rig.stream(rig.control.speedJ, [0, 0, 0.1, 0, 0, 0], 5.0, 0.008)
    assert rig.receive.getActualQd()[2] == pytest.approx(0.1, abs=1e-3)
    assert rig.control.speedStop()
    rig.until(rig.still)


def test_speedL(rig):
    rig.stream(rig.control.speedL, [0, 0.05, 0, 0, 0, 0], 1.0, 0.008)
    np.testing.assert_allclose(rig.receive.getActualTCPSpeed(), [0, 0.05, 0, 0, 0, 0], atol=2e-3)
    assert rig.control.speedStop()
    rig.until(rig.still)


def test_servoJ(rig):
    goal = [START[0] + 0.05, *START[1:]]
    rig.stream(rig.control.servoJ, goal, 0.5, 0.5, 0.008, 0.1, 300.0, cycles=100)
    assert close(rig.receive.getActualQ(), goal, 1e-3)
    assert rig.control.servoStop()
    rig.until(rig.still)


def test_servoL(rig):
    pose = rig.receive.getActualTCPPose()
    goal = [pose[0], pose[1] + 0.02, *pose[2:]]
    rig.stream(rig.control.servoL, goal, 0.5, 0.5, 0.008, 0.1, 300.0, cycles=100)
    assert close(rig.receive.getActualTCPPose(), goal, 1e-3)
    assert rig.control.servoStop()
    rig.until(rig.still)


def test_a_kicked_watchdog_leaves_the_program_running(rig):
    assert rig.control.setWatchdog(2.0)
    rig.stream(rig.control.kickWatchdog, cycles=125)
    assert rig.control.isProgramRunning()
    rig.until(lambda: not rig.control.isProgramRunning())
    rig.upload()


def test_the_watchdog_stops_an_arm_whose_client_is_silent(rig):
    assert rig.control.setWatchdog(10.0)
    rig.stream(rig.control.speedJ, [0, 0, 0.1, 0, 0, 0], 5.0, 0.008)
    begin = time.monotonic()
    rig.until(rig.still)
    assert time.monotonic() - begin < 1.0
    rig.until(lambda: not rig.control.isProgramRunning())
    rig.upload()


def test_registers(rig, shared):
    with shared.connect(30002) as link:
        link.sendall(b"sec s():\nwrite_output_integer_register(13, 42)\nwrite_output_float_register(14, 2.5)\nend\n")
        rig.until(lambda: rig.receive.getOutputIntRegister(13) == 42)
    assert rig.receive.getOutputDoubleRegister(14) == 2.5
    assert rig.control.isProgramRunning(), "a secondary program leaves the main one alone"
    rtde_io = pytest.importorskip("rtde_io")
    io = rtde_io.RTDEIOInterface(shared.address)
    try:
        assert io.setInputIntRegister(18, 7)
        assert io.setInputDoubleRegister(18, 2.5)
        answer = "write_output_integer_register(15, read_input_integer_register(18))\n"
        with shared.connect(30002) as link:
            link.sendall(f"sec s():\n{answer}end\n".encode())
            rig.until(lambda: rig.receive.getOutputIntRegister(15) == 7)
    finally:
        io.disconnect()


def test_a_function_of_the_client_s_own(rig):
    assert rig.control.sendCustomScriptFunction("mine", "set_standard_digital_out(5, True)")
    rig.until(lambda: rig.receive.getDigitalOutState(5))
    assert rig.control.isProgramRunning()


def test_whatever_is_received_has_its_shape(rig):
    six = """getActualCurrent getActualJointVoltage getActualQ getActualQd getActualTCPForce getActualTCPPose
    getActualTCPSpeed getJointControlOutput getJointTemperatures getTargetCurrent getTargetMoment getTargetQ getTargetQd
    getTargetQdd getTargetTCPPose getTargetTCPSpeed getJointMode"""
    for name in six.split():
        assert len(getattr(rig.receive, name)()) == 6, name
    assert len(rig.receive.getActualToolAccelerometer()) == 3
    assert close(rig.receive.getTargetQ(), rig.receive.getActualQ(), 1e-3)
    assert rig.receive.getRobotStatus() == rig.control.getRobotStatus() == 3
    assert (rig.receive.getSpeedScaling(), rig.receive.getSpeedScalingCombined()) == (1.0, 1.0)
    assert not rig.receive.isEmergencyStopped()
    assert rig.control.getJointTorques() == [0.0] * 6


def test_digital_and_analog_outputs(rig, shared):
    rtde_io = pytest.importorskip("rtde_io")
    io = rtde_io.RTDEIOInterface(shared.address)
    try:
        for pin, bit, call in (
            (3, 3, io.setStandardDigitalOut), (4, 12, io.setConfigurableDigitalOut), (1, 17, io.setToolDigitalOut)
        ):  # fmt: skip
            assert call(pin, True)
            rig.until(lambda bit=bit: rig.receive.getDigitalOutState(bit))
            assert call(pin, False)
            rig.until(lambda bit=bit: not rig.receive.getDigitalOutState(bit))
        assert io.setAnalogOutputVoltage(0, 0.3)
        rig.until(lambda: abs(rig.receive.getStandardAnalogOutput0() - 3.0) < 1e-9)
        assert io.setAnalogOutputCurrent(1, 0.5)
        rig.until(lambda: abs(rig.receive.getStandardAnalogOutput1() - 0.012) < 1e-9)
        assert io.setSpeedSlider(0.5)
        rig.until(lambda: rig.receive.getTargetSpeedFraction() == 0.5)
        assert io.setSpeedSlider(1.0)
        rig.until(lambda: rig.receive.getTargetSpeedFraction() == 1.0)
    finally:
        io.disconnect()


def test_kinematics_tool_and_limits(rig):
    pose = rig.receive.getActualTCPPose()
    np.testing.assert_allclose(rig.control.getInverseKinematics(pose, list(START)), START, atol=1e-4)
    np.testing.assert_allclose(rig.control.getForwardKinematics()[:3], pose[:3], atol=1e-4)
    assert rig.control.isPoseWithinSafetyLimits(pose)
    assert not rig.control.isPoseWithinSafetyLimits([3.0, *pose[1:]])
    assert rig.control.isJointsWithinSafetyLimits(list(START))
    assert rig.control.setTcp([0, 0, 0.1, 0, 0, 0])
    np.testing.assert_allclose(rig.control.getTCPOffset(), [0, 0, 0.1, 0, 0, 0])
    rig.until(lambda: abs(rig.receive.getActualTCPPose()[2] - pose[2] + 0.1) < 2e-3)
    assert rig.control.setTcp([0.0] * 6)
    assert rig.control.poseTrans([1.0, 0, 0, 0, 0, 0], [0, 2.0, 0, 0, 0, 0])[:3] == [1.0, 2.0, 0.0]
    assert rig.control.isSteady()
    assert rig.control.setPayload(1.5, [0.0, 0.0, 0.1])


def test_modes_and_dashboard(rig):
    assert (rig.receive.getRobotMode(), rig.receive.getSafetyMode(), rig.receive.getRuntimeState()) == (7, 1, 2)
    assert rig.receive.getSafetyStatusBits() == 1
    assert not rig.receive.isProtectiveStopped()
    assert rig.dashboard.robotmode() == "Robotmode: RUNNING"
    assert rig.dashboard.running()
    assert rig.dashboard.polyscopeVersion() == "3.9.1.64192"


def test_reconnect(rig):
    rig.control.disconnect()
    assert not rig.control.isConnected()
    assert rig.control.reconnect()
    assert rig.control.moveJ([START[0] + 0.1, *START[1:]], 2.0, 4.0)
    rig.receive.disconnect()
    assert rig.receive.reconnect()
    rig.until(lambda: close(rig.receive.getActualQ(), [START[0] + 0.1, *START[1:]]))


def test_the_panel(served, tmp_path):
    module = pytest.importorskip("dashboard_client", reason="ur-rtde is not installed")
    (tmp_path / "wave.script").write_text("def wave():\nwhile True:\nsync()\nend\nend\n")
    one = served("--programs", str(tmp_path))
    panel = module.DashboardClient(one.address)
    panel.connect()

    def shows(question, answer):
        deadline = time.monotonic() + 5.0
        while question() != answer and time.monotonic() < deadline:
            time.sleep(0.01)
        assert question() == answer

    assert panel.isConnected()
    panel.loadURP("wave.script")
    panel.play()
    shows(panel.running, True)
    assert panel.programState() == "PLAYING wave.script"
    assert panel.getLoadedProgram().endswith("/programs/wave.script")
    panel.pause()
    shows(panel.programState, "PAUSED wave.script")
    panel.play()
    panel.stop()
    shows(panel.running, False)
    for call in (lambda: panel.popup("x"), panel.closePopup, panel.closeSafetyPopup, lambda: panel.addToLog("x")):
        call()
    assert (panel.safetymode(), panel.getRobotModel()) == ("Safetymode: NORMAL", "UR10")
    panel.unlockProtectiveStop()
    panel.powerOff()
    shows(panel.robotmode, "Robotmode: POWER_OFF")
    panel.powerOn()
    panel.brakeRelease()
    shows(panel.robotmode, "Robotmode: RUNNING")
    panel.quit()


def test_the_documented_calls_are_ur_rtde_s_and_are_called_here():
    """Every call that docs/robot.md says works is made above, and there is none that it does not mention."""
    modules = {n: pytest.importorskip(n, reason="ur-rtde is not installed") for n in (
        "rtde_control", "rtde_receive", "rtde_io", "dashboard_client")}  # fmt: skip
    kinds = ("RTDEControlInterface", "RTDEReceiveInterface", "RTDEIOInterface", "DashboardClient")
    classes = [getattr(module, kind) for module, kind in zip(modules.values(), kinds, strict=True)]
    exist = {name for kind in classes for name in dir(kind) if name[0].islower()}
    text = (Path(__file__).parents[2] / "docs" / "robot.md").read_text(encoding="utf-8")
    table = text.split("### Calls of ur_rtde")[1].split("The tests are")[0]
    made, named = Path(__file__).read_text(encoding="utf-8"), set()
    for row in table.splitlines():
        if not row.startswith("| `"):
            continue
        calls, works, _ = (cell.strip() for cell in row.strip("|").split("|"))
        names = re.findall(r"`(\w+)", calls)
        named |= set(names)
        if works.startswith("yes"):
            assert [n for n in names if not re.search(rf"\b{n}\b", made)] == [], "said to work, but not called here"
    assert named - exist == set(), "in the table, but not in ur_rtde"
    assert exist - named == set(), "in ur_rtde, but not in the table"


def test_a_protective_stop_is_seen(rig, shared):
    assert rig.control.triggerProtectiveStop() or True
    rig.until(rig.receive.isProtectiveStopped)
    assert rig.receive.getSafetyMode() == 3
