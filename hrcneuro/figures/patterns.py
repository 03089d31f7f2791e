"""Maps of what a linear decoder listens to: its patterns in windows of time, a row a problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.figures.style import GREY, STYLE, save
from hrcneuro.figures.topomap import Scalp, Topography

Floats = NDArray[np.float64]

_MAP, _ROW, _TOP, _FOOT = 0.78, 1.2, 0.1, 0.42  # inches: a map's width, a row's height, around them


@dataclass(frozen=True)
class PatternRow:
    """One problem.

    Attributes:
        title: Above it.
        spans_s: Start and end of each window, s.
        values: ndarray, shape (n_windows, n_channels), µV.
    """

    title: str
    spans_s: Sequence[tuple[float, float]]
    values: Floats


def side_by_side(spans_s: Sequence[tuple[float, float]], most: int) -> list[int]:
    """Return which windows to show: the longest that do not overlap, in their order; evenly chosen where too many."""
    longest = max(stop - start for start, stop in spans_s)
    chosen: list[int] = []
    for i in sorted(range(len(spans_s)), key=lambda i: spans_s[i]):
        start, stop = spans_s[i]
        free = not chosen or start >= spans_s[chosen[-1]][1] - 1e-9
        if free and stop - start > longest - 1e-9:
            chosen.append(i)
    places = np.linspace(0, len(chosen) - 1, min(len(chosen), most)).round().astype(int)
    return [chosen[place] for place in places]


def draw(rows: Sequence[PatternRow], positions: Floats, path: Path, *, note: str) -> bool:
    """Draw the rows of maps, all in one scale; return whether there was anything to draw.

    Args:
        rows: From top to bottom, all with the same windows.
        positions: Of the channels in head coordinates, ndarray, shape (n_channels, 3), m; NaN where unknown.
        path: The PNG file; the PDF lies beside it.
        note: A line below the picture.
    """
    scalp = Scalp.of(positions)
    if scalp is None or not rows:
        return False
    limit = max(float(np.nanquantile(np.abs(row.values), 0.99)) for row in rows) or 1.0
    count = max(len(row.spans_s) for row in rows)
    width, height = max(3.4, _MAP * count + 0.8), _ROW * len(rows) + _TOP + _FOOT
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        for i, row in enumerate(rows):
            top = height - _TOP - i * _ROW
            maps = [
                Topography(start, np.nan_to_num(values), title=f"{1000 * start:.0f}–{1000 * stop:.0f}")
                for (start, stop), values in zip(row.spans_s, row.values, strict=True)
            ]
            place = (0.1 / width, (top - _ROW + 0.1) / height, 1 - 0.4 / width, (_ROW - 0.32) / height)
            scalp.draw(figure.add_axes(place), maps, limit, slots=count, bar=i == 0)
            figure.text(0.1 / width, (top - 0.02) / height, row.title, fontsize=8.5, va="top")
        figure.text(0.1 / width, 0.07 / height, note, fontsize=6.5, color=GREY, va="bottom", linespacing=1.4)
        save(figure, path)
    return True
