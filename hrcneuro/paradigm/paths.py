"""The marked path of an episode: from start to goal in 7, 8 or 9 steps with one, two or three turns (paper §2.2).

The generator draws from the same 280 paths as the 1992 logged episodes, 14 for each pair of start and goal. A path with
k turns has k + 1 straight legs, along the rows and along the columns in turn. An axis that appears twice is split in
one of two ways: four steps into 2 + 2 or 3 + 1; three steps south or east into 2 + 1 or 1 + 2, but three steps north or
west into 2 + 1 or −1 + 4, a detour of one step away from the goal that may touch the border. All choices (the pair, the
turns, the axis of the first leg, the split of either axis) are equally likely. In the logs none of them depends on
another, nor on the subject, the block or the path before (docs/behaviour.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby, pairwise, product

import numpy as np

from hrcneuro.paradigm.grid import INNER, STEPS, Tile, displacement, distance

SHORTEST = 7
"""Least Manhattan distance from start to goal, in steps."""

PAIRS: tuple[tuple[Tile, Tile], ...] = tuple(
    (start, goal) for start, goal in product(product(INNER, INNER), repeat=2) if distance(start, goal) >= SHORTEST
)
"""The 20 ordered pairs of start and goal."""

_WAYS = {(0 if row else 1, row + column): way for way, (row, column) in STEPS.items()}  # by axis and sign

# First leg in steps, below zero away from the goal, of an axis that is walked in two legs: by its direction and steps.
_FIRST_LEGS = {(way, 4): (2, 3) for way in STEPS} | {
    ("S", 3): (2, 1),
    ("E", 3): (2, 1),
    ("N", 3): (2, -1),
    ("W", 3): (2, -1),
}


@dataclass(frozen=True)
class Split:
    """An axis that a path walks in two legs: the direction and steps to the goal, and the first leg.

    The first leg is in steps, below zero where it leads away from the goal.
    """

    way: str
    steps: int
    first: int

    @property
    def known(self) -> bool:
        """Whether paths of the experiment split so."""
        return self.first in _FIRST_LEGS.get((self.way, self.steps), ())


def draw_path(rng: np.random.Generator) -> tuple[Tile, ...]:
    """Return the tiles of a random path, start and goal included: 8 to 10 tiles, no tile twice."""
    start, goal = PAIRS[rng.integers(len(PAIRS))]
    turns = int(rng.integers(1, 4))
    first_axis = int(rng.integers(2))
    picks = (int(rng.integers(2)), int(rng.integers(2)))
    return trace(start, goal, turns=turns, first_axis=first_axis, picks=picks)


def trace(start: Tile, goal: Tile, *, turns: int, first_axis: int, picks: tuple[int, int]) -> tuple[Tile, ...]:
    """Return the tiles of one path.

    Args:
        start, goal: One of :data:`PAIRS`.
        turns: 1, 2 or 3.
        first_axis: The axis of the first leg, 0 along a column (north–south), 1 along a row.
        picks: For each axis which of its two splits is taken, 0 or 1, where it is walked in two legs.
    """
    lengths: list[list[int]] = []
    for axis in (0, 1):
        whole = goal[axis] - start[axis]
        sign, steps = (1, whole) if whole > 0 else (-1, -whole)
        walked_twice = (turns + 2 - (axis != first_axis)) // 2 == 2
        first = _FIRST_LEGS[_WAYS[axis, sign], steps][picks[axis]] if walked_twice else steps
        lengths.append([sign * first, sign * (steps - first)])
    tiles = [start]
    for leg in range(turns + 1):
        axis = (first_axis + leg) % 2
        length = lengths[axis][leg // 2]
        for _ in range(abs(length)):
            row, column = tiles[-1]
            step = 1 if length > 0 else -1
            tiles.append((row + step, column) if axis == 0 else (row, column + step))
    return tuple(tiles)


def count_turns(path: tuple[Tile, ...]) -> int:
    """Return the number of direction changes along a path."""
    return max(len(legs(path)) - 1, 0)


def legs(path: tuple[Tile, ...]) -> list[tuple[str, int]]:
    """Return the straight legs of a path in their order: direction and steps of each."""
    ways = [way for a, b in pairwise(path) if (way := displacement(a, b)) is not None]
    return [(way, len(list(steps))) for way, steps in groupby(ways)]


def splits(path: tuple[Tile, ...]) -> list[Split]:
    """Return the splits of the axes that a path walks in more than one leg, the axis along a column (N–S) first."""
    found = []
    for axis in (0, 1):
        signed = [sum(STEPS[way]) * steps for way, steps in legs(path) if STEPS[way][axis]]
        if len(signed) > 1:
            whole = sum(signed)
            sign = 1 if whole > 0 else -1
            found.append(Split(_WAYS[axis, sign], abs(whole), sign * signed[0]))
    return found
