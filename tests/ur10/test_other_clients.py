"""Clients that others wrote, unmodified: urx on the secondary and real-time ports, UR's own client on RTDE's.

UR's client is in no package registry; where its module ``rtde`` can be imported, it is tested.
"""

import itertools
import json
import subprocess
import sys

import pytest

START = (-0.16406, -0.69115, 1.47829, -2.35794, -1.57080, -1.73486)

# In a process of its own: urx reports what it does not know to logging, and has deprecated calls.
URX = """
import json, logging, sys, time
from urx.urrobot import URRobot
said = []
handler = logging.Handler(logging.WARNING)
handler.emit = lambda r: said.append(r.getMessage())
robot = URRobot(sys.argv[1], use_rt=True)
sys.excepthook = lambda *error: (sys.__excepthook__(*error), robot.close())  # its threads would live on
logging.getLogger().addHandler(handler)

def until(condition):
    deadline = time.monotonic() + 5
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()

q, pose = robot.getj(), robot.getl()
packet = robot.secmon.get_all_data(wait=True)
found = {"q": q, "pose": pose, "sizes": {k: v["size"] for k, v in packet.items() if isinstance(v, dict)},
         "mode": packet["RobotModeData"]}
robot.movej([q[0] + 0.2, *q[1:4], q[4] + 0.3, q[5]], 2, 2)
found["movej"] = robot.getj()[0] - q[0]
# Tilted: urx takes rotations by +180 and -180 degrees for different ones.
x, y, *rest = robot.getl()
robot.movel([x, y + 0.1, *rest], 1, 0.5)
found["movel"] = max(abs(a - b) for a, b in zip(robot.getl(), [x, y + 0.1, *rest]))
robot.speedx("speedj", [0, 0, 0.1, 0, 0, 0], 2, 5)
found["speedj"] = until(lambda: robot.secmon.get_all_data(wait=True)["JointData"]["qd_actual2"] > 0.09)
found["real-time"] = max(abs(a - b) for a, b in zip(robot.rtmon.q_actual(wait=True), robot.getj(wait=True)))
robot.stopj(5)
found["stopj"] = until(lambda: abs(robot.secmon.get_all_data(wait=True)["JointData"]["qd_actual2"]) < 1e-3)
height = robot.getl(wait=True)[2]
robot.speedx("speedl", [0, 0, 0.05, 0, 0, 0], 1, 5)
found["speedl"] = until(lambda: robot.getl(wait=True)[2] > height + 0.02)
robot.stopl(1)
robot.set_digital_out(2, True)
found["output"] = until(lambda: robot.get_digital_out(2, wait=True))
robot.set_analog_out(0, 0.5)
found["voltage"] = until(lambda: robot.secmon.get_all_data(wait=True)["MasterBoardData"]["analogOutput0"] == 5.0)
robot.set_tcp((0, 0, 0.1, 0, 0, 0))
found["tool"] = until(lambda: robot.secmon.get_all_data(wait=True)["CartesianInfo"]["tcpOffsetZ"] == 0.1)
found["said"] = said
robot.close()
print(json.dumps(found))
"""


def test_urx(served):
    pytest.importorskip("urx", reason="urx is not installed")
    one = served()
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", URX, one.address], capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr.decode()
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["q"] == pytest.approx(START, abs=1e-5)
    assert found["pose"][:3] == pytest.approx([-1.00469, 0.00015, 0.01982], abs=1e-5)
    # Sizes as in UR's description of the client interfaces of software 3.5 and later.
    assert found["sizes"] == {
        "SecondaryClientData": 1252, "RobotModeData": 46, "JointData": 251, "ToolData": 37, "MasterBoardData": 74,
        "CartesianInfo": 101, "LaserPointer(OBSOLETE)": 225, "ForceModeData": 61, "AdditionalInfo": 7,
    }  # fmt: skip
    mode = found["mode"]
    assert (mode["robotMode"], mode["isProgramRunning"], mode["isPowerOnRobot"]) == (7, False, True)
    assert (mode["isEmergencyStopped"], mode["speedScaling"]) == (False, 1.0)
    assert found["movej"] == pytest.approx(0.2, abs=1e-3)
    assert found["movel"] < 1e-3
    assert found["real-time"] < 0.05
    assert [found[k] for k in ("speedj", "stopj", "speedl", "output", "voltage", "tool")] == [True] * 6
    assert found["said"] == []


@pytest.fixture
def ur_client():
    module = pytest.importorskip(
        "rtde.rtde", reason="UR's RTDE Python client is not installed: it comes from its repository only"
    )
    links = []

    def connect(one):
        links.append(module.RTDE(one.address))
        links[-1].connect()
        return links[-1]

    yield connect
    for link in links:
        link.disconnect()


def test_ur_s_client_reads_writes_and_shares(served, ur_client):
    one = served()
    link, other = ur_client(one), ur_client(one)
    assert link.get_controller_version() == (3, 9, 1, 64192)
    names = ["timestamp", "actual_q", "actual_digital_output_bits", "target_speed_fraction", "output_int_register_3"]
    assert link.send_output_setup(names, ["DOUBLE", "VECTOR6D", "UINT64", "DOUBLE", "INT32"], frequency=125)
    outputs = link.send_input_setup(["standard_digital_output_mask", "standard_digital_output"], ["UINT8", "UINT8"])
    slider = link.send_input_setup(["speed_slider_mask", "speed_slider_fraction"], ["UINT32", "DOUBLE"])
    with pytest.raises(ValueError, match="already in use"):
        other.send_input_setup(["speed_slider_mask"])
    with pytest.raises(ValueError, match="NOT_FOUND"):
        other.send_output_setup(["timestamp", "nonsense"])
    assert link.send_start()
    outputs.standard_digital_output_mask, outputs.standard_digital_output = 0xFF, 0b1001
    slider.speed_slider_mask, slider.speed_slider_fraction = 1, 0.5
    assert link.send(outputs)
    assert link.send(slider)
    with one.connect(30003) as script:
        script.sendall(b"write_output_integer_register(3, 42)\n")
        packets = []
        while len(packets) < 250:
            packet = link.receive_buffered()
            packets += [packet] if packet is not None else []
    last = packets[-1]
    assert last.actual_q == pytest.approx(START, abs=1e-5)
    assert (last.actual_digital_output_bits, last.target_speed_fraction, last.output_int_register_3) == (9, 0.5, 42)
    steps = {round(b.timestamp - a.timestamp, 9) for a, b in itertools.pairwise(packets)}
    assert steps == {0.008}
    assert link.send_message(b"hello", b"test")
    assert link.send_pause()
    link.disconnect()
    link.connect()
    assert link.get_controller_version() == (3, 9, 1, 64192)


def test_ur_s_client_steers_a_program(served, ur_client, tmp_path):
    (tmp_path / "loop.script").write_text("""
def loop():
  rtde_set_watchdog("input_int_register_0", 2, "stop")
  while True:
    write_output_integer_register(0, 1)
    while read_input_integer_register(0) == 0:
      sync()
    end
    q = get_actual_joint_positions()
    q[0] = read_input_float_register(0)
    movej(q, a=4, v=1)
    write_output_integer_register(0, 0)
    while read_input_integer_register(0) == 1:
      sync()
    end
  end
end
""")
    one = served("--programs", str(tmp_path))
    link = ur_client(one)
    link.send_output_setup(["actual_q", "output_int_register_0", "runtime_state"])
    goal = link.send_input_setup(["input_double_register_0"], ["DOUBLE"])
    awake = link.send_input_setup(["input_int_register_0"], ["INT32"])
    awake.input_int_register_0 = 0
    assert link.send_start()
    assert one.ask("load loop.script", "play") == ["Loading program: loop.script", "Starting program"]
    reached, asked = [], False
    for _ in range(2000):
        packet = link.receive()
        if not asked and packet.output_int_register_0 == 1:
            goal.input_double_register_0 = START[0] + 0.1 * (len(reached) + 1)
            link.send(goal)
            asked, awake.input_int_register_0 = True, 1
        elif asked and packet.output_int_register_0 == 0:
            reached.append(packet.actual_q[0] - goal.input_double_register_0)
            asked, awake.input_int_register_0 = False, 0
        link.send(awake)
        if len(reached) == 3:
            break
    assert reached == pytest.approx([0.0] * 3, abs=1e-3)
    while packet.runtime_state != 1:
        packet = link.receive()
