"""The figures of the stage simulate that the paper does not have: learners, confound, sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

from hrcneuro.figures.simulate import EMPIRICAL
from hrcneuro.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PLACED, PURPLE, SKY, save
from hrcneuro.learning.compare import Comparison, paired
from hrcneuro.learning.simulations import Curve, Variant

_NAMES = {
    "paper": "Eq 3–6 (paper)",
    "votes": "votes",
    "confidence": "Eq 3–6, confidence",
    "bayes": "Bayes, decisions",
    "bayes_graded": "Bayes, graded",
    "forgetting": "Bayes, forgetting",
    "adaptive": "Bayes, adaptive",
}
_COLOURS = {
    "paper": EMPIRICAL,
    "votes": "#999999",
    "confidence": ORANGE,
    "bayes": SKY,
    "bayes_graded": BLUE,
    "forgetting": PURPLE,
    "adaptive": GREEN,
}
_MINUTES = (1, 2, 5, 10, 20, 40, 80)
_AXIS_LABELS = {
    "subtasks": "subtasks n",
    "chosen": "subtasks of the human m",
    "alpha": "learning rate α",
    "tau": "temperature τ",
    "events": "events in an episode",
    "period": "episodes between reassignments",
}


def learners(variants: Sequence[Variant], found: Comparison, path: Path) -> None:
    """Draw the learners' curves for three tasks, and below their paired differences from Eq 3–6 for all."""
    # SIM2's empirical curve is SIM1's once more.
    shown = [i for i, v in enumerate(variants) if v.name.endswith("emp") and v.simulation != "SIM2"]
    top = shown[:3]
    difference, half = paired(found.values[:, :, 0:1])
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 6.4))
        upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(1, 1.15), squeeze=False)).ravel()
        for k, (axes, i) in enumerate(zip(np.atleast_1d(upper.subplots(1, len(top))), top, strict=True)):
            for j, name in enumerate(found.learners):
                curve = found.curves[i, j]
                axes.plot(np.arange(1, len(curve) + 1), curve, color=_COLOURS[name], lw=1.2, label=_NAMES[name])
            axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
            axes.set(title=_title(variants[i]), xlabel="episode", ylim=(0.4, 1.02), xlim=(0, found.curves.shape[2]))
            if k == 0:
                axes.set_ylabel("choice accuracy")
                handles, names = axes.get_legend_handles_labels()
        _forest(lower.subplots(), [variants[i] for i in shown], difference[shown, :, 0], half[shown, :, 0], found)
        upper.legend(handles, names, loc="outside lower center", ncols=4)
        save(figure, path)


def _forest(
    axes: Axes, variants: Sequence[Variant], difference: np.ndarray, half: np.ndarray, found: Comparison
) -> None:
    others = list(enumerate(found.learners))[1:]
    for k, (j, name) in enumerate(others):
        x = np.arange(len(variants)) + (k - (len(others) - 1) / 2) * 0.12
        axes.errorbar(x, difference[:, j], half[:, j], fmt="o", ms=3, lw=1, color=_COLOURS[name])
    axes.axhline(0, color=EMPIRICAL, lw=1)
    axes.set_xticks(range(len(variants)), [_title(v).replace(", ", ",\n") for v in variants])
    n = found.values.shape[-1]
    axes.set(
        ylabel="choice accuracy, mean over episodes,\nminus that of Eq 3–6",
        title=f"empirical decoder: paired differences on the same draws, 95 % intervals, {n} repetitions",
    )


def _title(variant: Variant) -> str:
    task = variant.task
    moving = {"never": "", "once": ", reassigned once", "every": f", reassigned every {task.period}"}[task.reassign]
    size = f", n = {task.subtasks}, m = {task.chosen}" if variant.simulation == "SIM4" else ""
    return f"{variant.simulation}{size}{moving}"


def confound(variants: Sequence[Variant], curves: Sequence[Curve], path: Path) -> None:
    """Draw learning from decoders of the same rates that answer to different things."""
    colours = (EMPIRICAL, ORANGE, SKY, INK)
    with rc_context(PLACED):
        figure = Figure(figsize=(4.6, 3.2))
        axes = figure.subplots()
        for variant, curve, colour in zip(variants, curves, colours, strict=True):
            episode, band = np.arange(1, len(curve.mean) + 1), curve.half_width
            axes.fill_between(episode, curve.mean - band, curve.mean + band, color=colour, alpha=0.2, linewidth=0)
            axes.plot(episode, curve.mean, color=colour, lw=1.2, label=variant.name)
        axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
        axes.set(
            title=f"the same rates, answering to … (95 % band, {curves[0].n} repetitions)",
            xlabel="episode",
            ylabel="choice accuracy",
            xlim=(0, len(curves[0].mean)),
            ylim=(0.4, 1.02),
        )
        axes.legend(loc="upper left")
        save(figure, path)


def sweep(slices: Sequence[tuple[str, pd.DataFrame]], config: Any, path: Path) -> None:
    """Draw minutes to 80 % over decoder accuracy, one panel for every other axis that varies.

    Where tasks change, the first time at 80 % says little: that panel shows the accuracy at the end instead.
    """
    slices = [(axis, part) for axis, part in slices if part["accuracy"].nunique() > 1]
    with rc_context(PLACED):
        across = max(1, min(3, len(slices)))
        down = max(1, -(-len(slices) // across))
        figure = Figure(figsize=(1.4 + 2.3 * across, 0.8 + 2.2 * down))
        panels = figure.subplots(down, across, squeeze=False)
        bars: dict[str, ContourSet] = {}
        for axes, (axis, part) in zip(panels.flat, slices, strict=False):
            if axis == "period":
                bars[f"choice accuracy after {config.episodes} episodes"] = _final(axes, axis, part)
            else:
                bars["minutes to 80 % choice accuracy (1 s a trial)"] = _minutes(axes, axis, part)
        for axes in panels.flat[len(slices) :]:
            axes.set_axis_off()
        for label, filled in bars.items():
            figure.colorbar(filled, ax=panels, aspect=30, pad=0.02).set_label(label)
        if not slices:
            panels[0, 0].text(0.5, 0.5, "a picture needs accuracy and\none more axis", ha="center", va="center")
        figure.suptitle(
            f"learner: {_NAMES[config.sweep_learner]}; lines: 80 % in 10 min at 1 s (solid) and 2 s a trial (dashed); "
            f"white: not in {config.episodes} episodes",
            fontsize=8,
        )
        save(figure, path)


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
