from dataclasses import replace

import numpy as np
import pytest

from hrcneuro.paradigm.grid import SIZE
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.kinematics import forward, jacobian
from hrcneuro.robot.workspace import DOWN, CellError, Flaw, Workspace, refine, workspace_of

TILES = list(np.ndindex(SIZE, SIZE))
WAYS = [((r, c), (r + dr, c + dc)) for r, c in TILES for dr, dc in ((0, 1), (1, 0)) if r + dr < SIZE and c + dc < SIZE]


def test_tiles_stand_where_the_paper_puts_them(workspace):
    x = [-workspace.position(row, 3)[0] for row in range(SIZE)]
    assert x[0] - 0.035 == pytest.approx(0.76)
    assert x[-1] + 0.035 == pytest.approx(1.25)
    assert np.diff(x) == pytest.approx(0.07)
    # 0.60 m of table and screen plus 2 cm, seen from a base at 0.70 m
    assert workspace.position(0, 0)[2] == pytest.approx(-0.08)
    # column 0, the subject's left, is the arm's right: +y of a frame whose -x points to the subject
    assert workspace.position(0, 0)[1] == pytest.approx(0.21)


def test_tile_and_position_are_inverse(workspace):
    rng = np.random.default_rng(1)
    for tile in TILES:
        near = np.array(workspace.position(*tile)) + rng.uniform(-0.034, 0.034, 3)
        assert workspace.tile(near) == tile


def test_every_tile_is_reached_pointing_down(workspace):
    pose = forward(workspace.reach.q, tool=0.10)
    for row, col in TILES:
        assert np.allclose(pose[row, col, :3, 3], workspace.position(row, col), atol=1e-10)
    assert np.allclose(pose[..., :3, :3], DOWN, atol=1e-10)


def test_singular_values_as_measured(workspace):
    """Published with this cell: >= 0.168 and condition <= 12.7, at the flange; at the tip they are a little worse."""
    values = np.linalg.svd(jacobian(workspace.reach.q), compute_uv=False)
    assert values[..., -1].min() == pytest.approx(0.168, abs=1e-3)
    assert (values[..., 0] / values[..., -1]).max() == pytest.approx(12.7, abs=0.05)
    assert workspace.reach.singular_value.min() == pytest.approx(0.165, abs=1e-3)
    assert workspace.reach.condition.max() == pytest.approx(13.2, abs=0.05)


@pytest.mark.parametrize("base_height", [0.50, 0.90])
def test_other_heights_of_the_base_reach_too(base_height):
    values = np.linalg.svd(jacobian(Workspace(Cell(base_height=base_height)).reach.q), compute_uv=False)
    assert values.min() >= 0.1455


def test_joint_peaks_over_all_84_moves(workspace):
    """Peaks at t_f = 0.6 s: 0.87 rad/s and 4.94 rad/s², on the elbow."""
    starts, ends = np.array([w[0] for w in WAYS]), np.array([w[1] for w in WAYS])
    assert len(starts) == 84
    speed, bend = workspace.move_peaks(starts, ends)
    assert speed.max() / 0.6 == pytest.approx(0.87, abs=0.005)
    assert bend.max() / 0.6**2 == pytest.approx(4.94, abs=0.02)
    assert (np.argmax(speed.max(axis=0)), np.argmax(bend.max(axis=0))) == (2, 2)


def test_a_cell_on_the_floor_is_out_of_reach():
    with pytest.raises(CellError, match=r"does not reach tile \(\d, \d\)") as caught:
        Workspace(Cell(base_height=0.0, near_edge=1.1))
    assert caught.value.flaw is Flaw.OUT_OF_REACH


def test_a_singular_region_is_refused():
    with pytest.raises(CellError, match=r"smallest singular value .* is 0.165; at least 0.3 ") as caught:
        Workspace(Cell(min_singular_value=0.3))
    assert caught.value.flaw is Flaw.SINGULAR


def test_a_box_without_room_is_refused():
    with pytest.raises(CellError, match=r"keep-inside box reaches from 0\.03 to 0\.4 m") as caught:
        Workspace(Cell(floor=0.03))
    assert caught.value.flaw is Flaw.NO_ROOM


def test_home_is_above_the_centre_and_inside(workspace):
    tip = forward(workspace.home(), tool=0.10)[:3, 3]
    assert tip[2] == pytest.approx(0.60 + 0.12 - 0.70)
    assert workspace.inside(tip)
    assert not workspace.inside(tip + (0, 0, 0.5))


def test_refine_converges_from_a_linear_guess(workspace):
    target = forward(workspace.reach.q[:1, :1], tool=0.1)
    q = refine(workspace.reach.q[:1, :1] + 0.02, target, tool=0.1)
    assert np.allclose(forward(q, tool=0.1), target, atol=1e-12)


def test_peaks_of_moves_do_not_depend_on_which_were_asked_for_before(workspace):
    starts, ends = np.array([(3, 3), (3, 4), (0, 0)]), np.array([(3, 4), (3, 3), (1, 0)])
    fresh, again = Workspace(workspace.cell), Workspace(workspace.cell)
    together = fresh.move_peaks(starts, ends)
    for i in (2, 0, 1):
        alone = again.move_peaks(starts[i : i + 1], ends[i : i + 1])
        assert all(np.array_equal(a[i : i + 1], b) for a, b in zip(together, alone, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(together, again.move_peaks(starts, ends), strict=True))
    assert again.move_peaks(starts[:0], ends[:0])[0].shape == (0, 6)


def test_a_cell_is_solved_once(workspace):
    assert workspace_of(workspace.cell) is workspace_of(replace(workspace.cell))
