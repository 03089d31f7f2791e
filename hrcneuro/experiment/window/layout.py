"""Where things lie in the picture, in pixels. Numbers only.

The picture is laid out as the person sees it, who sits opposite the arm and looks toward its base (paper § 2.3.1): the
picture's top is the far edge, at the robot. Row 0 lies nearest to the base (:class:`hrcneuro.robot.cell.Cell`), so it
is the picture's top row; column 0 is at the person's left. The arrow key Up is ``N``, one row less: the tool goes away
from the person. The grid lies in the middle of the screen, so the screen's middle belongs under the middle of the arm's
tiles. :meth:`Layout.on_screen` then turns the picture as the screen lies on the table.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.paradigm.grid import SIZE

Box = tuple[int, int, int, int]  # left, top, width, height
Point = tuple[float, float]

TILE_M = published.TILE_M.value
GRID_M = SIZE * TILE_M
BESIDE_M = 0.05
"""Least room beside the grid: there stand the person's arrows."""

_FIT_BESIDE = 1.2  # tiles, where the grid is as large as fits
_FIT_EDGE = 0.94  # of the shorter side, where the grid is as large as fits


@dataclass(frozen=True)
class Layout:
    """The places of one screen.

    Attributes:
        size: Width and height of the picture as the person sees it, pixels.
        pixels_per_metre: Of the drawn grid: 0.07 of it is a tile's edge, whether or not that is its true size.
        rotate: By how many degrees the picture is turned clockwise on the screen.
    """

    size: tuple[int, int]
    pixels_per_metre: float
    rotate: int = 0

    @property
    def tile(self) -> float:
        """Edge of a tile, pixels."""
        return TILE_M * self.pixels_per_metre

    @property
    def grid(self) -> Box:
        """The whole grid."""
        left, top = self._corner(0, 0)
        right, bottom = self._corner(SIZE, SIZE)
        return left, top, right - left, bottom - top

    def box(self, row: int, col: int) -> Box:
        """Return where a tile lies; neighbours meet without a gap, and rounding does not add up."""
        left, top = self._corner(row, col)
        right, bottom = self._corner(row + 1, col + 1)
        return left, top, right - left, bottom - top

    def centre(self, row: float, col: float) -> Point:
        """Return the middle of a tile; fractions lie between tiles."""
        width, height = self.size
        middle = (SIZE - 1) / 2
        return width / 2 + (col - middle) * self.tile, height / 2 + (row - middle) * self.tile

    @property
    def panels(self) -> list[Box]:
        """Where the person's arrows stand: on both sides of the grid, or below it where the picture is upright.

        Both sides show the same, so that nothing draws the eyes, and with them the EOG, to one side.
        """
        (width, height), (left, top, wide, high) = self.size, self.grid
        if width >= height:
            return [(0, top, left, high), (left + wide, top, width - left - wide, high)]
        return [(left, top + high, wide, height - top - high)]

    @property
    def screen(self) -> tuple[int, int]:
        """Width and height of the screen, pixels."""
        return self.size if self.rotate % 180 == 0 else (self.size[1], self.size[0])

    def on_screen(self, point: Point) -> Point:
        """Return where a point of the picture lies on the screen."""
        (x, y), (width, height) = point, self.size
        return {0: (x, y), 90: (height - y, x), 180: (width - x, height - y), 270: (y, width - x)}[self.rotate]

    def _corner(self, row: int, col: int) -> tuple[int, int]:
        x, y = self.centre(row - 0.5, col - 0.5)
        return round(x), round(y)


def laid_out(screen: tuple[int, int], pixels_per_metre: float, rotate: int = 0) -> Layout:
    """Return the layout of a screen of so many pixels."""
    return Layout(screen if rotate % 180 == 0 else (screen[1], screen[0]), pixels_per_metre, rotate)


def as_large_as_fits(screen: tuple[int, int]) -> float:
    """Return the pixels per metre with which the grid and what stands beside it just fit."""
    shorter, longer = sorted(screen)
    return min(_FIT_EDGE * shorter / SIZE, longer / (SIZE + 2 * _FIT_BESIDE)) / TILE_M


def needed(pixels_per_metre: float) -> tuple[float, float]:
    """Return the shorter and the longer side of the smallest screen that can show the grid, pixels."""
    return GRID_M * pixels_per_metre, (GRID_M + 2 * BESIDE_M) * pixels_per_metre
