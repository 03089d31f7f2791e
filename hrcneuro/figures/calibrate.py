"""The figure of calibrate: held-out blocks beside rules without EEG, and how far a score can be believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.figures.style import BLUE, COLOURS, CONTINUATION, GREY, INK, PLACED, save

Floats = NDArray[np.float64]

_BINS = 24
_MARKS = ("o", "s", "^", "D")


@dataclass(frozen=True)
class CalibratedPanel:
    """One problem.

    Attributes:
        title: Above it.
        classes: Names of class 1 and class 2.
        blocks: Each held-out block with its balanced accuracy in percent, NaN where a class is absent.
        scenarios: The scenario of each block; empty without one.
        mean: Balanced accuracy over all held-out trials, and its standard error, percent.
        rules: Name of a rule without EEG, and its balanced accuracy, percent.
        scores: Held-out scores of class 1 and of class 2.
        slope, offset: Of the log-odds of class 2.
    """

    title: str
    classes: tuple[str, str]
    blocks: Sequence[tuple[int, float]]
    scenarios: Sequence[str]
    mean: tuple[float, float]
    rules: Sequence[tuple[str, float]]
    scores: tuple[Floats, Floats]
    slope: float
    offset: float


def draw(panels: Sequence[CalibratedPanel], path: Path, *, note: str) -> None:
    """Draw a row a problem, blocks on the left, scores on the right; the PDF lies beside the PNG."""
    with rc_context(PLACED):
        figure = Figure(figsize=(6.6, 2.35 * len(panels) + 0.2))
        rows = figure.subplots(len(panels), 2, squeeze=False, width_ratios=(1.15, 1))
        for panel, (left, right) in zip(panels, rows, strict=True):
            _blocks(left, panel)
            _scores(right, panel)
        figure.supxlabel(note, fontsize=6.5, color=GREY, x=0.01, ha="left")
        save(figure, path)


def _blocks(axes: Axes, panel: CalibratedPanel) -> None:
    numbers = np.array([number for number, _ in panel.blocks])
    values = np.array([value for _, value in panel.blocks])
    mean, error = panel.mean
    axes.axhspan(mean - 1.96 * error, mean + 1.96 * error, color=BLUE, alpha=0.15, lw=0)
    axes.axhline(mean, color=BLUE, lw=1.2, label="all held-out trials, 95 %")
    axes.axhline(50, color=GREY, lw=0.7, ls=":")
    for i, scenario in enumerate(dict.fromkeys(panel.scenarios)):
        here = [one == scenario for one in panel.scenarios]
        axes.plot(numbers[here], values[here], _MARKS[i % len(_MARKS)], ms=4, color=INK, mfc=INK if i == 0 else "w",
                  label=f"blocks, {scenario}" if scenario else "blocks")  # fmt: skip
    for i, (name, value) in enumerate(panel.rules):
        axes.axhline(value, color=COLOURS[(i + 3) % len(COLOURS)], lw=1, ls="--", label=f"no EEG: {name}")
    axes.set(xlabel="block that was held out", ylabel="balanced accuracy (%)", title=panel.title)
    axes.set_xticks(numbers)
    drawn = [*values[np.isfinite(values)], mean, 50, *(value for _, value in panel.rules)]
    low, high = min(drawn), max(drawn)
    axes.set_ylim(low - 5, high + 0.42 * max(high - low, 20))
    axes.legend(loc="upper left", ncols=2, fontsize=6, handlelength=1.6, columnspacing=1.0)


def _scores(axes: Axes, panel: CalibratedPanel) -> None:
    both = np.concatenate(panel.scores)
    edges: Any = np.linspace(both.min(), both.max(), _BINS + 1).tolist() if np.ptp(both) > 0 else _BINS
    for scores, name, colour in zip(panel.scores, panel.classes, (CONTINUATION, COLOURS[1]), strict=True):
        axes.hist(scores, bins=edges, density=True, histtype="step", color=colour, label=f"{name} ({len(scores)})")
    axes.axvline(0, color=GREY, lw=0.7, ls=":")
    axes.set(xlabel="score of a held-out trial", yticks=[])
    axes.spines["left"].set_visible(False)
    axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
    second = axes.twinx()
    at = np.linspace(*axes.get_xlim(), 200)
    second.plot(at, 100 / (1 + np.exp(-np.clip(panel.slope * at + panel.offset, -50, 50))), color=BLUE, lw=1.2)
    second.set(ylim=(0, 135), yticks=[0, 50, 100])
    second.set_ylabel("probability of takeover (%)", color=BLUE)
    second.spines["right"].set_visible(True)
    axes.legend(loc="upper left", ncols=2, fontsize=6, handlelength=1.2)
