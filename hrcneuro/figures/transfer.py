"""The figures of transfer: learning curves over minutes of cap time, and every subject by way."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hrcneuro.figures import intervals
from hrcneuro.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PLACED, VERMILION, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

# Way and calibration -> name, colour, marker; the order in which they are listed.
LOOKS: dict[tuple[str, str], tuple[str, str, str]] = {
    ("own", "all"): ("own, all calibration trials", INK, "o"),
    ("pooled", "none"): ("others pooled, no calibration", ORANGE, "s"),
    ("recentred", "none"): ("others recentred, no calibration", BLUE, "^"),
    ("recentred", "all"): ("others recentred, own trials without labels", GREEN, "v"),
    ("joint", "all"): ("others recentred and own trials", VERMILION, "D"),
}
_CURVES = {
    "own": ("own trials", INK, "o"),
    "recentred": ("others recentred, own trials without labels", BLUE, "^"),
    "joint": ("others recentred and own trials", VERMILION, "D"),
}


def curves(table: pd.DataFrame, path: Path, *, note: str = "") -> None:
    """Draw balanced accuracy over minutes of cap time: a row a signal, a column a scenario and problem.

    Args:
        table: The rows of curves.parquet.
        path: The PNG file; the PDF lies beside it.
        note: A line above all.
    """
    signals = list(dict.fromkeys(table["signal"]))
    places = sorted(set(zip(table["scenario"], table["problem"], strict=True)))
    with rc_context(PLACED):
        figure = Figure(figsize=(0.8 + 2.1 * len(places), 0.9 + 1.9 * len(signals)))
        panels = figure.subplots(len(signals), len(places), squeeze=False, sharex=True, sharey=True)
        for row, signal in zip(panels, signals, strict=True):
            for axes, (scenario, problem) in zip(row, places, strict=True):
                keep = (table["signal"] == signal) & (table["scenario"] == scenario) & (table["problem"] == problem)
                _curves(axes, table[keep])
                axes.set_title(_title(scenario, problem, signal))
            row[0].set_ylabel("balanced accuracy (%)")
        for axes in panels[-1]:
            axes.set_xlabel("cap time (min)")
        drawn = np.concatenate(
            [table["bacc"] - table["half_width"], table["bacc"] + table["half_width"], table["bacc"]]
        )
        low, high = max(np.nanmin(drawn), intervals.LOW), min(np.nanmax(drawn), intervals.HIGH)
        panels[0, 0].set_ylim(intervals.limits(low, high, at_least=(44.0, 62.0)))
        _legend(figure, panels[0, 0], note)
        save(figure, path)


def _curves(axes: Axes, part: pd.DataFrame) -> None:
    axes.axhline(50, color=GREY, lw=1)
    pooled = part[part["way"] == "pooled"]
    if len(pooled):
        axes.axhline(float(pooled["bacc"].iloc[0]), color=ORANGE, lw=1.2, ls="--", label="others pooled")
    for way, (name, colour, marker) in _CURVES.items():
        own = part[part["way"] == way]
        if own.empty:
            continue
        minutes, mean, half = (own[column].to_numpy(float) for column in ("minutes", "bacc", "half_width"))
        if np.isfinite(half).all():
            axes.fill_between(minutes, mean - half, mean + half, color=colour, alpha=0.13, lw=0)
        axes.plot(minutes, mean, color=colour, lw=1.2, marker=marker, ms=3.5, label=name)


def subjects(scores: pd.DataFrame, tests: pd.DataFrame, path: Path, *, signal: str, note: str = "") -> None:
    """Draw every subject's balanced accuracy by way, one panel a scenario and problem, and the means below.

    Args:
        scores: The rows of scores.parquet.
        tests: The rows of tests.parquet.
        path: The PNG file; the PDF lies beside it.
        signal: Which one is shown.
        note: A line above all.
    """
    scores, tests = scores[scores["signal"] == signal], tests[tests["signal"] == signal]
    names = sorted(scores["subject"].unique())
    shown = [key for key in LOOKS if ((tests["way"] == key[0]) & (tests["calibration"] == key[1])).any()]
    places = sorted(set(zip(scores["scenario"], scores["problem"], strict=True)))
    columns = min(2, len(places))
    lines = -(-len(places) // columns)
    with rc_context(PLACED):
        height = lines * (0.7 + 0.24 * (len(names) + 0.8 * len(shown)))
        figure = Figure(figsize=(1.2 + 2.5 * columns, height + 0.9))
        panels = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
        cut = False
        for axes, (scenario, problem) in zip(panels.flat, places, strict=False):
            here = [(one["scenario"] == scenario) & (one["problem"] == problem) for one in (scores, tests)]
            cut |= _forest(axes, scores[here[0]], tests[here[1]], names, shown)
            axes.set_title(_title(scenario, problem, signal))
        for axes in panels.flat[len(places) :]:
            axes.set_axis_off()
        low, high = float(scores["bacc"].min()), float(scores["bacc"].max())
        panels[0, 0].set_xlim(intervals.limits(low, high, at_least=(40.0, 70.0)))
        for axes in panels[-1]:
            axes.set_xlabel("balanced accuracy (%)")
        _legend(figure, panels[0, 0], note, [intervals.key()] if cut else [])
        save(figure, path)


def _forest(
    axes: Axes, scores: pd.DataFrame, tests: pd.DataFrame, names: list[str], shown: list[tuple[str, str]]
) -> bool:
    """Draw a panel; return whether an interval goes on beyond what is drawn."""
    axes.axvline(50, color=GREY, lw=1)
    axes.axhline(0.4, color=GREY, lw=0.5)
    cut = False
    for place, key in enumerate(shown):
        name, colour, marker = LOOKS[key]
        own = scores[(scores["way"] == key[0]) & (scores["calibration"] == key[1])]
        rows = np.array([len(names) - names.index(one) for one in own["subject"]])
        # Side by side within a subject's row, so that none hides another.
        shift = 0.13 * (place - (len(shown) - 1) / 2)
        axes.plot(own["bacc"], rows - shift, marker, color=colour, ms=3.2, mew=0, label=name)
        mean = tests[(tests["way"] == key[0]) & (tests["calibration"] == key[1])]
        if len(mean):
            row = mean.iloc[0]
            cut |= intervals.draw(axes, float(row["bacc"]), float(row["half_width"]), -0.8 * place, colour)
            if row["significant"]:
                axes.annotate("*", (float(row["bacc"]), -0.8 * place), xytext=(0, 1), textcoords="offset points",
                              ha="center", fontsize=9, color=colour)  # fmt: skip
    ticks = {len(names) - i: name for i, name in enumerate(names)} | {-0.4 * (len(shown) - 1): "means"}
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set_ylim(-0.8 * len(shown) + 0.2, len(names) + 0.7)
    axes.tick_params(axis="y", length=0)
    return cut


def _title(scenario: str, problem: str, signal: str) -> str:
    place = "" if scenario == "all" else f"{scenario}: "
    return f"{place}{problem}, {signal}"


def _legend(figure: Figure, axes: Axes, note: str, more: list[Line2D] | None = None) -> None:
    handles: list[Any] = [*axes.get_legend_handles_labels()[0], *(more or [])]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=7)
    if note:
        figure.suptitle(note, fontsize=7, color=GREY)
