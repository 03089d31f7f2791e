"""The arm's side at virtual pace: requests in and reports out in one process, on one clock."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pandas as pd
import pytest

from hrcneuro.errors import ConfigError
from hrcneuro.experiment import arm_side
from hrcneuro.experiment.ahead import Ahead
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
    Truth,
)  # fmt: skip
from hrcneuro.paradigm.markers import of_move
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.sim import Disturbance, SimArm, VirtualClock
from hrcneuro.stages.robot import Config

WAY = [(2, 2), (2, 3), (2, 3), (3, 3), (3, 4)]
"""Tiles; the second move stays."""


@pytest.fixture(scope="module")
def ahead():
    return Ahead(Config(), shortest_s=0.6)


def marker(trial):
    return of_move("s01", scenario="iC", block=2, episode=1, trial=trial, practice=False)


def go(index, start, end, **changes):
    return dataclasses.replace(Go(index, start, end, 0.7, marker(index)), **changes)


class Flow:
    """Asks for one thing after the other, the next one when the one before has ended."""

    def __init__(self, wanted):
        self.wanted = list(wanted)
        self.reports, self.asked = [], []
        self.free = False

    def send(self, report):
        self.reports.append(report)
        self.free = self.free or isinstance(report, Ready | Arrived | Executed)

    def ask(self, now):
        self.asked.append(now)
        if not (self.free and self.wanted):
            return None
        request = self.wanted.pop(0)
        # Of these nothing is reported.
        self.free = isinstance(request, Mark | Truth)
        return request

    def of(self, kind):
        return [report for report in self.reports if isinstance(report, kind)]


def a_session(first=100):
    moves = [go(first + i, a, b) for i, (a, b) in enumerate(itertools.pairwise(WAY))]
    return [Approach(WAY[0]), moves[0], Mark("key/N", 1.0), Truth({"marker": "x"}), *moves[1:], Finish()]


@pytest.fixture
def run(ahead, tmp_path):
    def run(wanted, *, gone=str, flow=None, **changes):
        config = dataclasses.replace(Config(rescue_folder=str(tmp_path / "kept")), **changes)
        flow = flow or Flow(wanted)
        ahead.restart()
        arm_side.run(ArmSettings(config, "s01", real_time=False), flow.send, flow.ask, ahead=ahead, gone=gone)
        return flow

    return run


@pytest.fixture
def on_virtual_arm(monkeypatch):
    """Let a session of any backend drive the simulated arm, so that it takes no real time."""

    def use(*disturbances):
        def arm(connection, workspace, stack, **_):
            clock = VirtualClock()
            return SimArm(clock, workspace.home().tolist(), disturbances=disturbances), clock

        monkeypatch.setattr(arm_side, "held_arm", arm)

    return use


def test_a_session_is_reported_in_order_with_the_flows_own_numbers(run):
    flow = run(a_session())
    told = [report for report in flow.reports if not isinstance(report, Health)]
    kinds = ["Ready", "Arrived", *["Onset", "InRadius", "Executed"] * 4, "Ended"]
    assert [type(report).__name__ for report in told] == kinds
    assert [report.index for report in told if hasattr(report, "index")] == sorted([100, 101, 102, 103] * 3)
    times = [report.when for report in told]
    assert times == sorted(times)
    for onset, near, done in zip(flow.of(Onset), flow.of(InRadius), flow.of(Executed), strict=True):
        assert near.when - onset.when == pytest.approx(0.846 * 0.7, abs=0.02)
        assert done.when - onset.when == pytest.approx(0.7, abs=0.06)
        assert math.isnan(onset.marked)
    assert flow.of(Ready)[0].lead == pytest.approx(0.027, abs=1e-3)


def test_the_flow_is_asked_once_a_cycle_while_the_arm_moves_and_rests(run):
    """So a key, a mark, or the wish to end comes to the arm's side within a cycle."""
    flow = run(a_session())
    steps = np.diff(sorted(set(flow.asked)))
    assert steps == pytest.approx(PERIOD)
    assert flow.asked[-1] - flow.asked[0] > 6.0


def test_a_move_begins_at_once_or_when_it_may(run):
    flow = run([go(0, (3, 3), (3, 4)), go(1, (3, 4), (3, 3)), go(2, (3, 3), (3, 4), not_before=12.0), Finish()])
    onset, done = flow.of(Onset), flow.of(Executed)
    assert onset[1].when - done[0].when <= 2 * PERIOD
    assert onset[2].when == pytest.approx(12.0, abs=2 * PERIOD)


def test_the_arms_health_is_told_a_few_times_a_second(run):
    health = run(a_session()).of(Health)
    assert np.diff([report.when for report in health]) == pytest.approx(0.25, abs=PERIOD)
    assert 1e-4 < max(report.path_error for report in health) < 4e-3
    assert {report.packet_age for report in health} == {0.0}


@pytest.mark.parametrize(
    ("request_", "match"),
    [
        (go(0, (3, 3), (3, 4), t_f=0.1), r"t_f 0\.1 s from tile \(3, 3\) to \(3, 4\) asks joint"),
        (go(0, (3, 3), (3, 5)), r"from tile \(3, 3\) to \(3, 5\); a move goes to a tile beside it"),
        (go(0, (2, 2), (2, 3)), r"move 0 begins over tile \(2, 2\); the arm will be over \(3, 3\)"),
        (Approach((0, 7)), r"tile \(0, 7\) lies off the grid"),
    ],
)
def test_what_the_arm_cannot_do_is_refused_before_it_is_asked(ahead, request_, match):
    ahead.restart()
    with pytest.raises(ConfigError, match=match) as caught:
        ahead.check(request_)
    assert caught.value.cure
    # Nothing was asked for: the arm still stands where it did.
    ahead.check(go(0, (3, 3), (3, 4)))


def test_a_refused_request_ends_the_session_at_rest(run):
    flow = run([go(0, (3, 3), (3, 4)), go(1, (3, 4), (3, 5), t_f=0.1)])
    (halted,) = flow.of(Halted)
    assert "t_f 0.1 s" in halted.problem
    assert "robot.t_f_s of at least" in halted.cure
    assert halted.rests
    assert len(flow.of(Executed)) == 1
    assert flow.reports[-1] is halted


@pytest.mark.parametrize(
    ("changes", "match"),
    [({"max_acceleration": 1.0}, "asks joint"), ({"max_path_error_mm": 0.5}, "off its path")],
)
def test_a_grid_that_the_arm_cannot_serve_is_refused_before_a_session(changes, match):
    with pytest.raises(ConfigError, match=match) as caught:
        Ahead(dataclasses.replace(Config(), **changes), shortest_s=0.6)
    assert caught.value.cure


def test_a_fault_halts_the_arm_and_says_what_to_do(run, on_virtual_arm, capsys):
    on_virtual_arm(Disturbance("protective_stop", 6.0))
    flow = run(a_session())
    (halted,) = flow.of(Halted)
    assert "the arm went into a protective stop" in halted.problem
    assert "unlock the protective stop on the pendant" in halted.cure
    assert halted.rests
    assert 6.0 <= halted.when < 6.3
    assert not flow.of(Ended)
    words = capsys.readouterr().err.splitlines()
    assert words[0].startswith("experiment s01: the arm went into a protective stop")
    assert words[2] == "experiment s01: the arm is at rest"


def test_where_nobody_asks_any_more_the_arm_is_halted(run):
    flow = Flow(a_session())
    run([], flow=flow, gone=lambda: "the experiment has ended" if flow.of(Onset) else "")
    (halted,) = flow.of(Halted)
    assert "the experiment has ended" in halted.problem
    assert halted.rests
    assert halted.when - flow.of(Onset)[0].when < 0.25


def test_ctrl_c_leaves_the_arm_at_rest(run):
    flow = Flow(a_session())

    def interrupt():
        if flow.of(Onset):
            raise KeyboardInterrupt
        return ""

    with pytest.raises(KeyboardInterrupt):
        run([], flow=flow, gone=interrupt)
    assert [halted.rests for halted in flow.of(Halted)] == [True]


def test_what_an_arm_did_is_kept_with_its_moves(run, on_virtual_arm, tmp_path):
    on_virtual_arm()
    flow = run(a_session(), backend="ursim", patient=True)
    assert flow.of(Ended)
    (place,) = (tmp_path / "kept" / "s01").iterdir()
    moves = pd.read_parquet(place / "moves.parquet")
    assert moves["move"].tolist() == [0, 1, 2, 3]
    assert set(moves["block"]) == {2}
    assert moves["trial"].tolist() == [100, 101, 102, 103]
    assert moves["clamped"].tolist() == [False, True, False, False]
    assert moves["onset_s"].tolist() == pytest.approx([report.when for report in flow.of(Onset)])
    telemetry = pd.read_parquet(place / "telemetry.parquet")
    assert set(telemetry["move"]) == {-1, 0, 1, 2, 3}
    assert not list(place.glob("*.arrows"))


def test_an_arm_that_did_not_move_leaves_no_recording(run, on_virtual_arm, tmp_path):
    on_virtual_arm(Disturbance("emergency_stop", 0.0))
    (halted,) = run(a_session(), backend="ursim", patient=True).of(Halted)
    assert "emergency stop" in halted.problem
    assert list((tmp_path / "kept" / "s01").iterdir()) == []
