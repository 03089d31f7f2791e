"""What the window's process is asked for besides scenes, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Screenshot:
    """Write what is on the screen into a picture file."""

    path: str


@dataclass(frozen=True)
class Leave:
    """Close the window."""


@dataclass(frozen=True)
class Calibrating:
    """A person holds a bank card to the screen; that takes as long as it takes."""


@dataclass(frozen=True)
class Saved:
    """A picture file was written, or ``problem`` says why not."""

    path: str
    problem: str = ""


@dataclass(frozen=True)
class Opened:
    """A window that is open.

    Attributes:
        driver: SDL's name for the window system; ``dummy`` shows nothing.
        size: Width and height of the window, pixels.
        pixels_per_cm: Of the screen, at true size; NaN where the grid is as large as fits.
        source: Where that is from.
        tile_px: Edge of a drawn tile, pixels.
    """

    driver: str
    size: tuple[int, int]
    pixels_per_cm: float
    source: str
    tile_px: float
