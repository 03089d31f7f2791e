"""What an arm is asked for and what comes of it, one thing at a time, plain and light to import.

Times are seconds of the clock of who says it: the loop's, from its start, or the one that an experiment's parts share.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.paradigm.grid import Tile


@dataclass(frozen=True)
class Approach:
    """Bring the tip over a tile in a straight line, between episodes."""

    tile: Tile


@dataclass(frozen=True)
class Finish:
    """Ask for nothing more; the arm is left at rest, and let go."""


@dataclass(frozen=True)
class Ready:
    """The arm stands over the grid's centre, and its lead is known."""

    when: float
    lead: float


@dataclass(frozen=True)
class Arrived:
    """An approach has ended."""

    tile: Tile
    when: float


@dataclass(frozen=True)
class InRadius:
    """The first cycle of a move in which the tip is within the cell's radius, 2 mm, of its goal: keys are accepted."""

    index: int
    when: float
