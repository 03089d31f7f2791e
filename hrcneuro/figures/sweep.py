"""The figure of the design sweep: how good must a decoder be?"""

from __future__ import annotations

from collections.abc import Container, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

from hrcneuro.figures.learners import NAMES
from hrcneuro.figures.simulate import EMPIRICAL
from hrcneuro.figures.style import PLACED, save
from hrcneuro.learning.grid import AXES

_MINUTES = (1, 2, 5, 10, 20, 40, 80)
_AXIS_LABELS = {
    "subtasks": "subtasks n",
    "chosen": "subtasks of the human m",
    "alpha": "learning rate α",
    "tau": "temperature τ",
    "events": "events in an episode",
    "period": "episodes between reassignments",
}


def draw(
    table: pd.DataFrame, usual: Mapping[str, float], named: Container[str], *, episodes: int, learner: str, path: Path
) -> None:
    """Draw minutes to 80 % over decoder accuracy, one panel for every other axis that varies.

    Where tasks change, the first time at 80 % says little: that panel shows the accuracy at the end instead.

    Args:
        table: The rows of sweep.parquet.
        usual, named: As :func:`slices` takes them.
        episodes: How many were learned.
        learner: Who learned, a name of ``NAMES``.
        path: The PNG file; the PDF lies beside it.
    """
    panelled = [(axis, part) for axis, part in slices(table, usual, named) if part["accuracy"].nunique() > 1]
    with rc_context(PLACED):
        across = max(1, min(3, len(panelled)))
        down = max(1, -(-len(panelled) // across))
        figure = Figure(figsize=(1.4 + 2.3 * across, 0.8 + 2.2 * down))
        panels = figure.subplots(down, across, squeeze=False)
        bars: dict[str, ContourSet] = {}
        for axes, (axis, part) in zip(panels.flat, panelled, strict=False):
            if axis == "period":
                bars[f"choice accuracy after {episodes} episodes"] = _final(axes, axis, part)
            else:
                bars["minutes to 80 % choice accuracy (1 s a trial)"] = _minutes(axes, axis, part)
        for axes in panels.flat[len(panelled) :]:
            axes.set_axis_off()
        for label, filled in bars.items():
            figure.colorbar(filled, ax=panels, aspect=30, pad=0.02).set_label(label)
        if not panelled:
            panels[0, 0].text(0.5, 0.5, "a picture needs accuracy and\none more axis", ha="center", va="center")
        figure.suptitle(
            f"learner: {NAMES[learner]}; lines: 80 % in 10 min at 1 s (solid) and 2 s a trial (dashed); "
            f"white: not in {episodes} episodes",
            fontsize=8,
        )
        save(figure, path)


def slices(table: pd.DataFrame, usual: Mapping[str, float], named: Container[str]) -> list[tuple[str, pd.DataFrame]]:
    """Return, for every axis but accuracy that varies, its points with all other axes at their usual value.

    Where the usual value is not in the grid, the nearest one stands for it.

    Args:
        table: The rows of sweep.parquet.
        usual: Axis -> its usual value, of all axes but accuracy.
        named: The axes that the sweep names; where it does not name m, m follows n.
    """
    parts = []
    for axis in AXES:
        if axis == "accuracy" or table[axis].nunique() < 2 or (axis == "chosen" and "chosen" not in named):
            continue
        part = table
        for other in ("subtasks", "chosen", "events", "period", "alpha", "tau"):
            # m follows n where it has no axis of its own.
            if other == axis or (other == "chosen" and axis == "subtasks"):
                continue
            near = part[other].iloc[int(np.argmin(np.abs(part[other].to_numpy() - usual[other])))]
            part = part[part[other] == near]
        if axis == "subtasks":
            share = usual["chosen"] / usual["subtasks"]
            off = (part["chosen"] - share * part["subtasks"]).abs()
            part = part[off == off.groupby(part["subtasks"]).transform("min")]
        parts.append((axis, part))
    return parts


def _minutes(axes: Axes, axis: str, part: pd.DataFrame) -> ContourSet:
    x, rows, minutes = _table(axes, axis, part, "minutes_1s")
    # "Never" is drawn as white, yet the 10-minute line must not end at the last cell that gets there.
    never = np.where(np.isfinite(minutes), minutes, 10.0 * _MINUTES[-1]).clip(_MINUTES[0])
    norm = BoundaryNorm(_MINUTES, 256)
    filled = axes.contourf(x, rows, never, levels=_MINUTES, cmap=colormaps["viridis_r"], norm=norm)
    axes.contour(x, rows, never, levels=[10.0], colors=EMPIRICAL, linewidths=1.5)
    axes.contour(x, rows, never, levels=[5.0], colors=EMPIRICAL, linewidths=1.2, linestyles="dashed")
    return filled


def _final(axes: Axes, axis: str, part: pd.DataFrame) -> ContourSet:
    x, rows, final = _table(axes, axis, part, "final")
    levels = np.linspace(0.5, 1.0, 11)
    filled = axes.contourf(x, rows, final.clip(0.5, 1.0), levels=levels, cmap=colormaps["cividis"])
    axes.contour(x, rows, final, levels=[0.8], colors=EMPIRICAL, linewidths=1.5)
    return filled


def _table(axes: Axes, axis: str, part: pd.DataFrame, value: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Label the axes and return x, evenly spaced rows (grids are seldom linear) and the values."""
    table = part.pivot_table(index=axis, columns="accuracy", values=value, dropna=False, aggfunc="first")
    if axis == "period" and 0 in table.index:  # never comes after the longest period
        table = table.reindex([p for p in table.index if p] + [0])
    x, y = table.columns.to_numpy(float), table.index.to_numpy(float)
    rows = np.arange(len(y))
    axes.set_yticks(rows, ["never" if axis == "period" and v == 0 else f"{v:g}" for v in y])
    axes.set(xlabel="decoder: % correct", ylabel=_AXIS_LABELS[axis])
    return x, rows, table.to_numpy(float)
