"""The 7×7 grid of tiles: rows are counted from the top, columns from the left, both from 0 (paper §2.2)."""

from __future__ import annotations

from collections.abc import Collection, Iterator

SIZE = 7
INNER = range(1, SIZE - 1)
"""Rows and columns that are not on the border ring."""

Tile = tuple[int, int]  # row, column
CENTRE: Tile = (SIZE // 2, SIZE // 2)

STEPS: dict[str, Tile] = {"N": (-1, 0), "E": (0, 1), "S": (1, 0), "W": (0, -1)}
OPPOSITE = {"N": "S", "E": "W", "S": "N", "W": "E"}
TARGETS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")

_DIRECTION = {step: name for name, step in STEPS.items()}


def inside(tile: Tile) -> bool:
    """Return whether the tile lies on the grid."""
    return 0 <= tile[0] < SIZE and 0 <= tile[1] < SIZE


def on_border(tile: Tile) -> bool:
    """Return whether the tile belongs to the outermost ring."""
    return not (tile[0] in INNER and tile[1] in INNER)


def beyond(tile: Tile, direction: str) -> Tile:
    """Return the neighbour in a direction, which may lie off the grid."""
    step = STEPS[direction]
    return tile[0] + step[0], tile[1] + step[1]


def move(tile: Tile, direction: str) -> Tile:
    """Return where a move ends: the neighbour, or the tile itself where the grid ends (the move is clamped)."""
    there = beyond(tile, direction)
    return there if inside(there) else tile


def neighbours(tile: Tile) -> Iterator[Tile]:
    """Yield the two to four tiles that share an edge with the tile."""
    for direction in STEPS:
        there = beyond(tile, direction)
        if inside(there):
            yield there


def displacement(start: Tile, end: Tile) -> str | None:
    """Return the direction from a tile to its neighbour, or None where the two are the same tile.

    Raises:
        ValueError: The tiles are further apart than one step.
    """
    if start == end:
        return None
    step = (end[0] - start[0], end[1] - start[1])
    if step not in _DIRECTION:
        raise ValueError(f"from tile {start} to {end} is no single step")
    return _DIRECTION[step]


def toward(tile: Tile, pending: Tile) -> str:
    """Return the target: the sign of (pending − tile) as one of eight directions, ``""`` on the pending tile."""
    rows, columns = pending[0] - tile[0], pending[1] - tile[1]
    return ("S" if rows > 0 else "N" if rows < 0 else "") + ("E" if columns > 0 else "W" if columns < 0 else "")


def distance(a: Tile, b: Tile) -> int:
    """Return the Manhattan distance in steps."""
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def region(tile: Tile, tiles: Collection[Tile]) -> set[Tile]:
    """Return the tiles that can be reached from ``tile``, one of them, by steps within ``tiles``."""
    todo = set(tiles) - {tile}
    frontier, reached = [tile], {tile}
    while frontier:
        near = todo.intersection(neighbours(frontier.pop()))
        todo -= near
        reached |= near
        frontier.extend(near)
    return reached


def connected(tiles: Collection[Tile]) -> bool:
    """Return whether the tiles form one area in which edges join neighbours (false without any tile)."""
    return bool(tiles) and region(min(tiles), tiles) == set(tiles)
