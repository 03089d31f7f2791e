"""Paths, areas and owners hold their rules for every draw; the path generator knows every class of path in the logs."""

from collections import Counter
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.paradigm.grid import (
    OPPOSITE,
    STEPS,
    TARGETS,
    beyond,
    connected,
    displacement,
    distance,
    inside,
    move,
    on_border,
    toward,
)
from hrcneuro.paradigm.owners import (
    DIRECTION_PAIRS,
    TILES,
    Areas,
    Directions,
    actor_of,
    allowed,
    draw_areas,
    draw_directions,
    wrong_keys,
)
from hrcneuro.paradigm.paths import PAIRS, Split, count_turns, draw_path, splits, trace

seeds = st.integers(0, 2**32 - 1)
tiles = st.tuples(st.integers(0, 6), st.integers(0, 6))


@settings(deadline=None)
@given(tiles, tiles)
def test_the_target_leads_to_the_pending_tile_along_both_components(tile, pending):
    target = toward(tile, pending)
    assert (target in TARGETS) == (tile != pending)
    for way in target:
        assert distance(beyond(tile, way), pending) == distance(tile, pending) - 1


@settings(deadline=None)
@given(tiles, st.sampled_from(list(STEPS)))
def test_a_move_is_clamped_at_the_edge_and_nowhere_else(tile, way):
    there = move(tile, way)
    assert inside(there)
    assert displacement(tile, there) == (way if inside(beyond(tile, way)) else None)


def test_a_displacement_of_two_steps_is_refused():
    with pytest.raises(ValueError, match=r"\(1, 1\) to \(1, 3\)"):
        displacement((1, 1), (1, 3))


def test_connected_knows_one_piece_from_two():
    assert connected([(0, 0), (0, 1), (1, 1)])
    assert not connected([(0, 0), (1, 1)])
    assert not connected([])


def test_there_are_twenty_pairs_of_start_and_goal_at_a_mean_distance_of_7_2():
    assert len(PAIRS) == 20
    lengths = [distance(*pair) for pair in PAIRS]
    assert min(lengths) == 7
    assert np.mean(lengths) == pytest.approx(7.2)
    assert np.std(lengths) == pytest.approx(0.4)


@settings(deadline=None)
@given(st.sampled_from(PAIRS), st.integers(1, 3), st.integers(0, 1), st.tuples(st.integers(0, 1), st.integers(0, 1)))
def test_every_path_joins_its_ends_with_its_turns_and_never_crosses_itself(pair, turns, axis, picks):
    path = trace(*pair, turns=turns, first_axis=axis, picks=picks)
    assert (path[0], path[-1]) == pair
    assert all(distance(a, b) == 1 and inside(b) for a, b in pairwise(path))
    assert len(set(path)) == len(path)
    assert count_turns(path) == turns
    steps, least = len(path) - 1, distance(*pair)
    assert (steps == least) or (steps == 9 and least == 7 and turns >= 2)
    assert steps > least or not any(map(on_border, path))


def every_path():
    """The paths of all choices of the generator, each choice once: a path comes as often as its probability says."""
    choices = product(PAIRS, (1, 2, 3), (0, 1), product(range(2), repeat=2))
    return [trace(*pair, turns=turns, first_axis=axis, picks=picks) for pair, turns, axis, picks in choices]


def test_there_are_280_paths_14_for_each_pair_of_ends():
    different = set(every_path())
    assert len(different) == 280
    assert set(Counter((path[0], path[-1]) for path in different).values()) == {14}


def test_an_axis_splits_by_its_direction_in_two_equally_likely_ways():
    # As in all 784 logged splits of three steps and all 1183 of four.
    seen = Counter((split.way, split.steps, split.first) for path in every_path() for split in splits(path))
    for way, firsts in {"S": (1, 2), "E": (1, 2), "N": (-1, 2), "W": (-1, 2)}.items():
        counts = {first: count for (there, steps, first), count in seen.items() if (there, steps) == (way, 3)}
        assert tuple(sorted(counts)) == firsts
        assert len(set(counts.values())) == 1
        assert seen[way, 4, 2] == seen[way, 4, 3] > 0
    assert all(split.known for path in every_path() for split in splits(path))


@pytest.mark.parametrize(
    ("way", "steps", "first", "known"),
    [("S", 3, 1, True), ("N", 3, 1, False), ("W", 3, -1, True), ("E", 3, -1, False), ("E", 4, 1, False)],
)
def test_a_split_is_known_only_where_its_axis_leads(way, steps, first, known):
    row, column = 6 * (way == "N"), 6 * (way == "W")
    tiles = [(row, column)]
    side = "E" if way in "NS" else "S"
    for leg in ((way if first > 0 else OPPOSITE[way], abs(first)), (side, 1), (way, steps - first)):
        for _ in range(leg[1]):
            tiles.append(beyond(tiles[-1], leg[0]))
    assert splits(tuple(tiles)) == [Split(way, steps, first)]
    assert splits(tuple(tiles))[0].known == known


def test_equally_likely_choices_give_the_logged_shares_of_turns_steps_and_detours():
    paths = every_path()
    steps = np.array([len(path) - 1 for path in paths])
    border = np.array([any(map(on_border, path)) for path in paths])
    # 1992 logged paths: 1401, 395 and 196 of 7, 8 and 9 steps, 95 on the border; three standard errors.
    for share, logged in ((steps == 7, 1401), (steps == 8, 395), (steps == 9, 196), (border, 95)):
        p = share.mean()
        assert abs(p - logged / 1992) < 3 * np.sqrt(p * (1 - p) / 1992)


@settings(deadline=None)
@given(seeds)
def test_a_drawn_path_starts_and_ends_on_the_inner_tiles(seed):
    path = draw_path(np.random.default_rng(seed))
    assert not on_border(path[0])
    assert not on_border(path[-1])


@settings(deadline=None)
@given(seeds)
def test_areas_are_two_pieces_of_19_to_30_tiles_that_fill_the_grid(seed):
    areas = draw_areas(np.random.default_rng(seed))
    assert connected(areas.human)
    assert connected(areas.robot)
    assert {len(areas.human), len(areas.robot)} in ({19, 30}, {20, 29})
    assert areas.human | areas.robot == set(TILES)
    assert areas.human_colour in ("green", "blue")


@settings(deadline=None)
@given(st.sampled_from(DIRECTION_PAIRS), tiles, st.sampled_from(TARGETS))
def test_in_ic_the_owner_of_every_component_acts_and_the_robot_where_they_are_split(pair, tile, target):
    owners = Directions(pair)
    assert len(owners.human) == len(owners.robot) == 2
    human_parts = sum(way in owners.human for way in target)
    assert actor_of(owners, tile, target) == ("human" if human_parts == len(target) else "robot")
    assert set(wrong_keys(owners, target)) == owners.human - set(target)


@settings(deadline=None)
@given(seeds, tiles, st.sampled_from(TARGETS))
def test_in_sc_the_owner_of_the_tile_acts_with_all_four_directions(seed, tile, target):
    owners = draw_areas(np.random.default_rng(seed))
    assert actor_of(owners, tile, target) == ("human" if tile in owners.human else "robot")
    assert allowed(owners, "robot") == set(STEPS)


def test_all_six_pairs_of_directions_and_both_owners_come_up():
    rng = np.random.default_rng(0)
    assert {draw_directions(rng).human for _ in range(200)} == set(DIRECTION_PAIRS)
    sizes = [len(draw_areas(rng).human) for _ in range(400)]
    assert set(sizes) == {19, 20, 29, 30}
    assert Areas(frozenset()).robot == set(TILES)
