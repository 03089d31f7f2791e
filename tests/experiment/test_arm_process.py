"""The arm's side in a process of its own, in real time: what it reports, and how it ends when others are killed."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import multiprocessing
import os
import platform
import re
import signal
import subprocess
import sys
import time
import tty
from multiprocessing.connection import wait
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from arm_flow import SYS_EXIT
from ur10_robot import Served, Stream

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import ConfigError
from hrcneuro.experiment import arm_process
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.arm_process import ArmProcess
from hrcneuro.experiment.arm_side import ArmSettings
from hrcneuro.experiment.messages import (
    Approach,
    Arrived,
    Ended,
    Executed,
    Finish,
    Go,
    Halted,
    Health,
    InRadius,
    Mark,
    Onset,
    Ready,
    Trouble,
    Truth,
)  # fmt: skip
from hrcneuro.live.transport import MOVES, TRUTH
from hrcneuro.live.triggers import TriggerOptions
from hrcneuro.paradigm.markers import of_move
from hrcneuro.robot.backend import PERIOD
from hrcneuro.stages.robot import Config

FLOW = Path(__file__).parents[1] / "helpers" / "arm_flow.py"
PATIENCE = 40.0  # s, of a busy machine


def marker(trial):
    return of_move("s01", scenario="iC", block=1, episode=1, trial=trial, practice=False)


class Reports:
    """What an arm's side reports."""

    def __init__(self, arm):
        self.arm, self.seen = arm, []

    def until(self, kind):
        """Return the next report of a kind; one that ends the session otherwise is a failure."""
        end = seconds() + PATIENCE
        while seconds() < end:
            wait([self.arm.connection], 0.1)
            new = self.arm.reports()
            self.seen += new
            if found := [report for report in new if isinstance(report, kind)]:
                return found[0]
            assert not any(isinstance(report, Halted) for report in new), new
        raise AssertionError(f"no {kind.__name__} within {PATIENCE:g} s")

    def of(self, kind):
        return [report for report in self.seen if isinstance(report, kind)]


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    # On a busy machine a simulated arm may be held up: not what is tested here.
    return Config(rescue_folder=str(tmp_path_factory.mktemp("kept")), lead_s=0.035, max_late_s=0.5)


@pytest.fixture(scope="module")
def ahead(config):
    return Ahead(config, shortest_s=0.6)


def test_a_session_in_real_time(config, ahead, lsl):
    """Reports come as things happen; markers, of onsets and of what is no motion, carry the time at which they did."""
    config = dataclasses.replace(
        config, backend="ursim", patient=True, markers="lsl", truth=True, recorder_wait_s=PATIENCE,
        trigger=TriggerOptions(port="mock"),
    )  # fmt: skip
    with ArmProcess(ArmSettings(config, "s01", expected_s=60.0), ahead) as arm:
        reports, source, inlets = Reports(arm), "hrcneuro experiment s01", []
        for name, one in ((MOVES, source), (TRUTH, f"{source} truth")):
            (found,) = lsl.resolve_streams(timeout=PATIENCE, name=name, source_id=one)
            inlets.append(lsl.StreamInlet(found))
            inlets[-1].open_stream(timeout=10.0)
        reports.until(Ready)
        # Both clocks count the seconds of this machine, from different instants.
        between = lsl.local_clock() - seconds()
        pressed = seconds() - 0.3
        arm.send(Truth({"marker": marker(5), "actor": "human", "key_s": pressed + 2.0}))
        arm.send(Mark("key/key=E", pressed))
        arm.send(Approach((3, 2)))
        reports.until(Arrived)
        arm.send(Go(5, (3, 2), (3, 3), 0.7, marker(5)))
        # Asked for while the arm still moves: it begins at rest.
        reports.until(InRadius)
        arm.send(Go(6, (3, 3), (3, 3), 0.6, marker(6)))
        arm.send(Mark("error", seconds()))
        reports.until(Executed)
        with pytest.raises(ConfigError, match=r"t_f 0\.1 s"):
            arm.send(Go(7, (3, 3), (3, 4), 0.1, marker(7)))
        arm.send(Finish())
        reports.until(Ended)
        marks = [inlets[0].pull_sample(timeout=10.0) for _ in range(3)]
        truth = json.loads(inlets[1].pull_sample(timeout=10.0)[0][0])
        for inlet in inlets:
            inlet.close_stream()
    told = [report for report in reports.seen if not isinstance(report, Health)]
    kinds = ["Ready", "Arrived", *["Onset", "InRadius", "Executed"] * 2, "Ended"]
    assert [type(report).__name__ for report in told] == kinds
    assert [report.index for report in told if hasattr(report, "index")] == [5, 5, 5, 6, 6, 6]
    onset, done = reports.of(Onset), reports.of(Executed)
    assert 0.0 <= onset[1].when - done[0].when < 0.1
    assert done[0].when - onset[0].when == pytest.approx(0.75, abs=0.15)
    assert reports.of(Health)
    assert [sample[0] for sample, _ in marks] == ["key/key=E", marker(5), "error"]
    assert [stamp - between for _, stamp in marks[:2]] == pytest.approx([pressed, onset[0].when], abs=2e-3)
    assert marks[1][1] == onset[0].marked
    assert truth.pop("key_s") - between == pytest.approx(pressed + 2.0, abs=2e-3)
    assert truth == {"marker": marker(5), "actor": "human"}
    (place,) = (Path(config.rescue_folder) / "s01").iterdir()
    moves = pd.read_parquet(place / "moves.parquet")
    assert moves["trial"].tolist() == [5, 6]
    assert moves["lsl_s"].iloc[0] == onset[0].marked


@pytest.fixture
def flow(tmp_path):
    """Return a flow in a process of its own that moves an arm to and fro, the arm's side's number, and what watches."""
    served = Served()
    process = subprocess.Popen(
        [sys.executable, str(FLOW), "ur", served.address, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    arm = int(process.stdout.readline().split()[1])
    try:
        yield process, arm, served
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        with contextlib.suppress(OSError):
            os.kill(arm, signal.SIGKILL)
        served.end()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGUSR1], ids=["killed", "killed, but for a last thread"])
def test_where_the_flow_is_killed_the_arm_rests_within_a_quarter_of_a_second(flow, tmp_path, end):
    """Braked in a controlled stop; what the arm did is kept, and its process ends."""
    if end == signal.SIGUSR1 and SYS_EXIT is None:
        pytest.skip(f"how a thread ends is not known here for {platform.machine()}")
    process, arm, served = flow
    for line in process.stdout:
        assert not line.startswith("Halted"), line
        if line.startswith("Onset"):
            break
    stream = Stream(served)
    # Velocities of the joints, and the controller's own clock: what it is held up itself does not count.
    while max(map(abs, (packet := stream.newest())[37:43])) < 0.1:
        pass
    process.send_signal(end)
    at_kill = moving = packet[0]
    while packet[0] < at_kill + 1.0:
        packet = stream.packet()
        moving = packet[0] if max(map(abs, packet[37:43])) > 1e-3 else moving
    stream.link.close()
    assert 0.02 < moving + PERIOD - at_kill <= 0.25
    process.kill()
    until = time.monotonic() + PATIENCE
    while Path(f"/proc/{arm}").exists() and time.monotonic() < until:
        time.sleep(0.02)
    assert not Path(f"/proc/{arm}").exists()
    (place,) = (tmp_path / "s01").iterdir()
    telemetry = pd.read_parquet(place / "telemetry.parquet")
    assert telemetry["phase"].iloc[-1] == "stop"
    assert np.abs(telemetry.filter(regex=r"^qd_\d").iloc[-1]).max() < 1e-3


def test_an_arms_side_that_is_killed_is_missed(config, ahead):
    with ArmProcess(ArmSettings(config, "s01"), ahead) as arm:
        reports = Reports(arm)
        os.kill(arm.pid, signal.SIGKILL)
        halted = reports.until(Halted)
        assert "has ended without a word" in halted.problem
        assert halted.cure.startswith("press the emergency stop if the arm moves on")
        assert not halted.rests
        arm.send(Go(0, (3, 3), (3, 4), 0.7, marker(0)))
        assert arm.reports() == []


def test_what_liblsl_writes_comes_as_words_and_not_onto_the_terminal(config, ahead, lsl, monkeypatch, tmp_path, capfd):
    chatty = tmp_path / "lsl_api.cfg"
    configured = Path(os.environ["LSLAPICFG"]).read_text()
    chatty.write_text(re.sub(r"level *= *\S+", "level = 0", configured))
    monkeypatch.setenv("LSLAPICFG", str(chatty))
    said = []
    with ArmProcess(ArmSettings(dataclasses.replace(config, markers="lsl"), "s01"), ahead, say=said.append) as arm:
        Reports(arm).until(Ready)
    assert any(text.startswith("arm: ") and f"Configuration loaded from {chatty}" in text for text in said), said
    assert "INFO" not in capfd.readouterr().err


def test_a_trigger_port_that_goes_away_is_trouble_and_stops_no_arm(config, ahead):
    pytest.importorskip("byte_triggers", reason="byte-triggers is not installed: hrcneuro[triggers]")
    here, there = os.openpty()
    tty.setraw(there)
    name = os.ttyname(there)
    port = TriggerOptions(port="serial", address=name, pulse_ms=1.0)
    with ArmProcess(ArmSettings(dataclasses.replace(config, trigger=port), "s01"), ahead) as arm:
        reports = Reports(arm)
        reports.until(Ready)
        os.close(here)
        os.close(there)
        arm.send(Go(0, (3, 3), (3, 4), 0.7, marker(0)))
        reports.until(Executed)
        arm.send(Go(1, (3, 4), (3, 3), 0.7, marker(1)))
        reports.until(Executed)
        arm.send(Finish())
        reports.until(Ended)
    (trouble,) = reports.of(Trouble)
    assert f"the serial trigger port '{name}' did not take code 1" in trouble.problem
    assert "--resume" in trouble.cure
    first, _ = reports.of(Executed)
    assert trouble.when < first.when


def test_an_arms_side_that_cannot_begin_says_why(config, ahead, tmp_path):
    (tmp_path / "file").touch()
    config = dataclasses.replace(config, backend="ursim", rescue_folder=str(tmp_path / "file"))
    with ArmProcess(ArmSettings(config, "s01"), ahead) as arm:
        halted = Reports(arm).until(Halted)
    assert "cannot be written in" in halted.problem
    assert "robot.rescue_folder" in halted.cure
    assert halted.rests


def test_reports_that_nobody_takes_do_not_hold_up_the_arm():
    """A pipe holds so much: what tells of health is left out, all else waits until somebody reads again."""
    reader, writer = multiprocessing.Pipe(duplex=False)
    outbox = arm_process._Outbox(writer)
    for i in range(20_000):
        outbox.put(Health(float(i), 0.0, 0.0, 0.0))
    outbox.put(Ended(1.0))
    got = []
    while not got or not isinstance(got[-1], Ended):
        assert reader.poll(PATIENCE)
        got.append(reader.recv())
    assert 200 < len(got) < 20_000
    outbox.end()
    writer.close()
    with pytest.raises(EOFError):
        reader.recv()
