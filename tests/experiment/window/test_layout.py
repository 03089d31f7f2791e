"""Where things lie: true size, under the arm, however the screen lies on the table."""

import itertools

import pytest

from hrcneuro import published
from hrcneuro.experiment.window.layout import Layout, as_large_as_fits, laid_out, needed
from hrcneuro.paradigm.grid import SIZE, STEPS
from hrcneuro.robot.cell import Cell

SCREENS = [(1920, 1080), (1280, 720), (3840, 2160), (1280, 1024), (1080, 1920), (1024, 768)]
TURNS = (0, 90, 180, 270)


@pytest.mark.parametrize("per_metre", [1920 / 0.930, 1375.3, 3840 / 0.943])
def test_the_grid_has_its_true_size_in_the_middle(per_metre):
    layout = laid_out((3840, 2160), per_metre)
    left, top, width, height = layout.grid
    assert width / per_metre == pytest.approx(published.GRID_EDGE_M.value, abs=1 / per_metre)
    assert height == pytest.approx(width, abs=1)
    assert left + width / 2 == pytest.approx(1920, abs=1)
    assert top + height / 2 == pytest.approx(1080, abs=1)


def test_tiles_meet_without_gap_and_fill_the_grid():
    layout = laid_out((1920, 1080), 2064.7)
    covered = {(x, y) for row, col in itertools.product(range(SIZE), repeat=2) for x, y in [layout.box(row, col)[:2]]}
    assert len(covered) == SIZE**2
    area = sum(w * h for row, col in itertools.product(range(SIZE), repeat=2) for _, _, w, h in [layout.box(row, col)])
    assert area == layout.grid[2] * layout.grid[3]


def seen_by_the_person(position):
    """Return how far right and how far away a place in the arm's frame is for the person, who looks along +x."""
    x, y, _ = position
    return -y, x


@pytest.mark.parametrize("turn", TURNS)
def test_drawn_tiles_lie_under_the_arms_tiles(turn):
    # The screen's own axes in the person's view, where its top edge, right, bottom, left lies at the robot.
    right, down = {0: ((1, 0), (0, -1)), 90: ((0, 1), (1, 0)), 180: ((-1, 0), (0, 1)), 270: ((0, -1), (-1, 0))}[turn]
    cell, per_metre = Cell(), 2000.0
    layout = laid_out((1920, 1080), per_metre, turn)
    middle = seen_by_the_person(cell.position(3, 3))
    for row, col in itertools.product(range(SIZE), repeat=2):
        px, py = layout.on_screen(layout.centre(row, col))
        across, along = (px - 960) / per_metre, (py - 540) / per_metre
        drawn = tuple(across * r + along * d for r, d in zip(right, down, strict=True))
        tile = seen_by_the_person(cell.position(row, col))
        assert drawn == pytest.approx((tile[0] - middle[0], tile[1] - middle[1]), abs=1e-9)


def test_up_goes_away_from_the_person_and_left_to_the_persons_left():
    cell = Cell()

    def shift(key):
        (row, col), there = STEPS[key], seen_by_the_person(cell.position(3, 3))
        after = seen_by_the_person(cell.position(3 + row, 3 + col))
        return tuple(round((b - a) / cell.tile) for a, b in zip(there, after, strict=True))

    assert {key: shift(key) for key in STEPS} == {"N": (0, 1), "E": (1, 0), "S": (0, -1), "W": (-1, 0)}
    layout = laid_out((1920, 1080), 2000.0)
    (x, y), (left, _), (_, up) = layout.centre(3, 3), layout.centre(3, 2), layout.centre(2, 3)
    assert left < x
    assert up < y


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("screen", SCREENS)
def test_as_large_as_fits_fits(screen, turn):
    per_metre = as_large_as_fits(screen)
    layout = laid_out(screen, per_metre, turn)
    assert layout.screen == screen
    boxes = [layout.grid, *layout.panels]
    for left, top, width, height in boxes:
        assert 0 <= left <= left + width <= layout.size[0]
        assert 0 <= top <= top + height <= layout.size[1]
    shorter, longer = needed(per_metre)
    assert shorter <= min(screen)
    assert longer <= max(screen)
    for left, top, width, height in layout.panels:
        assert min(width, height) >= layout.tile
        assert (left + width <= layout.grid[0]) or (left >= layout.grid[0] + layout.grid[2]) or (top >= layout.grid[1])


def test_both_sides_are_alike():
    layout = Layout((1920, 1080), 2000.0)
    one, two = layout.panels
    assert one[1:] == pytest.approx(two[1:], abs=1)
    assert 1920 - (two[0] + two[2]) == one[0] == 0
