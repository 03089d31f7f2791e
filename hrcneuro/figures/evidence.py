"""The figure of the evidence: people in a closed loop beside what was foretold of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PLACED, PURPLE, SKY, VERMILION, save
from hrcneuro.learning.gaze import CHANCE, TAIL
from hrcneuro.learning.sweep import LEVEL, needed

_PREDICTORS = {
    "eq3-6": (BLUE, "o", "Eq 3–6 (design tool)"),
    "fixed": (ORANGE, "s", "the game, fixed partner"),
    "adapting": (VERMILION, "D", "the game, adapting partner"),
}
_GOAL = CHANCE + (1 - CHANCE) * (2 * LEVEL - 1)  # right guesses of three as far above chance as LEVEL of two
_BESIDE = 1.0  # percent of accuracy between two points that would cover each other
# From the worst decoders to the best.
_BINS = {"< 0.60": GREY, "0.60-0.75": PURPLE, "0.75-0.85": SKY, ">= 0.85": GREEN}
_SMALL = {"columnspacing": 1.0, "handlelength": 1.4}
_WORDS = {"< 0.60": "below 60 %", "0.60-0.75": "60–75 %", "0.75-0.85": "75–85 %", ">= 0.85": "from 85 %"}


def draw(
    sessions: pd.DataFrame,
    guesses: pd.DataFrame,
    predicted: pd.DataFrame,
    design: pd.DataFrame,
    *,
    path: Path,
) -> None:
    """Draw right guesses over the decoder's accuracy, over trials, and seen against foretold.

    Args:
        sessions, guesses, predicted, design: The rows of the tables of these names.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 3.3))
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.35, 1.1, 1.0))
        _over_accuracy(left, sessions, predicted, design)
        _over_trials(middle, guesses)
        _calibration(right, predicted)
        titles = ("A  by the decoder", "B  as a session goes on", "C  foretold and seen")
        for axes, title in zip((left, middle, right), titles, strict=True):
            axes.set_title(title, loc="left")
        # Below the panels: above the curves there is no room.
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower left", ncols=3, columnspacing=1.2, handlelength=1.6)
        figure.legend(*middle.get_legend_handles_labels(), loc="outside lower right", ncols=2, **_SMALL)
        save(figure, path)


def _over_accuracy(axes: Axes, sessions: pd.DataFrame, predicted: pd.DataFrame, design: pd.DataFrame) -> None:
    axes.axhline(100 * CHANCE, color=PALE, lw=0.8, zorder=0)
    axes.axhline(100 * _GOAL, color=GREY, lw=0.7, ls="--", zorder=0)
    for name, (colour, _, label) in _PREDICTORS.items():
        own = design[design["predictor"] == name]
        if len(own):
            mean, half = 100 * own["predicted"].to_numpy(), 100 * own["half_width"].to_numpy()
            axes.fill_between(own["accuracy"], mean - half, mean + half, color=colour, alpha=0.18, lw=0)
            axes.plot(own["accuracy"], mean, color=colour, lw=1.2, label=label)
    x, y = 100 * sessions["balanced"].to_numpy(), 100 * sessions["last_right"].to_numpy()
    axes.set(
        xlabel="online decoder: balanced accuracy (%)", ylabel="right guesses, last ten (%)", ylim=(-4, 104),
        xlim=(min(44.0, x.min() - 2), 101),
    )  # fmt: skip
    _needed(axes, design)
    axes.plot(_apart(x, y), y, "o", color=INK, ms=2.6, alpha=0.45, mew=0, label="a session", clip_on=False)
    seen = predicted[(predicted["predictor"] == "eq3-6") & (predicted["bin"] != "all")]
    for row in seen.to_dict("records"):
        of = sessions["bin"] == row["bin"]
        middle = 100 * float(sessions["balanced"][of].mean())
        mean, low, high = (100 * row[name] for name in ("observed", "low", "high"))
        axes.errorbar(
            middle, mean, yerr=_whiskers(mean, low, high), fmt="o", color=INK, ms=4.5, lw=1.1,
            capsize=2, zorder=5, label="_" if row["bin"] != seen["bin"].iloc[0] else "sessions, mean",
        )  # fmt: skip


def _whiskers(middle: Any, low: Any, high: Any) -> np.ndarray:
    """Return the lengths of an interval below and above, shape (2, n); nan, not drawn, where it is not known."""
    lengths = np.array([np.atleast_1d(middle - low), np.atleast_1d(high - middle)], float)
    return np.maximum(lengths, 0.0)


def _apart(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return where points of equal height are drawn so that none covers another: moved sideways, in percent."""
    drawn = x.astype(float)
    for height in np.unique(y):
        of = np.flatnonzero(y == height)
        groups: list[list[int]] = []
        for i in of[np.argsort(x[of], kind="stable")].tolist():
            groups.append([i])
            # A group that has grown may have come up to the one before.
            while len(groups) > 1 and _places(x, groups[-1])[0] - _places(x, groups[-2])[-1] < _BESIDE:
                last = groups.pop()
                groups[-1] += last
        for group in groups:
            drawn[group] = _places(x, group)
    return drawn


def _places(x: np.ndarray, group: list[int]) -> np.ndarray:
    """Return the places of points side by side about their mean, none beyond 0 or 100 %; a single one stays."""
    if len(group) == 1:
        return np.asarray(x[group], float)
    width = _BESIDE * (len(group) - 1)
    first = np.clip(x[group].mean() - width / 2, 0.0, max(100.0 - width, 0.0))
    return np.asarray(first + _BESIDE * np.arange(len(group)))


def _needed(axes: Axes, design: pd.DataFrame) -> None:
    """Mark the accuracy with which the design tool's robot is as good as the goal asks for."""
    own = design[design["predictor"] == "eq3-6"]
    accuracy, mean, half = (own[name].to_numpy() for name in ("accuracy", "predicted", "half_width"))
    found = needed(accuracy, mean, half, _GOAL)
    if np.isfinite(found.accuracy):
        high = found.high if np.isfinite(found.high) else float(own["accuracy"].max())
        axes.axvspan(found.low, high, color=BLUE, alpha=0.12, lw=0, zorder=0)
        axes.axvline(found.accuracy, color=BLUE, lw=0.9, ls=":", zorder=0)
        axes.annotate(
            f"{found.accuracy:.1f} % needed",
            (high, 0),
            xytext=(3, 1),
            textcoords="offset points",
            color=BLUE,
            fontsize=6,
        )
    axes.annotate(
        "as 80 % right choices", (axes.get_xlim()[0], 100 * _GOAL), xytext=(2, 1.5), textcoords="offset points",
        color=GREY, fontsize=6,
    )  # fmt: skip


def _over_trials(axes: Axes, guesses: pd.DataFrame) -> None:
    axes.axhline(100 * CHANCE, color=PALE, lw=0.8, zorder=0)
    for place, (interval, colour) in enumerate(_BINS.items()):
        own = guesses[guesses["bin"] == interval]
        if len(own):
            # Side by side, so that their intervals can be told apart.
            middle = own["trial"].to_numpy() - (TAIL - 1) / 2 + 0.8 * (place - 1.5)
            y, low, high = (100 * own[name].to_numpy() for name in ("right", "low", "high"))
            label = f"{_WORDS[interval]} ({own['sessions'].iloc[0]} sessions)"
            axes.plot(middle, y, "o-", color=colour, lw=1.3, ms=3.5, label=label)
            axes.vlines(middle, low, high, color=colour, lw=0.8, alpha=0.7)
    axes.set(xlabel="trial", ylabel="right guesses (%)", ylim=(-4, 104), xlim=(0, None))


def _calibration(axes: Axes, predicted: pd.DataFrame) -> None:
    axes.plot([0, 100], [0, 100], color=PALE, lw=0.9, zorder=0)
    for name, (colour, marker, label) in _PREDICTORS.items():
        own = predicted[(predicted["predictor"] == name) & (predicted["bin"] != "all")]
        if not len(own):
            continue
        own = own.sort_values("predicted")
        x, y, low, high = (100 * own[c].to_numpy() for c in ("predicted", "observed", "low", "high"))
        axes.errorbar(
            x, y, yerr=_whiskers(y, low, high), fmt=marker, color=colour, ms=3.5, lw=0.8,
            capsize=1.5, label=label,
        )  # fmt: skip
    axes.set(xlabel="foretold, last ten (%)", ylabel="seen, last ten (%)", xlim=(25, 102), ylim=(-4, 104))
    axes.annotate("as foretold", (97, 99), color=GREY, fontsize=6, ha="right")
