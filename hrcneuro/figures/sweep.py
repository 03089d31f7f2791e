"""The figure of the design sweep: how good must a decoder be?"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hrcneuro.figures.learners import NAMES
from hrcneuro.figures.simulate import EMPIRICAL
from hrcneuro.figures.style import BLUE, GREY, INK, PLACED, VERMILION, save

_MINUTES = (1, 2, 5, 10, 20, 40, 80)
_GOAL_MIN = 10.0
# Of the axes that vary, the first of these lies to the right; m and n alone say more in a panel of their own.
_X_ORDER = ("accuracy", "alpha", "tau", "events", "subtasks", "chosen", "period")
_AXIS_LABELS = {
    "accuracy": "decoder: % correct",
    "subtasks": "subtasks n",
    "chosen": "subtasks of the human m",
    "alpha": "learning rate α",
    "tau": "temperature τ",
    "events": "events in an episode",
    "period": "episodes between reassignments",
}
_TRIALS = (("1s", BLUE, "1 s a trial"), ("2s", VERMILION, "2 s a trial"))


def draw(
    table: pd.DataFrame,
    needed: pd.DataFrame,
    usual: Mapping[str, float],
    named: Container[str],
    *,
    episodes: int,
    learner: str,
    path: Path,
) -> None:
    """Draw one axis as curves, several as contours of the minutes to 80 %: one panel for every axis but the first.

    Where tasks change, the first time at 80 % says little: that panel shows the accuracy at the end instead.

    Args:
        table: The rows of sweep.parquet.
        needed: The rows of needed.parquet.
        usual, named: As :func:`slices` takes them.
        episodes: How many were learned.
        learner: Who learned, a name of ``NAMES``.
        path: The PNG file; the PDF lies beside it.
    """
    varied = [a for a in _X_ORDER if table[a].nunique() > 1 and (a != "chosen" or "chosen" in named)]
    x = varied[0] if varied else "accuracy"
    with rc_context(PLACED):
        if len(varied) < 2:
            figure = _curves(table.sort_values(x), needed, x, episodes)
            figure.suptitle(f"learner: {NAMES[learner]}", fontsize=8)
        else:
            panelled = slices(table, usual, named, x=x)
            figure = _contours(panelled, x, episodes)
            words = [f"learner: {NAMES[learner]}", *_meaning([a for a, _ in panelled], x, table, episodes)]
            figure.suptitle("; ".join(words), fontsize=8)
        save(figure, path)


def slices(
    table: pd.DataFrame, usual: Mapping[str, float], named: Container[str], *, x: str = "accuracy"
) -> list[tuple[str, pd.DataFrame]]:
    """Return, for every axis but ``x`` that varies, its points with all other axes at their usual value.

    Where the usual value is not in the grid, the nearest one stands for it.

    Args:
        table: The rows of sweep.parquet.
        usual: Axis -> its usual value, of all axes but accuracy.
        named: The axes that the sweep names; where it does not name m, m follows n.
        x: The axis that all panels share.
    """
    parts = []
    for axis in _X_ORDER[1:]:
        if axis == x or table[axis].nunique() < 2 or (axis == "chosen" and "chosen" not in named):
            continue
        part = table
        for other in ("subtasks", "chosen", "events", "period", "alpha", "tau"):
            # m follows n where it has no axis of its own.
            if other in (axis, x) or (other == "chosen" and "subtasks" in (axis, x)):
                continue
            near = part[other].iloc[int(np.argmin(np.abs(part[other].to_numpy() - usual[other])))]
            part = part[part[other] == near]
        if "subtasks" in (axis, x) and "chosen" not in (axis, x):
            share = usual["chosen"] / usual["subtasks"]
            off = (part["chosen"] - share * part["subtasks"]).abs()
            part = part[off == off.groupby(part["subtasks"]).transform("min")]
        parts.append((axis, part))
    return parts


def _curves(table: pd.DataFrame, needed: pd.DataFrame, x: str, episodes: int) -> Figure:
    """Draw what one axis does: choice accuracy after ten minutes, or at the end, and minutes to 80 %."""
    figure = Figure(figsize=(7.0, 2.9))
    # Grids of other axes are seldom linear: their values stand side by side.
    place = table[x].to_numpy(float) if x == "accuracy" else np.arange(len(table), dtype=float)
    changing = bool((table["period"] > 0).any())
    panels = [figure.subplots()] if changing else list(figure.subplots(1, 2))
    if changing:
        figure.set_size_inches(3.9, 2.9)
        _accuracy(panels[0], place, table, needed, ((None, BLUE, ""),))
        panels[0].set_title(f"after {episodes} episodes")
    else:
        _accuracy(panels[0], place, table, needed, _TRIALS)
        whole = int(needed["episode"].min()) >= episodes
        panels[0].set_title(f"after {episodes} episodes" if whole else "after 10 minutes")
        _time(panels[1], place, table, episodes)
    for axes in panels:
        axes.set_xlabel(_AXIS_LABELS[x])
        if x == "accuracy":
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        else:
            axes.set_xticks(place, _tick_names(x, table[x]))
    return figure


def _accuracy(
    axes: Axes,
    place: np.ndarray,
    table: pd.DataFrame,
    needed: pd.DataFrame,
    trials: Sequence[tuple[str | None, str, str]],
) -> None:
    """Draw choice accuracy with its band, 80 %, and where a decoder is good enough."""
    for (trial, colour, label), row in zip(trials, needed.sort_values("trial_s").to_dict("records"), strict=False):
        name = f"in_time_{trial}" if trial else "final"
        mean, half = 100 * table[name].to_numpy(float), 100 * table[f"{name}_half_width"].to_numpy(float)
        axes.fill_between(place, mean - half, mean + half, color=colour, alpha=0.2, lw=0)
        if len(table) > 1 and table["accuracy"].nunique() > 1 and np.isfinite(row["accuracy"]):
            label = f"{label}: {row['accuracy']:.1f} % needed".removeprefix(": ")
            axes.plot([row["accuracy"]] * 2, [0, 80], color=colour, lw=0.9, ls=":")
        axes.plot(place, mean, color=colour, lw=1.2, marker="o", ms=3, label=label or None)
    axes.axhline(80, color=GREY, lw=0.7, ls="--")
    axes.set(ylabel="right choices (%)", ylim=(min(45.0, _lowest(table)), 102))
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper left")


def _lowest(table: pd.DataFrame) -> float:
    seen = ("in_time_1s", "in_time_2s", "final")
    return 100 * min(float((table[n] - table[f"{n}_half_width"]).min()) for n in seen) - 2


def _time(axes: Axes, place: np.ndarray, table: pd.DataFrame, episodes: int) -> None:
    """Draw minutes to 80 %; a value with which it is not reached is a cross at the top."""
    highest = _GOAL_MIN
    for trial, colour, label in _TRIALS:
        minutes = table[f"minutes_{trial}"].to_numpy(float)
        axes.plot(place, minutes, color=colour, lw=1.2, marker="o", ms=3, label=label)
        highest = max(highest, float(np.nanmax(minutes, initial=0.0)))
    top = 1.15 * highest
    never = table["minutes_1s"].isna().to_numpy()
    if never.any():
        axes.plot(
            place[never], np.full(int(never.sum()), top), "x", color=INK, ms=4, label=f"not in {episodes} episodes"
        )
    axes.axhline(_GOAL_MIN, color=GREY, lw=0.7, ls="--")
    axes.set(ylabel="minutes", ylim=(0, 1.08 * top), title="until 80 % right choices")
    axes.legend(loc="best")


def _meaning(axes: Sequence[str], x: str, table: pd.DataFrame, episodes: int) -> list[str]:
    """Return what the lines and the white of contours are, of those that are drawn."""
    still = [axis for axis in axes if "period" not in (axis, x)]
    if not still:
        return [f"line: 80 % right choices after {episodes} episodes"]
    words = ["lines: 80 % in 10 min at 1 s (solid) and 2 s a trial (dashed)"]
    return [*words, f"white: not in {episodes} episodes"] if table["minutes_1s"].isna().any() else words


def _contours(panelled: Sequence[tuple[str, pd.DataFrame]], x: str, episodes: int) -> Figure:
    across = min(3, len(panelled))
    down = -(-len(panelled) // across)
    # One panel alone would be narrower than what is written above it.
    figure = Figure(figsize=(max(6.4, 1.4 + 2.3 * across), 0.8 + (2.2 if len(panelled) > 1 else 2.8) * down))
    panels = figure.subplots(down, across, squeeze=False)
    bars: dict[str, ContourSet] = {}
    for axes, (axis, part) in zip(panels.flat, panelled, strict=False):
        if "period" in (axis, x):
            bars[f"choice accuracy after {episodes} episodes"] = _final(axes, x, axis, part)
        else:
            bars["minutes to 80 % choice accuracy (1 s a trial)"] = _minutes(axes, x, axis, part)
    for axes in panels.flat[len(panelled) :]:
        axes.set_axis_off()
    for label, filled in bars.items():
        figure.colorbar(filled, ax=panels, aspect=30, pad=0.02).set_label(label)
    return figure


def _minutes(axes: Axes, x: str, axis: str, part: pd.DataFrame) -> ContourSet:
    columns, rows, minutes = _table(axes, x, axis, part, "minutes_1s")
    # "Never" is drawn as white, yet the 10-minute line must not end at the last cell that gets there.
    never = np.where(np.isfinite(minutes), minutes, 10.0 * _MINUTES[-1]).clip(_MINUTES[0])
    norm = BoundaryNorm(_MINUTES, 256)
    filled = axes.contourf(columns, rows, never, levels=_MINUTES, cmap=colormaps["viridis_r"], norm=norm)
    line: dict[str, Any] = {"colors": EMPIRICAL}
    _outline(axes, columns, rows, never, 10.0, linewidths=1.5, **line)
    _outline(axes, columns, rows, never, 5.0, linewidths=1.2, linestyles="dashed", **line)
    return filled


def _final(axes: Axes, x: str, axis: str, part: pd.DataFrame) -> ContourSet:
    columns, rows, final = _table(axes, x, axis, part, "final")
    levels = np.linspace(0.5, 1.0, 11)
    filled = axes.contourf(columns, rows, final.clip(0.5, 1.0), levels=levels, cmap=colormaps["cividis"])
    _outline(axes, columns, rows, final, 0.8, colors=EMPIRICAL, linewidths=1.5)
    return filled


def _outline(axes: Axes, columns: np.ndarray, rows: np.ndarray, values: np.ndarray, level: float, **line: Any) -> None:
    """Draw the contour of a level, where the values lie on both sides of it: Matplotlib warns of others."""
    if np.nanmin(values) < level < np.nanmax(values):
        axes.contour(columns, rows, values, levels=[level], **line)


def _table(axes: Axes, x: str, axis: str, part: pd.DataFrame, value: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Label the axes and return columns, evenly spaced rows (grids are seldom linear) and the values."""
    table = part.pivot_table(index=axis, columns=x, values=value, dropna=False, aggfunc="first")
    if axis == "period" and 0 in table.index:  # never comes after the longest period
        table = table.reindex([p for p in table.index if p] + [0])
    columns, rows = table.columns.to_numpy(float), np.arange(len(table.index))
    if x != "accuracy":
        columns = np.arange(len(table.columns))
        axes.set_xticks(columns, _tick_names(x, table.columns))
    axes.set_yticks(rows, _tick_names(axis, table.index))
    axes.set(xlabel=_AXIS_LABELS[x], ylabel=_AXIS_LABELS[axis])
    return columns, rows, table.to_numpy(float)


def _tick_names(axis: str, values: Any) -> list[str]:
    return ["never" if axis == "period" and value == 0 else f"{value:g}" for value in values]
