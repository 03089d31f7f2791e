"""Who is responsible: areas in sequential Collaboration (sC), directions in intermittent Collaboration (iC).

The 84 logged area maps are all alike: a rectangle of 4×5 tiles in a corner of the grid, or one tile less at the seam
(nearly always the rectangle's inner corner), and the L-shaped rest: 19 or 20 tiles against 30 or 29.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from hrcneuro.paradigm.grid import SIZE, STEPS, Tile, connected, neighbours

TILES: tuple[Tile, ...] = tuple(product(range(SIZE), range(SIZE)))
DIRECTION_PAIRS: tuple[frozenset[str], ...] = tuple(frozenset(pair) for pair in combinations(STEPS, 2))
"""The six pairs of directions that the human may own in a block of iC."""

COLOURS = ("green", "blue")

_NOTCHED = 35 / 84  # share of the logged maps whose rectangle lacks one tile
_NOTCH_AT_CORNER = 32 / 35
_HUMAN_HAS_SMALL = 32 / 72  # of the main blocks


@dataclass(frozen=True)
class Areas:
    """A block of sC: the tiles under the human's responsibility; all others are the robot's."""

    human: frozenset[Tile]
    human_colour: str = COLOURS[0]

    @property
    def robot(self) -> frozenset[Tile]:
        """The tiles under the robot's responsibility."""
        return frozenset(TILES) - self.human


@dataclass(frozen=True)
class Directions:
    """A block of iC: the two directions that the human controls; the other two are the robot's."""

    human: frozenset[str]

    @property
    def robot(self) -> frozenset[str]:
        """The directions that the robot controls."""
        return frozenset(STEPS) - self.human


Owners = Areas | Directions


def draw_areas(rng: np.random.Generator) -> Areas:
    """Return two 4-connected areas of 19 to 30 tiles, with a random owner and colour each."""
    height, width = ((4, 5), (5, 4))[rng.integers(2)]
    top, left = (int(rng.integers(2)) * (SIZE - height), int(rng.integers(2)) * (SIZE - width))
    small = set(product(range(top, top + height), range(left, left + width)))
    if rng.random() < _NOTCHED:
        inner = (height - 1 if top == 0 else top, width - 1 if left == 0 else left)
        seam = sorted(_removable(small) - {inner})
        at_corner = rng.random() < _NOTCH_AT_CORNER
        small.remove(inner if at_corner else seam[rng.integers(len(seam))])
    human = small if rng.random() < _HUMAN_HAS_SMALL else set(TILES) - small
    return Areas(frozenset(human), COLOURS[rng.integers(2)])


def draw_directions(rng: np.random.Generator) -> Directions:
    """Return one of the six pairs of directions for the human, each equally likely."""
    return Directions(DIRECTION_PAIRS[rng.integers(len(DIRECTION_PAIRS))])


def _removable(area: set[Tile]) -> set[Tile]:
    # Tiles at the seam that may change sides and leave both areas in one piece.
    rest = set(TILES) - area
    seam = {tile for tile in area if rest.intersection(neighbours(tile))}
    return {tile for tile in seam if connected(area - {tile}) and connected(rest | {tile})}


def actor_of(owners: Owners, tile: Tile, target: str) -> str:
    """Return who acts, ``human`` or ``robot``, with the end-effector on ``tile`` and the path toward ``target``.

    In sC the owner of the tile under the end-effector. In iC the owner of the target direction; on a diagonal the
    partner who owns both components, and the robot where each owns one.
    """
    if isinstance(owners, Areas):
        return "human" if tile in owners.human else "robot"
    return "human" if owners.human.issuperset(target) else "robot"


def allowed(owners: Owners, actor: str) -> frozenset[str]:
    """Return the directions that a partner can command: all four in sC, its own two in iC."""
    if isinstance(owners, Areas):
        return frozenset(STEPS)
    return owners.human if actor == "human" else owners.robot


def wrong_keys(owners: Owners, target: str) -> list[str]:
    """Return the keys that a human could press by mistake: allowed, but not part of the target direction."""
    return [key for key in STEPS if key in allowed(owners, "human") and key not in target]
