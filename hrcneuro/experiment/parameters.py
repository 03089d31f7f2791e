"""What can be configured of an experiment."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option

TURNS_DEG = (0, 90, 180, 270)
"""How the picture can lie on the screen."""


@dataclass(frozen=True)
class WindowOptions:
    """Where and how large the person sees the grid (paper § 2.3.1: face up, full screen, 49 × 49 cm)."""

    display: int = option(0, "number of the screen; 0: the first one", low=0, high=15, keyed=False)
    windowed: bool = option(False, "a window among others in place of the full screen", keyed=False)
    scale: float = option(
        1.0,
        "size of the grid as a share of its true size; 0: as large as fits. Under an arm it must be 1",
        low=0.0,
        high=1.0,
        keyed=False,
    )
    pixels_per_cm: float = option(
        0.0,
        "pixels of the screen in a centimetre; 0: from what the screen says of itself, else by a bank card held to it",
        low=0.0,
        high=400.0,
        keyed=False,
    )
    rotate: int = option(
        0,
        "which edge of the screen lies at the robot; 0: the top, 90: the right, 180: the bottom, 270: the left one",
        unit="°",
        low=0,
        high=270,
        keyed=False,
    )
    show_turn: bool = option(False, "say whose turn it is", keyed=False)
    font: str = option(
        "", "font file for the words, for scripts other than Latin, Greek, Cyrillic", path=True, keyed=False
    )


def window_mistakes(options: WindowOptions, name: str) -> list[str]:
    """Return what is wrong in the values; ``name`` is the options' in the configuration."""
    if options.rotate not in TURNS_DEG:
        return [f"{name}.rotate = {options.rotate}: 0, 90, 180 or 270 is needed"]
    return []
