import dataclasses
import json

import numpy as np
import pandas as pd
import pytest

from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.parameters import Durations, Selection
from hrcneuro.robot.plan import TooQuick, check_durations, check_paths, evoking, grid_moves, plan, sampling_rate, select
from hrcneuro.robot.workspace import Flaw, WayError, Workspace

LOGGED = Durations()


def log(**changes) -> pd.DataFrame:
    """Two episodes: (3,3) north, east, clamped; then one that begins with a clamped move in the corner."""
    table = {
        "scenario": ["iC"] * 3 + ["sC"] * 2,
        "practice": [False] * 5,
        "block": [1, 1, 1, 2, 2],
        "episode": [1, 1, 1, 4, 4],
        "trial": [0, 1, 2, 0, 1],
        "row": [2, 2, 2, 0, 1],
        "col": [3, 4, 4, 0, 0],
        "executed": ["N", "E", None, None, "S"],
    }
    return pd.DataFrame(table | changes)


def test_each_move_starts_where_the_last_one_ended():
    moves = plan(log(), LOGGED)
    assert [(m.start, m.end) for m in moves] == [
        ((3, 3), (2, 3)),
        ((2, 3), (2, 4)),
        ((2, 4), (2, 4)),
        ((0, 0), (0, 0)),
        ((0, 0), (1, 0)),
    ]
    assert [m.first for m in moves] == [True, False, False, True, False]
    assert [m.dwells for m in moves] == [False, False, True, True, False]


def test_a_marker_names_its_move():
    one, *_, last = plan(log(practice=[False] * 4 + [True], episode=[1, 1, 1, 4, 5], executed=["N", "E", *[None] * 3]),
                         LOGGED)  # fmt: skip
    assert one.marker("s01") == "move/subject=s01/scenario=iC/block=1/episode=1/trial=0"
    assert last.marker("s02") == "move/subject=s02/scenario=sC/block=2/episode=5/trial=1/practice"


def test_the_rate_of_the_recording_comes_from_its_onsets():
    onsets = np.array([3.2, 700.0, np.nan, 2911.25, 5000.0])
    table = log(onset_s=np.round(onsets, 3), onset_sample=np.rint(onsets * 512))
    assert sampling_rate(table) == 512.0
    assert np.isnan(sampling_rate(log(onset_s=onsets, onset_sample=[None] * 5)))
    assert np.isnan(sampling_rate(log()))


def test_durations_come_from_the_log_then_the_gaps_then_the_default():
    assert {m.t_f for m in plan(log(), LOGGED)} == {0.9}
    gaps = log(soa_s=[0.5, 0.8, np.nan, 7.0, np.nan])
    assert [m.t_f for m in plan(gaps, LOGGED)] == [0.6, 0.8, 0.9, 1.2, 0.9]
    known = gaps.assign(t_f_s=[0.7, np.nan, 0.75, 1.1, 0.6])
    assert [m.t_f for m in plan(known, LOGGED)] == [0.7, 0.8, 0.75, 1.1, 0.6]
    assert {m.t_f for m in plan(known, Durations(t_f_s=1.0))} == {1.0}
    assert [m.gap for m in plan(gaps, LOGGED)][:2] == [0.5, 0.8]


def test_a_log_that_jumps_is_refused():
    with pytest.raises(ValueError, match=r"block 1, episode 1, trial 1: the log jumps from tile \(2, 3\) to \(2, 6\)"):
        plan(log(col=[3, 6, 4, 0, 0]), LOGGED)


def test_a_move_off_the_grid_is_refused():
    with pytest.raises(ValueError, match=r"leaves the 7 × 7 grid"):
        plan(log(row=[6, 6, 6, 0, 1]), LOGGED)


def test_a_foreign_study_has_nothing_to_replay():
    foreign = log(row=[None] * 5, col=[None] * 5)
    with pytest.raises(ValueError, match=r"no moves in the trial table \(5 rows"):
        grid_moves(foreign)
    assert len(grid_moves(log(row=[2, None, 2, 0, 1]))) == 4


def test_selection():
    table = log(practice=[True, True, True, False, False])
    everything = Selection(practice=True)
    assert len(select(table, everything)) == 5
    assert len(select(table, Selection())) == 2
    assert len(select(table, dataclasses.replace(everything, blocks=(1,)))) == 3
    assert len(select(table, dataclasses.replace(everything, episodes=(4,)))) == 2
    with pytest.raises(ValueError, match=r"^blocks: \[13\] not in the log, which has 1 … 2$"):
        select(table, dataclasses.replace(everything, blocks=(13,)))
    with pytest.raises(ValueError, match=r"^episodes: \[4\] not in the log, which has 1$"):
        select(table, Selection(blocks=(1,), episodes=(4,), practice=True))
    with pytest.raises(ValueError, match="leave no move"):
        select(log(practice=[True] * 5), Selection())


def test_a_t_f_that_breaks_a_limit_is_refused_with_the_least_that_does_not(workspace):
    moves = plan(log(), Durations(t_f_s=0.2))
    with pytest.raises(TooQuick, match=r"t_f 0.2 s from tile .* asks joint 3 for .* rad/s²; it may do 3.14 and 12"
                       ) as caught:  # fmt: skip
        check_durations(moves, workspace, acceleration=12.0)
    least = caught.value.least_s
    check_durations(plan(log(), Durations(t_f_s=least)), workspace, acceleration=12.0)
    with pytest.raises(TooQuick):
        check_durations(plan(log(), Durations(t_f_s=least - 0.02)), workspace, acceleration=12.0)


def test_only_clamped_moves_ask_for_nothing(workspace):
    check_durations([m for m in plan(log(), LOGGED) if m.dwells], workspace, acceleration=1.0)


def test_ways_are_checked_before_anything_moves(workspace, monkeypatch):
    """Moves and approaches alike. The cell is sound, so doubt is sown: each way is then looked at, and one fails."""
    moves = plan(log(), LOGGED)
    check_paths(moves, workspace)
    asked = []

    def refuse(start, end, *, near):
        asked.append((workspace.tile(start), workspace.tile(end)))
        if asked[-1] == ((2, 4), (0, 0)):
            raise WayError(Flaw.SINGULAR, "the way leads through here")

    monkeypatch.setattr(workspace, "check_way", refuse)
    monkeypatch.setattr(workspace, "doubtful", lambda starts, ends: np.ones(len(starts), bool))
    with pytest.raises(WayError, match=r"from tile \(2, 4\) to \(0, 0\) the way leads through here") as caught:
        check_paths(moves, workspace)
    assert caught.value.flaw is Flaw.SINGULAR
    assert asked == [((3, 3), (3, 3)), ((3, 3), (2, 3)), ((2, 3), (2, 4)), ((2, 4), (0, 0))]


def test_doubt_falls_on_the_ways_that_the_slow_check_refuses():
    """The quick check of all ways at once against the one that walks them, where the arm is nearly stretched out."""
    near = Workspace(Cell(min_singular_value=0.0))
    starts, ends = (np.array([(r, c) for r in range(7) for c in range(7)]) for _ in range(2))
    ends = ends[::-1]
    near.cell = dataclasses.replace(near.cell, min_singular_value=0.2)
    doubtful = near.doubtful(starts, ends)
    assert 0 < doubtful.sum() < len(doubtful)
    for start, end, doubt in zip(map(tuple, starts), map(tuple, ends), doubtful, strict=True):
        try:
            near.check_way(near.position(*start), near.position(*end), near=near.reach.q[start])
            refused = False
        except WayError:
            refused = True
        assert refused == doubt


def test_what_a_move_evokes_is_its_row_s_in_plain_values():
    trials = simulate_session(
        SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2), rng=np.random.default_rng(1)
    )
    moves = plan(grid_moves(trials), Durations())
    rows = evoking(moves, trials)
    assert json.loads(json.dumps(rows)) == rows
    assert [row["actor"] for row in rows] == trials["actor"].tolist()
    assert sum(row["condition_before"] is None for row in rows) == trials["condition_before"].isna().sum()
