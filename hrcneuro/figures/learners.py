"""The figure of learners compared: their curves on the same draws, and their paired differences from Eq 3–6."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.simulate import EMPIRICAL
from hrcneuro.figures.style import BLUE, GREEN, GREY, ORANGE, PLACED, PURPLE, SKY, save

NAMES = {
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
_KEY = ["simulation", "variant"]


def draw(table: pd.DataFrame, curves: pd.DataFrame, path: Path) -> None:
    """Draw the learners' curves for three tasks, and below their paired differences from Eq 3–6 for all.

    Args:
        table: The rows of learners.parquet.
        curves: The rows of learner_curves.parquet.
        path: The PNG file; the PDF lies beside it.
    """
    # SIM2's empirical curve is SIM1's once more.
    shown = table[(table["measure"] == "mean") & table["variant"].str.endswith("emp") & (table["simulation"] != "SIM2")]
    variants = shown.drop_duplicates(_KEY).to_dict("records")
    top = variants[:3]
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 6.4))
        upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=(1, 1.15), squeeze=False)).ravel()
        for k, (axes, variant) in enumerate(zip(np.atleast_1d(upper.subplots(1, len(top))), top, strict=True)):
            here = curves[(curves[_KEY] == [variant[name] for name in _KEY]).all(axis=1)]
            for name, curve in here.groupby("learner", sort=False):
                axes.plot(curve["episode"], curve["mean"], color=_COLOURS[str(name)], lw=1.2, label=NAMES[str(name)])
            axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
            axes.set(title=_title(variant), xlabel="episode", ylim=(0.4, 1.02), xlim=(0, here["episode"].max()))
            if k == 0:
                axes.set_ylabel("choice accuracy")
                handles, names = axes.get_legend_handles_labels()
        _forest(lower.subplots(), shown, [_title(v).replace(", ", ",\n") for v in variants])
        upper.legend(handles, names, loc="outside lower center", ncols=4)
        save(figure, path)


def _forest(axes: Axes, rows: pd.DataFrame, titles: list[str]) -> None:
    # The first learner is the one that the others are compared with.
    others = list(rows.groupby("learner", sort=False))[1:]
    for k, (name, row) in enumerate(others):
        x = np.arange(len(row)) + (k - (len(others) - 1) / 2) * 0.12
        axes.errorbar(x, row["difference"], row["half_width"], fmt="o", ms=3, lw=1, color=_COLOURS[str(name)])
    axes.axhline(0, color=EMPIRICAL, lw=1)
    axes.set_xticks(range(len(titles)), titles)
    axes.set(
        ylabel="choice accuracy, mean over episodes,\nminus that of Eq 3–6",
        title="empirical decoder: paired differences on the same draws, 95 % intervals, "
        f"{rows['n'].iloc[0]} repetitions",
    )


def _title(variant: dict[Any, Any]) -> str:
    every = f", reassigned every {variant['period']}"
    moving = {"never": "", "once": ", reassigned once", "every": every}[variant["reassign"]]
    size = f", n = {variant['subtasks']}, m = {variant['chosen']}" if variant["simulation"] == "SIM4" else ""
    return f"{variant['simulation']}{size}{moving}"
