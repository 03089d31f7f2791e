"""The picture of the task keeps the rules of the experiment, and shows every case of the paper's Table 1."""

from itertools import pairwise

from hrcneuro import published
from hrcneuro.paradigm import grid
from hrcneuro.paradigm.design import CASES
from hrcneuro.report import task


def test_the_trajectory_is_one_that_the_paper_allows():
    tiles = task.trajectory()
    assert not any(grid.on_border(tile) for tile in (tiles[0], tiles[-1]))
    assert grid.distance(tiles[0], tiles[-1]) >= published.LEAST_STEPS.value
    assert all(grid.distance(one, other) == 1 for one, other in pairwise(tiles))
    assert len(set(tiles)) == len(tiles)
    assert sum(one != other for one, other in pairwise(task.WAY)) >= published.LEAST_TURNS.value


def test_the_areas_are_of_the_printed_size_and_in_one_piece():
    low, high = published.AREA_TILES.value
    for area in (task.AREAS.human, task.AREAS.robot):
        assert low <= len(area) <= high
        assert grid.connected(area)


def test_the_panels_show_who_moves_and_every_case():
    sequential, intermittent = task.panels()
    assert [move.letter for move in sequential.moves] == list("HHHHHRR")
    assert [move.letter for move in intermittent.moves] == list("HHRRRHH")
    assert {move.case for move in intermittent.moves} - {""} == set(CASES)
    assert (sequential.first_takeover, intermittent.first_takeover) == (5, 2)
    for panel in (sequential, intermittent):
        assert len(panel.tiles) == grid.SIZE**2
        assert panel.said.count("human") + panel.said.count("robot") == len(panel.moves)
    assert intermittent.keys == {"human": "↑ ←", "robot": "→ ↓"}
