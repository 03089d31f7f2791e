"""The backend ros against a real ROS: a master, a node that plays the arm, and the command line. Debian's packages."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

PYTHON, PACKAGES = "/usr/bin/python3", "/usr/lib/python3/dist-packages"
NEEDED = "import rospy, sensor_msgs.msg, std_msgs.msg"
STUDY = """[study]
name = "one"
subjects = ["s01"]
exclude = []
[acquire]
sfreq = 500.0
[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 1
[robot]
backend = "ros"
at_the_robot = true
rescue_folder = "rescued"
blocks = [1]
t_f_s = 0.6
pause_s = 0.0
longest_gap_s = 0.0
# The machine runs other tests beside this one.
max_packet_age_s = 0.4
"""


def lacking() -> str:
    if not shutil.which("rosmaster"):
        return "rosmaster is not installed: apt install ros-core"
    done = subprocess.run([PYTHON, "-c", NEEDED], capture_output=True, text=True, check=False)
    return f"{PYTHON}: {done.stderr.strip().splitlines()[-1]}" if done.returncode else ""


@pytest.fixture(scope="module")
def study(tmp_path_factory, hrcneuro):
    """Return a folder with a configuration and its acquired subject."""
    folder = tmp_path_factory.mktemp("ros")
    (folder / "one.toml").write_text(STUDY)
    assert hrcneuro("acquire", "s01", "--config", folder / "one.toml", "--workdir", folder).code == 0
    return folder


@pytest.fixture(scope="module")
def surroundings(study):
    """Return the environment of a master of its own, in which this Python finds Debian's packages after its own."""
    problem = lacking()
    if problem:
        pytest.skip(f"no ROS: {problem}")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (study / "sitecustomize.py").write_text(f"import sys\nsys.path.append({PACKAGES!r})\n")
    env = os.environ | {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_HOME": str(study)}
    env |= {"PYTHONPATH": f"{study}{os.pathsep}{Path(__file__).parents[2]}"}
    # Each test process has an arm of its own, so the machine's lock of the one arm that ROS has must not be shared.
    env |= {"TMPDIR": str(study)}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], env=env, **quiet)
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            break
        except OSError:
            assert master.poll() is None, "rosmaster ended at once"
    yield env
    master.send_signal(signal.SIGINT)
    master.wait(20.0)


@pytest.fixture
def arm(surroundings, workspace):
    """Return a function that starts the node."""
    running = []

    def start(fault=""):
        angles = ",".join(map(str, workspace.home().tolist()))
        script = Path(__file__).parents[1] / "helpers" / "ros_arm.py"
        running.append(
            subprocess.Popen([PYTHON, script, f" {angles}", fault], env=surroundings, stdout=subprocess.PIPE, text=True)
        )
        return running[-1]

    yield start
    for node in running:
        node.kill()
        node.communicate()


def command(folder, *more):
    given = ["robot", "s01", "--config", folder / "one.toml", "--workdir", folder, "--force", *more]
    return [sys.executable, "-m", "hrcneuro", *map(str, given)]


def test_a_session_over_ros(study, surroundings, arm):
    node = arm()
    done = subprocess.run(
        command(study, "--timing"), env=surroundings, cwd=study, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "t = 0 to the onset of the motion" in done.stdout
    (place,) = (study / "cache" / "robot" / "s01").glob("*/moves.parquet")
    moves, telemetry = pd.read_parquet(place), pd.read_parquet(place.with_name("telemetry.parquet"))
    moved = moves[~moves["clamped"]]
    assert len(moved) > 5
    # Joints by their names, not their order, and the arm on its tiles; how precisely depends on the machine's load.
    assert (moved["end_error_mm"] <= 2.0).all()
    assert np.median(np.diff(telemetry["time_s"])) == pytest.approx(0.008, abs=5e-4)
    assert telemetry["time_s"].iloc[0] == pytest.approx(0.0, abs=0.1)
    node.send_signal(signal.SIGINT)
    out, _ = node.communicate(timeout=20.0)
    assert float(out) < 1e-3, "the arm rests at the end"


@pytest.mark.parametrize(("fault", "words"), [("program", "is not running"), ("death", "the last packet is")])
def test_what_goes_wrong_on_the_way_ends_in_a_stop(study, surroundings, arm, fault, words):
    node = arm(fault)
    done = subprocess.run(command(study), env=surroundings, cwd=study, capture_output=True, text=True, check=False)
    assert done.returncode == 4, done.stderr
    assert words in done.stderr
    known = "the arm was stopped" if fault == "program" else "was not seen at rest: it may be moving"
    assert f"{known}; the record is in" in done.stderr
    assert "rescued/s01" in done.stderr
    (place,) = set(re.findall(r"rescued/s01/[\dT-]+", done.stderr))
    telemetry = pd.read_parquet(study / place / "telemetry.parquet")
    assert telemetry["phase"].iloc[-1] == "stop"
    if fault == "program":
        assert not telemetry.filter(like="qd_command").iloc[-1].any()
        assert telemetry.filter(regex=r"^qd_\d").iloc[-1].abs().max() < 1e-3
        node.send_signal(signal.SIGINT)
        assert float(node.communicate(timeout=20.0)[0]) < 1e-3


def test_without_an_arm_or_a_master_nothing_hangs(study, surroundings):
    done = subprocess.run(command(study), env=surroundings, cwd=study, capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert "no arm publishes on /joint_states" in done.stderr
    nowhere = surroundings | {"ROS_MASTER_URI": "http://127.0.0.1:1"}
    done = subprocess.run(command(study), env=nowhere, cwd=study, capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert "no ROS master answers at http://127.0.0.1:1" in done.stderr
    assert "roscore" in done.stderr


def test_without_ros_the_cure_is_named(study, hrcneuro):
    if subprocess.run([sys.executable, "-c", NEEDED], capture_output=True, check=False).returncode == 0:
        pytest.skip("this Python finds ROS")
    done = hrcneuro(*command(study)[3:], cwd=study)
    assert done.code == 4
    assert "ROS Noetic is not there for this Python: No module named 'rospy'" in done.err
    assert "python3-sensor-msgs" in done.err
