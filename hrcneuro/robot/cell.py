"""The cell: where the study's table, screen and arm stand. Values only, so that a configuration loads without NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hrcneuro.contract import option
from hrcneuro.paradigm.grid import SIZE

Position = tuple[float, float, float]  # (x, y, z) in the frame base, metres


@dataclass(frozen=True)
class Cell:
    """One robot cell (paper § 2.3.1); the paper leaves open how high the arm's base stands and how long its tool is."""

    base_height: float = option(0.70, "height of the arm's base above the floor", unit="m", low=0.0, high=2.0)
    screen_height: float = option(0.60, "height of the screen above the floor", unit="m", low=0.0, high=2.0)
    hover: float = option(0.02, "height of the tool's tip above the screen", unit="m", low=0.005, high=0.5)
    tool: float = option(0.10, "length of the tool beyond the flange", unit="m", low=0.0, high=0.5)
    tile: float = option(0.07, "edge of a tile", unit="m", low=0.01, high=0.2)
    near_edge: float = option(0.76, "distance of the grid's near edge from the base", unit="m", low=0.2, high=1.3)
    sideways: float = option(0.0, "the grid's centre, to the left as the arm looks at it", unit="m", low=-1.0, high=1.0)
    radius: float = option(0.002, "the next command is accepted within this distance", unit="m", low=1e-4, high=0.02)
    margin: float = option(0.05, "keep-inside box: past the grid's edges", unit="m", low=0.0, high=0.5)
    floor: float = option(0.008, "keep-inside box: least height above the screen", unit="m", low=0.0, high=0.1)
    ceiling: float = option(0.40, "keep-inside box: greatest height above the screen", unit="m", low=0.05, high=1.5)
    home: float = option(0.12, "height of the home position above the screen", unit="m", low=0.02, high=1.0)
    min_singular_value: float = option(0.05, "smallest singular value of the Jacobian allowed", low=0.0, high=1.0)
    seed_deg: tuple[float, ...] = option(
        (-9.4, -39.6, 84.7, -135.1, -90.0, -99.4), "joint angles near the grid's centre", unit="°", low=-360, high=360
    )

    @property
    def height(self) -> float:
        """The tip's height over the tiles, z in ``base``, metres."""
        return self.screen_height + self.hover - self.base_height

    @property
    def box(self) -> tuple[Position, Position]:
        """The keep-inside box: its lowest and its highest corner."""
        screen = self.screen_height - self.base_height
        half, far = SIZE * self.tile / 2 + self.margin, self.near_edge + SIZE * self.tile + self.margin
        side = -self.sideways
        return (
            (-far, side - half, screen + self.floor),
            (-(self.near_edge - self.margin), side + half, screen + self.ceiling),
        )

    def position(self, row: int, col: int) -> Position:
        """Return the tip's position over the centre of a tile."""
        x = -(self.near_edge + (row + 0.5) * self.tile)
        return x, -self.sideways + ((SIZE - 1) / 2 - col) * self.tile, self.height

    def steps(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return row and column, with fractions, of tip positions ``x`` and ``y`` in ``base``, metres, of any shape."""
        return (-x - self.near_edge) / self.tile - 0.5, (SIZE - 1) / 2 - (y + self.sideways) / self.tile
