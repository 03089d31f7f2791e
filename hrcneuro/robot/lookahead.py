"""Looks ahead where a session is not known before: what the arm is asked for is checked first, outside its loop."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from hrcneuro.paradigm.grid import CENTRE, SIZE, Tile, neighbours
from hrcneuro.robot import rehearsal
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove, check_durations, check_paths
from hrcneuro.robot.rehearsal import MakeLoop
from hrcneuro.robot.workspace import Workspace

_TILES: list[Tile] = [(row, col) for row in range(SIZE) for col in range(SIZE)]
_CORNERS: list[Tile] = [(row, col) for row in (0, SIZE - 1) for col in (0, SIZE - 1)]
_NOT_BEGUN = "it was not begun"


class LookAhead:
    """Checks ways: in reach, in the box, slow enough for every joint, and driven once on the simulated arm.

    What has passed is remembered, so that a way costs this once for each duration that is quicker than those before.
    """

    def __init__(
        self, workspace: Workspace, *, pace: Pace, acceleration: float, lead_given: bool, make_loop: MakeLoop
    ) -> None:
        """Begin with nothing passed.

        Args:
            workspace: Where the tiles are.
            pace: Bounds of approaches.
            acceleration: The limit of every joint, rad/s².
            lead_given: Whether the session begins with a lead: without one, the arm trails on the first ways.
            make_loop: Returns the session's loop over a simulated arm, as :func:`hrcneuro.robot.assembly.rehearsing`.
        """
        self._workspace, self._pace, self._acceleration = workspace, pace, acceleration
        self._lead_given, self._make_loop = lead_given, make_loop
        self._quickest: dict[tuple[Tile, Tile], float] = {}
        self._flowing: dict[tuple[Tile, Tile, Tile], list[tuple[float, float]]] = {}
        self._approaches: set[tuple[Tile, Tile]] = set()

    def grid(self, t_f: float) -> None:
        """Check a whole session before it begins: its opening, all moves at its shortest duration, long approaches.

        Of the approaches between all tiles it is checked that they lie in reach; those between corners and centre, the
        quickest and the nearest to the sides of the box, are driven. Where moves flow into each other, each move is
        driven also behind each that may come before it.

        Args:
            t_f: The shortest duration of a move, seconds.

        Raises:
            TooQuick, WayError, Foreseen: With the way, and what is wrong with it.
        """
        moves = [_move(start, end, t_f) for start in _TILES for end in neighbours(start)]
        check_durations(moves, self._workspace, acceleration=self._acceleration)
        # A straight way is the same in both directions.
        check_paths([_move(a, b, t_f) for a in _TILES for b in _TILES if a < b], self._workspace)
        for way in rehearsal.opening(self._workspace, self._pace, self._lead_given):
            self._drive(way, so="nothing has moved")
        for start, end in permutations([*_CORNERS, CENTRE], 2):
            self._drive(rehearsal.approach(self._workspace, self._pace, start, end), so="nothing has moved")
            self._approaches.add((start, end))
        for move in moves:
            way = rehearsal.tile_move(self._workspace, move.start, move.end, t_f)
            self._drive(way, so="nothing has moved")
            self._quickest[move.start, move.end] = t_f
        if self._pace.start_next == "in_radius":
            for first, second in product(moves, moves):
                if first.end == second.start:
                    self._flow((first.start, first.end, second.end), (t_f, t_f), so="nothing has moved")

    def move(self, start: Tile, end: Tile, t_f: float, *, after: tuple[Tile, float] | None = None) -> None:
        """Check a move; one that the grid's edge stops has no way.

        Args:
            start, end: Tiles.
            t_f: Its duration, seconds.
            after: The tile from which the move before came, and its duration, where this one may take over from it.

        Raises:
            TooQuick, WayError, Foreseen: With the way, and what is wrong with it.
            ValueError: The move goes farther than a tile, or off the grid.
        """
        _check_tiles(start, end)
        if start != end:
            self._from_rest(start, end, t_f)
            if after is not None and self._pace.start_next == "in_radius":
                self._flow((after[0], start, end), (after[1], t_f), so=_NOT_BEGUN)

    def _from_rest(self, start: Tile, end: Tile, t_f: float) -> None:
        if self._quickest.get((start, end), np.inf) <= t_f:
            return
        if end not in neighbours(start):
            raise ValueError(f"a move from tile {start} to {end}; a move goes to a tile beside it, or stays")
        move = _move(start, end, t_f)
        check_durations([move], self._workspace, acceleration=self._acceleration)
        check_paths([move], self._workspace)
        self._drive(rehearsal.tile_move(self._workspace, start, end, t_f), so=_NOT_BEGUN)
        self._quickest[start, end] = t_f

    def _flow(self, tiles: tuple[Tile, Tile, Tile], durations: tuple[float, float], *, so: str) -> None:
        before, t_f = durations
        passed = self._flowing.setdefault(tiles, [])
        if any(one <= before and other <= t_f for one, other in passed):
            return
        self._drive(rehearsal.flowing_move(self._workspace, tiles, durations), so=so)
        passed.append(durations)

    def approach(self, start: Tile, end: Tile) -> None:
        """Check the straight way between two tiles, between episodes.

        Raises:
            WayError, Foreseen: With the way, and what is wrong with it.
            ValueError: A tile lies off the grid.
        """
        _check_tiles(start, end)
        if start == end or (start, end) in self._approaches:
            return
        check_paths([_move(start, end, np.inf)], self._workspace)
        self._drive(rehearsal.approach(self._workspace, self._pace, start, end), so=_NOT_BEGUN)
        self._approaches.add((start, end))

    def _drive(self, way: rehearsal.Way, *, so: str) -> None:
        rehearsal.drive(way, self._workspace, make_loop=self._make_loop, so=so)


def _check_tiles(*tiles: Tile) -> None:
    for tile in tiles:
        if tile not in _TILES:
            raise ValueError(f"tile {tile} lies off the grid; rows and columns go from 0 to {SIZE - 1}")


def _move(start: Tile, end: Tile, t_f: float) -> PlannedMove:
    return PlannedMove("", False, 0, 0, 0, start, end, True, t_f, np.nan)
