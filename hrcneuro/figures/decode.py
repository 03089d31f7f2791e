"""The group's figure of decode: a forest plot, one row a subject, one panel a scenario and problem."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hrcneuro.figures import intervals
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
    figure = Figure(figsize=(1.3 + 2.0 * columns, height + 0.3 + 0.14 * (columns == 1)))
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    means, cut = [], False
    for axis, ((scenario, problem), part) in zip(axes.flat, panels, strict=False):
        here = (table2["scenario"] == scenario) & (table2["problem"] == problem)
        group = table2[here].set_index("measure")
        means += [intervals.ends(row["mean"], row["half_width"]) for _, row in group.loc[below].iterrows()]
        cut |= _panel(axis, part, group, subjects, below)
        classes = part.iloc[0]
        place = "" if scenario == "all" else f"{scenario}: "
        axis.set_title(f"{place}{classes['class1']} vs {classes['class2']}", fontsize=8)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    half = _INTERVAL * scores["bacc_se"]
    drawn = np.concatenate([scores["bacc"] - half, scores["bacc"] + half, scores["chance"], np.ravel(means)])
    low, high = np.nanmin(drawn), np.nanmax(drawn)
    axes[0, 0].set_xlim(intervals.limits(max(low, intervals.LOW), min(high, intervals.HIGH), at_least=(36.0, 74.0)))
    for axis in axes[-1]:
        axis.set_xlabel("balanced accuracy (%)")
    sure = bool(np.isfinite(table2["half_width"][table2["measure"].isin(below)].astype(float)).any())
    _legend(figure, axes.flat[0], columns, sure=sure, cut=cut)
    return figure


def _legend(figure: Figure, axis: Axes, columns: int, *, sure: bool, cut: bool) -> None:
    handles, _ = axis.get_legend_handles_labels()
    mean: Any = {"color": _MEAN, "marker": "D", "ms": 5, "lw": 2 if sure else 0}
    handles.insert(2, Line2D([], [], label="mean, 95 % interval over subjects" if sure else "mean", **mean))
    handles += [intervals.key()] if cut else []
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=7)


def _panel(axis: Axes, part: pd.DataFrame, group: Any, subjects: list[str], below: list[str]) -> bool:
    """Draw a panel; return whether an interval over subjects goes on beyond what is drawn."""
    rows = np.array([len(subjects) - subjects.index(s) for s in part["subject"]])
    bacc = part["bacc"].to_numpy(dtype=float)
    half = _INTERVAL * part["bacc_se"].to_numpy(dtype=float)
    axis.axvline(50, color=GREY, lw=1)
    axis.axhline(0.4, color=GREY, lw=0.5)
    axis.hlines(rows, bacc - half, bacc + half, color=INK, lw=1)
    axis.plot(bacc, rows, "o", color=INK, ms=4, label="subject, 95 % interval over trials")
    axis.plot(part["chance"], rows, "|", color=GREY, ms=9, mew=1.5, label="chance level (95 %)")
    for row in sorted(set(range(1, len(subjects) + 1)) - set(rows.tolist())):
        _nothing(axis, row, "too few trials")
    cut = False
    for place, name in enumerate(below):
        # What few subjects have says nothing of the group.
        if 2 * group.loc[name, "n"] >= len(part):
            cut |= intervals.draw(axis, float(group.loc[name, "mean"]), float(group.loc[name, "half_width"]), -place,
                                  _MEAN)  # fmt: skip
        else:
            _nothing(axis, -place, "too few subjects")
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
    return cut


def _nothing(axis: Axes, place: float, why: str) -> None:
    axis.text(51, place, why, fontsize=6.5, color=GREY, va="center")
