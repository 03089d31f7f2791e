"""One request at a time from outside: the same motions as a replay, and what is told of them."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from hrcneuro.paradigm.timing import IN_RADIUS
from hrcneuro.robot.backend import PERIOD, Cause, Stopped
from hrcneuro.robot.events import Approach, Arrived, Finish, InRadius, Ready
from hrcneuro.robot.kinematics import forward
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.requests import Make
from hrcneuro.robot.session import ExecutedMove, run_session, serve

PACE = Pace(pause_s=0.1)


def move(start, end, *, first=False, t_f=0.7, gap=np.nan) -> PlannedMove:
    return PlannedMove("iC", False, 1, 1, 0, start, end, first, t_f, gap)


MOVES = [
    move((1, 1), (1, 2), first=True, gap=1.0),
    move((1, 2), (2, 2)),
    move((2, 2), (2, 2), gap=0.8),
    move((2, 2), (3, 2)),
    move((3, 2), (3, 3), gap=0.72),
    move((0, 6), (0, 6), first=True, t_f=0.6),
    move((0, 6), (1, 6)),
]


class Outside:
    """Asks as an experiment does: it knows what comes next only once the move before is near its goal, or has ended."""

    def __init__(self, moves, pace):
        self.moves, self.pace, self.events, self.onsets = list(moves), pace, [], {}
        self.waiting, self.asked = [], 0

    def onset(self, age, index):
        self.onsets[index] = True

    def tell(self, event):
        self.events.append(event)
        if isinstance(event, InRadius) and self.pace.start_next == "in_radius":
            self.decide(event.index)
        if isinstance(event, Ready):
            self.waiting.append(Approach(self.moves[0].start))
        elif isinstance(event, Arrived):
            self.waiting.append(Make(self.asked, self.moves[self.asked], event.when + PERIOD + self.pace.pause_s))
        elif isinstance(event, ExecutedMove) and self.pace.start_next == "at_rest":
            self.decide(event.index, began=event.began)

    def decide(self, index, *, began=None):
        self.asked = index + 1
        if self.asked == len(self.moves):
            self.waiting.append(Finish())
        elif self.moves[self.asked].first:
            self.waiting.append(Approach(self.moves[self.asked].start))
        else:
            gap = self.moves[index].gap
            due = began + gap if began is not None and np.isfinite(gap) else -np.inf
            self.waiting.append(Make(self.asked, self.moves[self.asked], due))

    def __call__(self, now, moving):
        return self.waiting.pop(0) if self.waiting else None


def served(make_loop, workspace, moves, pace=PACE, **changes):
    outside = Outside(moves, pace)
    loop = make_loop(workspace.home(), on_onset=outside.onset, **changes)
    with loop:
        serve(loop, workspace, outside, lead=0.027, most_lead=0.05, pace=pace, tell=outside.tell)
    return loop, outside


def of(outside, kind):
    return [event for event in outside.events if isinstance(event, kind)]


def test_requests_one_by_one_move_the_arm_as_a_replay_does(make_loop, workspace):
    replayed = make_loop(workspace.home())
    with replayed:
        run_session(
            replayed, workspace, MOVES, lead=0.027, most_lead=0.05, pace=PACE, on_executed=lambda executed: None
        )
    loop, outside = served(make_loop, workspace, MOVES)
    assert len(of(outside, ExecutedMove)) == len(MOVES)
    assert bytes(loop.record.rows(0)) == bytes(replayed.record.rows(0))


def test_what_happens_is_told_in_order(make_loop, workspace):
    _, outside = served(make_loop, workspace, MOVES)
    kinds = [type(event).__name__ for event in outside.events]
    a_move, stays = ["InRadius", "ExecutedMove"], ["Stays", "InRadius", "ExecutedMove"]
    assert kinds == ["Ready", "Arrived", *a_move, *a_move, *stays, *a_move, *a_move, "Arrived", *stays, *a_move]
    assert sorted(outside.onsets) == [i for i, one in enumerate(MOVES) if not one.dwells]
    times = [event.track.end if isinstance(event, ExecutedMove) else event.when for event in outside.events]
    assert times == sorted(times)


def test_in_radius_is_the_first_cycle_within_two_millimetres(make_loop, workspace):
    """Also while the arm stays, keys are accepted when they would be after a move."""
    loop, outside = served(make_loop, workspace, MOVES)
    telemetry = loop.record.telemetry()
    off = {
        one.index: np.linalg.norm(forward(telemetry.q, tool=0.1)[:, :3, 3] - workspace.position(*one.move.end), axis=1)
        for one in of(outside, ExecutedMove)
    }
    tracks = {one.index: one.track for one in of(outside, ExecutedMove)}
    for event in of(outside, InRadius):
        track, planned = tracks[event.index], MOVES[event.index]
        if planned.dwells:
            assert event.when - track.start == pytest.approx(IN_RADIUS * planned.t_f, abs=PERIOD)
            continue
        inside = np.flatnonzero(off[event.index][track.first : track.last] <= 2e-3)
        assert event.when == telemetry.time[track.first + inside[0]]
        assert event.when - track.onset == pytest.approx(IN_RADIUS * planned.t_f, abs=0.02)


def test_within_the_radius_a_move_takes_over_what_else_waits_for_rest(make_loop, workspace):
    pace = dataclasses.replace(PACE, start_next="in_radius")
    loop, outside = served(make_loop, workspace, [dataclasses.replace(one, gap=np.nan) for one in MOVES], pace)
    executed = of(outside, ExecutedMove)
    assert [one.flowed for one in executed] == [False, True, False, False, True, False, False]
    for before, after in itertools.pairwise(executed):
        if after.flowed:
            assert after.track.first == before.track.last
            assert loop.record.telemetry().command[before.track.last - 1].any()
    assert len(of(outside, InRadius)) == len(MOVES)


def test_the_source_is_asked_in_every_cycle_at_rest(make_loop, workspace):
    asked, loop = [], make_loop(workspace.home())

    def source(now, moving):
        asked.append((now, moving))
        return Finish() if len(asked) == 50 else None

    with loop:
        serve(loop, workspace, source, lead=0.027, most_lead=0.05, pace=PACE, tell=lambda event: None)
    assert np.diff([now for now, _ in asked]) == pytest.approx(PERIOD)
    assert not any(moving for _, moving in asked)


@pytest.mark.parametrize(
    ("request_", "match"),
    [
        (Make(0, move((1, 1), (1, 2))), r"move 0 goes from tile \(1, 1\) to \(1, 2\); the arm stands over \(3, 3\)"),
        (Make(0, move((3, 3), (3, 5))), r"from tile \(3, 3\) to \(3, 5\); .* a move goes one tile"),
        (Approach((3, 7)), r"tile \(3, 7\), which lies off the grid"),
    ],
)
def test_what_does_not_follow_from_where_the_arm_stands_moves_nothing(make_loop, workspace, request_, match):
    loop, rows = make_loop(workspace.home()), []

    def source(now, moving):
        rows.append(len(loop.record))
        return request_

    with pytest.raises(ValueError, match=match), loop:
        serve(loop, workspace, source, lead=0.027, most_lead=0.05, pace=PACE, tell=lambda event: None)
    assert not loop.record.telemetry(rows[0]).command.any()


def test_an_arm_that_nobody_asks_any_more_comes_to_a_controlled_rest(make_loop, workspace):
    """In the midst of a move, within a quarter of a second and without a jolt."""
    told = []
    loop = make_loop(workspace.home(), on_cycle=lambda now: "nobody asks" if now >= 4.0 else "", on_rest=told.append)
    moves = [move((3, 3), (3, 4), first=True)] + [move((3, 4), (3, 3)), move((3, 3), (3, 4))] * 3
    outside = Outside(moves, PACE)
    with pytest.raises(Stopped, match="nobody asks; the arm was stopped") as caught, loop:
        serve(loop, workspace, outside, lead=0.027, most_lead=0.05, pace=PACE, tell=outside.tell)
    assert (caught.value.cause, caught.value.rests, told) == (Cause.ALONE, True, [True])
    telemetry = loop.record.telemetry()
    after = telemetry.time >= 4.0
    assert np.abs(telemetry.command[after]).max() > 0.05, "it was moving"
    assert telemetry.time[-1] - 4.0 < 0.25
    assert np.abs(telemetry.qd[-1]).max() < 1e-3
    assert np.abs(np.diff(telemetry.command[after], axis=0)).max() / PERIOD < 9.0


def test_the_worst_is_of_the_time_since_it_was_last_asked_for(make_loop, workspace):
    loop = make_loop(workspace.home())
    found = []
    loop._on_cycle = lambda now: found.append(loop.worst()) or "" if len(loop.record) % 25 == 0 else ""
    outside = Outside(MOVES[:3], PACE)
    with loop:
        serve(loop, workspace, outside, lead=0.027, most_lead=0.05, pace=PACE, tell=outside.tell)
    off = [worst.off for worst in found]
    assert 5e-4 < max(off) < 3e-3
    assert min(off) < 1e-4
    assert {round(worst.late, 9) for worst in found} == {0.0}
