"""The task in one drawn picture: an episode on the grid in both scenarios, and who moves when (paper 2.2, Table 1).

Who moves follows from the rules of :mod:`hrcneuro.paradigm`, as in a simulated study; only the trajectory, the areas
and the directions are an example.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from typing import NamedTuple

from hrcneuro.paradigm import grid
from hrcneuro.paradigm.owners import Areas, Directions, Owners, actor_of

START: grid.Tile = (5, 1)
WAY = "NNEEENN"
AREAS = Areas(frozenset(product(range(2, grid.SIZE), range(4))))  # a rectangle in a corner, as in all logged blocks
DIRECTIONS = Directions(frozenset("NW"))  # the paper's own example
EDGE = 44  # of a tile, in units of the picture

_ARROWS = {"N": "↑", "E": "→", "S": "↓", "W": "←"}
_LETTERS = {"human": "H", "robot": "R"}


class DrawnTile(NamedTuple):
    """A tile: its upper left corner, and whose it is; nobody's in iC."""

    x: int
    y: int
    owner: str


class DrawnMove(NamedTuple):
    """A move from the centre of a tile to that of the next, who makes it, and the case that it ends (HR)."""

    x0: int
    y0: int
    x1: int
    y1: int
    actor: str
    letter: str
    case: str

    @property
    def takeover(self) -> bool:
        """Whether another partner made the move before."""
        return self.case in ("HR", "RH")


@dataclass(frozen=True)
class Panel:
    """A scenario's half of the picture.

    Attributes:
        name, title, rule: The scenario, in two letters, and in words, and who moves in it.
        tiles, moves: What is drawn; lengths in units of the picture.
        keys: Partner -> the arrows of its directions; empty in sC.
        said: The whole in a sentence, for those who do not see it.
    """

    name: str
    title: str
    rule: str
    tiles: list[DrawnTile]
    moves: list[DrawnMove]
    keys: dict[str, str]
    said: str

    @property
    def first_takeover(self) -> int:
        """Which move, from 0, is the first that another partner takes over."""
        return next(i for i, move in enumerate(self.moves) if move.takeover)


def panels() -> list[Panel]:
    """Return the two halves of the picture, sC and iC."""
    return [
        _panel(
            "sC",
            "sequential collaboration",
            "Who moves depends on the place: one area of tiles is the human's, the other the robot's.",
            AREAS,
        ),
        _panel(
            "iC",
            "intermittent collaboration",
            "Who moves depends on the direction: two of the four are the human's, the others the robot's.",
            DIRECTIONS,
        ),
    ]


def trajectory() -> list[grid.Tile]:
    """Return the tiles of the example, start and goal included."""
    tiles = [START]
    for direction in WAY:
        tiles.append(grid.move(tiles[-1], direction))
    return tiles


def _panel(name: str, title: str, rule: str, owners: Owners) -> Panel:
    actors = [actor_of(owners, tile, grid.toward(tile, after)) for tile, after in pairwise(trajectory())]
    letters = [_LETTERS[actor] for actor in actors]
    cases = ["", *(before + now for before, now in pairwise(letters))]
    moves = [
        DrawnMove(*_centre(tile), *_centre(after), actor, letter, case)
        for (tile, after), actor, letter, case in zip(pairwise(trajectory()), actors, letters, cases, strict=True)
    ]
    tiles = [DrawnTile(EDGE * c, EDGE * r, _owner(owners, (r, c))) for r, c in product(range(grid.SIZE), repeat=2)]
    said = f"{name}: a path of {len(moves)} moves over a grid of {grid.SIZE} × {grid.SIZE} tiles, made by " + ", ".join(
        actors
    )
    return Panel(name, title, rule, tiles, moves, _keys(owners), said)


def _centre(tile: grid.Tile) -> tuple[int, int]:
    return EDGE * tile[1] + EDGE // 2, EDGE * tile[0] + EDGE // 2


def _owner(owners: Owners, tile: grid.Tile) -> str:
    return "" if isinstance(owners, Directions) else "human" if tile in owners.human else "robot"


def _keys(owners: Owners) -> dict[str, str]:
    if isinstance(owners, Areas):
        return {}
    owned = {"human": owners.human, "robot": owners.robot}
    return {actor: " ".join(_ARROWS[d] for d in grid.STEPS if d in mine) for actor, mine in owned.items()}
