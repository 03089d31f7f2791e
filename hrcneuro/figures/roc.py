"""ROC curves of one subject's decoders: how many trials of class 2 are found at the price of how many false ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import COLOURS, GREY, STYLE, save

_PANEL, _LEFT, _RIGHT, _TOP, _BETWEEN = 1.95, 0.55, 0.1, 0.3, 0.5  # inches
_LINE, _APART = 0.16, 0.42


def draw(roc: pd.DataFrame, scores: pd.DataFrame, path: Path) -> None:
    """Draw a panel a scenario and problem, two a row: a curve a decoder, and the point where it decides.

    Args:
        roc: Rows of roc.parquet.
        scores: Rows of scores.parquet, which have the points and the areas.
        path: The PNG file; the PDF lies beside it.
    """
    panels = list(roc.groupby(["scenario", "problem"], sort=True))
    decoders = list(dict.fromkeys(roc["decoder"]))
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    beside = 3 if columns > 1 else 2  # texts of the legend
    foot = 0.5 + _LINE * (1 + -(-(len(decoders) + 2) // beside))
    width = _LEFT + columns * _PANEL + (columns - 1) * _APART + _RIGHT
    height = _TOP + rows * _PANEL + (rows - 1) * _BETWEEN + foot
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        for k, (key, part) in enumerate(panels):
            left = _LEFT + (k % columns) * (_PANEL + _APART)
            low = height - _TOP - _PANEL - (k // columns) * (_PANEL + _BETWEEN)
            axes = figure.add_axes((left / width, low / height, _PANEL / width, _PANEL / height))
            here = (scores["scenario"] == key[0]) & (scores["problem"] == key[1])
            _panel(axes, part, scores[here].set_index("decoder"), decoders)
            axes.set_title(str(key[1]) if key[0] == "all" else f"{key[0]}: {key[1]}")
            axes.set_xlabel("false positive rate (%)" if k + columns >= len(panels) else "")
            axes.set_ylabel("true positive rate (%)" if k % columns == 0 else "")
        handles, names = axes.get_legend_handles_labels()
        figure.legend(
            handles, names, loc="lower left", ncols=beside, borderaxespad=0.4, handlelength=1.5, columnspacing=1.2
        )
        save(figure, path)


def _panel(axes: Axes, part: pd.DataFrame, scores: pd.DataFrame, decoders: list[str]) -> None:
    axes.plot([0, 100], [0, 100], color=GREY, lw=0.7, ls=":", label="guessing")
    areas = []
    for name, colour, width in zip(decoders, _colours(len(decoders)), _widths(len(decoders)), strict=True):
        curve = part[part["decoder"] == name]
        if curve.empty or not np.isfinite(curve["tpr"]).all():
            continue
        row = scores.loc[name]
        # Every curve begins and ends in a corner; in between it is the mean of the folds'.
        axes.plot(np.r_[0, curve["fpr"], 100], np.r_[0, curve["tpr"], 100], color=colour, lw=width, label=name)
        axes.plot(100 - row["tnr"], row["tpr"], "o", ms=3 + width, mfc=colour, mec="w", mew=0.6)
        areas.append((f"AUC {row['auc']:.0f} %", colour))
    axes.plot([], [], "o", ms=4, color=GREY, label="where it decides")
    for i, (text, colour) in enumerate(areas):
        axes.text(0.97, 0.04 + 0.085 * (len(areas) - 1 - i), text, transform=axes.transAxes, ha="right", color=colour,
                  fontsize=7.5)  # fmt: skip
    ticks = [0, 25, 50, 75, 100]
    axes.set(xlim=(-1, 101), ylim=(-1, 101), xticks=ticks, yticks=ticks)


def _widths(count: int) -> list[float]:
    """Return the lines' widths: where curves coincide, those drawn first look out from below the later ones."""
    return [1.2 + 1.3 * (count - 1 - i) for i in range(count)] if count < 4 else np.linspace(4.5, 1.0, count).tolist()


def _colours(count: int) -> list[str]:
    return [COLOURS[i % len(COLOURS)] for i in range(count)]
