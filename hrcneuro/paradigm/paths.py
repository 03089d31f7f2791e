"""The marked path of an episode: from start to goal in 7, 8 or 9 steps with one, two or three turns (paper §2.2).

The generator reproduces every class of path in the 1992 logged episodes. A path with k turns has k + 1 straight legs,
along the rows and along the columns in turn. An axis that appears twice is split: four steps into 2 + 2 or 3 + 1;
three steps into 2 + 1 (half of the time), 1 + 2 or −1 + 4, a detour of one step away from the goal that may touch the
border.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

from hrcneuro.paradigm.grid import INNER, Tile, distance

SHORTEST = 7
"""Least Manhattan distance from start to goal, in steps."""

PAIRS: tuple[tuple[Tile, Tile], ...] = tuple(
    (start, goal) for start, goal in product(product(INNER, INNER), repeat=2) if distance(start, goal) >= SHORTEST
)
"""The 20 ordered pairs of start and goal."""

# First leg of an axis that is walked in two legs; repeated entries are drawn more often.
_FIRST_LEG = {4: (2, 2, 3, 3), 3: (2, 2, 1, -1)}


def draw_path(rng: np.random.Generator) -> tuple[Tile, ...]:
    """Return the tiles of a random path, start and goal included: 8 to 10 tiles, no tile twice."""
    start, goal = PAIRS[rng.integers(len(PAIRS))]
    turns = int(rng.integers(1, 4))
    first_axis = int(rng.integers(2))
    picks = (int(rng.integers(4)), int(rng.integers(4)))
    return trace(start, goal, turns=turns, first_axis=first_axis, picks=picks)


def trace(start: Tile, goal: Tile, *, turns: int, first_axis: int, picks: tuple[int, int]) -> tuple[Tile, ...]:
    """Return the tiles of one path.

    Args:
        start, goal: One of :data:`PAIRS`.
        turns: 1, 2 or 3.
        first_axis: The axis of the first leg, 0 along a column (north–south), 1 along a row.
        picks: For each axis which of four equally likely splits is taken where it is walked in two legs.
    """
    legs: list[list[int]] = []
    for axis in (0, 1):
        whole = goal[axis] - start[axis]
        sign, steps = (1, whole) if whole > 0 else (-1, -whole)
        walked_twice = (turns + 2 - (axis != first_axis)) // 2 == 2
        first = _FIRST_LEG[steps][picks[axis]] if walked_twice else steps
        legs.append([sign * first, sign * (steps - first)])
    tiles = [start]
    for leg in range(turns + 1):
        axis = (first_axis + leg) % 2
        length = legs[axis][leg // 2]
        for _ in range(abs(length)):
            row, column = tiles[-1]
            step = 1 if length > 0 else -1
            tiles.append((row + step, column) if axis == 0 else (row, column + step))
    return tuple(tiles)


def count_turns(path: tuple[Tile, ...]) -> int:
    """Return the number of direction changes along a path."""
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(path)]
    return sum(a != b for a, b in pairwise(steps))
