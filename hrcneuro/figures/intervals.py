"""Intervals of rates in per cent: a bar ends where a rate must end, and says that its interval goes on."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from hrcneuro.figures.style import GREY

LOW, HIGH = 0.0, 100.0
BEYOND = f"interval goes on beyond {LOW:g} or {HIGH:g} %"


def ends(mean: float, half: float) -> tuple[float, float]:
    """Return where the bar of a mean ± half its interval begins and ends, %; at the mean without an interval."""
    half = half if np.isfinite(half) else 0.0
    return max(LOW, mean - half), min(HIGH, mean + half)


def draw(axes: Axes, mean: float, half: float, place: float, colour: str) -> bool:
    """Draw a mean and its interval, NaN for none, in a row at this height; return whether the interval goes on.

    Of two or three subjects it easily reaches beyond all rates that there are.
    """
    cut = False
    if np.isfinite(half):
        low, high = ends(mean, half)
        axes.plot([low, high], [place, place], color=colour, lw=2, solid_capstyle="butt")
        for at, mark, beyond in ((low, "<", mean - half < LOW), (high, ">", mean + half > HIGH)):
            if beyond:
                axes.plot(at, place, mark, color=colour, ms=5, mew=0, clip_on=False)
                cut = True
    axes.plot(mean, place, "D", color=colour, ms=5)
    return cut


def key() -> Line2D:
    """Return the legend's line for a bar that is cut."""
    look: Any = {"color": GREY, "ls": "none", "marker": ">", "ms": 5, "mew": 0}
    return Line2D([], [], label=BEYOND, **look)


def limits(low: float, high: float, *, at_least: tuple[float, float]) -> tuple[float, float]:
    """Return the limits of an axis that holds what is drawn from ``low`` to ``high``, with some room around it."""
    return min(at_least[0], low - 2), max(at_least[1], high + 2)
