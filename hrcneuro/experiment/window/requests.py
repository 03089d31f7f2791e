"""What the window's process is asked for besides scenes, and what it answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

_GRID_CM = 49.0


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

    @property
    def about(self) -> dict[str, Any]:
        """What is worth writing down of it, as JSON values."""
        per_cm = None if math.isnan(self.pixels_per_cm) else round(self.pixels_per_cm, 3)
        return {"driver": self.driver, "size": list(self.size), "pixels_per_cm": per_cm, "source": self.source}

    def told(self, scale: float) -> str:
        """Return a sentence about how large the grid is, at ``scale`` of its true size."""
        if math.isnan(self.pixels_per_cm):
            return "the grid is as large as fits, not of true size: experiment.window.scale = 0"
        return (
            f"screen: {self.pixels_per_cm:.2f} pixels per cm ({self.source}); where the drawn grid does not measure "
            f"{_GRID_CM * scale:g} cm, set experiment.window.pixels_per_cm"
        )
