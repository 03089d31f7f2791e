"""The group's figure of decode: a forest plot, one row a subject, one panel a scenario and problem."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from hrcneuro.figures.style import BLUE, GREY, INK, PLACED, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MEAN, _PAPER = "#b0246a", BLUE
_INTERVAL = 1.959964  # standard errors to either side: 95 %
# Rows below the subjects: means over subjects. What qualifies them is in the confound panel.
_BELOW = {"bacc": "mean", "lobo_bacc": "one block left out"}


def draw(scores: pd.DataFrame, table2: pd.DataFrame, path: Path) -> None:
    """Save the forest plot of balanced accuracies.

    Args:
        scores: One decoder's rows of subjects.parquet; only computed ones.
        table2: The same decoder's rows of table2.parquet.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(PLACED):
        save(_figure(scores, table2), path)


def _figure(scores: pd.DataFrame, table2: pd.DataFrame) -> Figure:
    panels = list(scores.groupby(["scenario", "problem"], sort=True))
    subjects = sorted(scores["subject"].unique())
    below = [name for name in _BELOW if np.isfinite(scores[name]).any()]
    columns = min(len(panels), 2)
    lines = -(-len(panels) // columns)
    height = lines * (1.4 + 0.24 * (len(subjects) + len(below)))
    figure = Figure(figsize=(1.3 + 2.0 * columns, height + 0.3))
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    for axis, ((scenario, problem), part) in zip(axes.flat, panels, strict=False):
        here = (table2["scenario"] == scenario) & (table2["problem"] == problem)
        _panel(axis, part, table2[here].set_index("measure"), subjects, below)
        classes = part.iloc[0]
        axis.set_title(f"{scenario}: {classes['class1']} vs {classes['class2']}", fontsize=8)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    half = _INTERVAL * scores["bacc_se"]
    drawn = np.concatenate([scores["bacc"] - half, scores["bacc"] + half, scores["chance"]])
    low, high = np.nanmin(drawn), np.nanmax(drawn)
    axes[0, 0].set_xlim(max(-2.0, min(36.0, low - 2)), min(102.0, max(74.0, high + 2)))
    for axis in axes[-1]:
        axis.set_xlabel("balanced accuracy (%)")
    handles, texts = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, texts, loc="outside lower center", ncols=2, frameon=False, fontsize=7)
    return figure


def _panel(axis: Axes, part: pd.DataFrame, group: Any, subjects: list[str], below: list[str]) -> None:
    rows = np.array([len(subjects) - subjects.index(s) for s in part["subject"]])
    bacc = part["bacc"].to_numpy(dtype=float)
    half = _INTERVAL * part["bacc_se"].to_numpy(dtype=float)
    axis.axvline(50, color=GREY, lw=1)
    axis.axhline(0.4, color=GREY, lw=0.5)
    axis.hlines(rows, bacc - half, bacc + half, color=INK, lw=1)
    axis.plot(bacc, rows, "o", color=INK, ms=4, label="subject, 95 % interval over trials")
    axis.plot(part["chance"], rows, "|", color=GREY, ms=9, mew=1.5, label="chance level (95 %)")
    for place, name in enumerate(below):
        # What few subjects have says nothing of the group.
        if 2 * group.loc[name, "n"] >= len(part):
            _mean(axis, group.loc[name], -place, "mean, 95 % interval over subjects" if place == 0 else "")
    # The paper prints no balanced accuracy; it is the mean of its TNR and TPR.
    published = (group.loc["tnr", "published_mean"] + group.loc["tpr", "published_mean"]) / 2
    if np.isfinite(published):
        axis.plot(published, 0, "D", mfc="none", mec=_PAPER, ms=9, label="published mean")
    axis.set_yticks(
        [*range(len(subjects), 0, -1), *range(0, -len(below), -1)], [*subjects, *(_BELOW[n] for n in below)]
    )
    axis.set_ylim(0.3 - len(below), len(subjects) + 0.8)
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(axis="y", length=0)


def _mean(axis: Axes, row: Any, place: int, label: str) -> None:
    mean, half = float(row["mean"]), float(row["half_width"])
    if np.isfinite(half):
        axis.plot([mean - half, mean + half], [place, place], color=_MEAN, lw=2)
    axis.plot(mean, place, "D", color=_MEAN, ms=5, label=label or "_nolegend_")
