"""What the arm cannot do is refused before it is asked, and each way is rehearsed once."""

from __future__ import annotations

import contextlib

import pytest

from hrcneuro.robot import lookahead as module
from hrcneuro.robot.assembly import rehearsing
from hrcneuro.robot.backend import Cause
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.lookahead import LookAhead
from hrcneuro.robot.parameters import Pace, Safety
from hrcneuro.robot.plan import PlannedMove, TooQuick
from hrcneuro.robot.rehearsal import Foreseen
from hrcneuro.robot.tracking import Tracking
from hrcneuro.robot.workspace import Flaw, WayError, Workspace

PACE, SAFETY = Pace(), Safety()


@pytest.fixture
def look(workspace, monkeypatch):
    """Return a factory of what looks ahead, with a list of the ways that it drives."""

    def make(pace=PACE, *, safety=SAFETY, place=workspace):
        driven = []
        drive = module.rehearsal.drive
        monkeypatch.setattr(
            module.rehearsal,
            "drive",
            lambda way, *given, **named: (driven.append(way.name), drive(way, *given, **named)),
        )
        loops = rehearsing(place, tracking=Tracking(), safety=safety)
        ahead = LookAhead(place, pace=pace, acceleration=safety.max_acceleration, lead_given=True, make_loop=loops)
        return ahead, driven

    return make


def test_a_way_is_driven_once_for_each_quicker_duration(look):
    ahead, driven = look()
    for t_f in (0.8, 0.9, 0.8, 0.7, 0.75):
        ahead.move((3, 3), (3, 4), t_f)
    assert [name.rpartition(" in ")[2] for name in driven] == ["0.8 s", "0.7 s"]
    ahead.move((3, 4), (3, 4), 0.01)
    ahead.approach((0, 0), (5, 2))
    ahead.approach((0, 0), (5, 2))
    ahead.approach((2, 2), (2, 2))
    assert len(driven) == 3


def test_after_the_whole_grid_no_move_needs_to_be_driven(look):
    ahead, driven = look()
    ahead.grid(0.6)
    moves = [name for name in driven if name.startswith("in the move")]
    assert len(moves) == len(set(moves)) == 2 * 84
    before = len(driven)
    ahead.move((6, 6), (6, 5), 0.6)
    assert len(driven) == before


@pytest.mark.parametrize(
    ("start", "end", "t_f", "match"),
    [
        ((3, 3), (3, 4), 0.1, r"t_f 0\.1 s from tile \(3, 3\) to \(3, 4\) asks joint \d for"),
    ],
)
def test_a_move_too_quick_for_a_joint_is_refused(look, start, end, t_f, match):
    ahead, driven = look()
    with pytest.raises(TooQuick, match=match) as caught:
        ahead.move(start, end, t_f)
    assert t_f < caught.value.least_s < 0.5
    assert not driven
    ahead.move(start, end, caught.value.least_s)


def test_a_session_whose_shortest_move_is_too_quick_does_not_begin(look):
    ahead, _ = look()
    with pytest.raises(TooQuick, match=r"t_f 0\.15 s"):
        ahead.grid(0.15)


def test_moves_go_to_a_neighbour_on_the_grid(look):
    ahead, driven = look()
    with pytest.raises(ValueError, match=r"from tile \(3, 3\) to \(3, 5\)"):
        ahead.move((3, 3), (3, 5), 0.9)
    with pytest.raises(ValueError, match=r"tile \(7, 3\) lies off the grid; rows and columns go from 0 to 6"):
        ahead.move((6, 3), (7, 3), 0.9)
    with pytest.raises(ValueError, match=r"tile \(-1, 0\) lies off the grid"):
        ahead.approach((0, 0), (-1, 0))
    assert not driven


def test_a_way_near_a_singularity_is_refused(look, workspace):
    """The far corners are singular enough for a cell that asks for more; the way there says so, with its tiles."""
    place = Workspace(Cell())
    least = place.reach.singular_value[6, 0]
    place.cell = Cell(min_singular_value=float(least) + 1e-3)
    ahead, driven = look(place=place)
    with pytest.raises(WayError, match=r"from tile \(3, 3\) to \(6, 0\) the way leads through") as caught:
        ahead.approach((3, 3), (6, 0))
    assert caught.value.flaw is Flaw.SINGULAR
    assert not driven


def test_an_approach_that_a_limit_would_stop_is_foreseen(look):
    """The stop of so quick an approach does not fit between the outer tiles and the side of the box."""
    pace = Pace(approach_speed=1.0, approach_acceleration=5.0, approach_jerk=100.0)
    safety = Safety(stop_deceleration=0.5, stop_jerk=5.0)
    ahead, _ = look(pace, safety=safety)
    with pytest.raises(Foreseen, match=r"on the approach from tile \(3, 3\) to \(0, 3\) .* it was not begun") as caught:
        ahead.approach((3, 3), (0, 3))
    assert caught.value.cause is Cause.OUT_OF_BOX
    with pytest.raises(Foreseen, match="nothing has moved"):
        ahead.grid(0.6)


FLOWING = Pace(start_next="in_radius")
FORTH, BACK = ((5, 6), (6, 6)), ((6, 6), (5, 6))


def weak(workspace, pace):
    """Return what looks ahead for joints that accelerate enough from rest, and not enough to turn back on the move."""
    loops = rehearsing(workspace, tracking=Tracking(), safety=Safety(max_acceleration=7.0))
    return loops, LookAhead(workspace, pace=pace, acceleration=12.0, lead_given=True, make_loop=loops)


def test_a_move_that_takes_over_without_rest_is_looked_ahead_to_as_it_will_be_made(workspace):
    _, ahead = weak(workspace, FLOWING)
    for way in (FORTH, BACK):
        ahead.move(*way, 0.45)
    with pytest.raises(Foreseen, match=r"from tile \(6, 6\) to \(5, 6\) in 0\.45 s, on the move after that") as caught:
        ahead.move(*BACK, 0.45, after=(FORTH[0], 0.45))
    assert caught.value.cause is Cause.OFF_PATH
    assert "it was not begun" in str(caught.value)
    _, ahead = weak(workspace, PACE)
    ahead.move(*BACK, 0.45, after=(FORTH[0], 0.45))


def test_so_is_one_of_a_replay(workspace):
    moves = [
        PlannedMove("", False, 1, 1, trial, start, end, trial == 0, 0.45, 0.5)
        for trial, (start, end) in enumerate([FORTH, BACK])
    ]
    for pace, stopped in ((PACE, False), (FLOWING, True)):
        loops, _ = weak(workspace, pace)
        expected = pytest.raises(Foreseen, match="on the move after that") if stopped else contextlib.nullcontext()
        with expected:
            module.rehearsal.rehearse(moves, workspace, pace=pace, lead_given=True, make_loop=loops)


def test_where_moves_flow_each_is_tried_behind_each_other_before_a_session_and_then_no_more(workspace, monkeypatch):
    _, ahead = weak(workspace, FLOWING)
    driven = []
    monkeypatch.setattr(module.rehearsal, "drive", lambda way, *given, **named: driven.append(way.name))
    ahead.grid(0.6)
    # A tile's neighbours, squared: four corners, twenty tiles at an edge, 25 within.
    assert sum("on the move after that" in name for name in driven) == 4 * 4 + 20 * 9 + 25 * 16
    before = len(driven)
    ahead.move((3, 3), (3, 4), 0.6, after=((2, 3), 0.7))
    assert len(driven) == before
