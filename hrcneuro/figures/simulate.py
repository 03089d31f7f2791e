"""The figures of simulated learning curves: Fig 4, and what the same rates teach that answer to errors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hrcneuro.figures.style import GREY, INK, ORANGE, PLACED, SKY, VERMILION, save

EMPIRICAL = VERMILION  # the curve that counts; the levels are ordered, so their colours are a ramp

_TOP = (
    ("A", "SIM1", "empirical decoder"),
    ("B", "SIM2", "better and worse decoders"),
    ("C", "SIM3", "tasks reassigned"),
)


def fig4(
    curves: pd.DataFrame, expected: pd.DataFrame, milestones: pd.DataFrame, relearning: pd.DataFrame, *, path: Path
) -> None:
    """Draw Fig 4: A SIM1, B SIM2, C SIM3, D SIM4 with one plot a test case; A with the analytic expectation.

    Args:
        curves, expected, milestones, relearning: The rows of curves.parquet, analytic.parquet, milestones.parquet and
            relearning.parquet.
        path: The PNG file; the PDF lies beside it.
    """
    by_simulation = {str(name): part for name, part in curves.groupby("simulation", sort=False)}
    fourth = by_simulation.get("SIM4", curves.iloc[:0])
    cases = list(fourth.groupby(["subtasks", "chosen"], sort=False))
    colours = _colours(list(by_simulation["SIM2"]["variant"].unique()))
    low = _floor([curves])
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 5.0 if cases else 2.9))
        grid = figure.add_gridspec(2 if cases else 1, 12)
        for i, (letter, simulation, title) in enumerate(_TOP):
            axes = figure.add_subplot(grid[0, 4 * i : 4 * i + 4])
            _panel(axes, by_simulation[simulation], f"{simulation}: {title}", colours, low)
            _letter(axes, letter)
            if letter == "A":
                _milestones(axes, _empirical(milestones), low)
                _expected(axes, _empirical(expected)["expected"].to_numpy())
                axes.set_ylabel("choice accuracy")
            if letter == "C":
                _reassignments(axes, relearning)
        edges = np.linspace(0, 12, max(len(cases), 1) + 1).astype(int)
        for i, (_, part) in enumerate(cases):
            n, m = int(part["subtasks"].iloc[0]), int(part["chosen"].iloc[0])
            axes = figure.add_subplot(grid[1, edges[i] : edges[i + 1]])
            _panel(axes, part, f"{n} subtasks\nhuman {m}, robot {n - m}", colours, low)
            axes.set_ylabel("choice accuracy" if i == 0 else "")
            if i == 0:
                _letter(axes, "D")
        _legend(figure, colours, curves["n"].iloc[0])
        save(figure, path)


def error_readers(curves: pd.DataFrame, path: Path) -> None:
    """Draw learning from decoders of the same rates that answer to different things.

    Args:
        curves: The rows of confound.parquet.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(PLACED):
        figure = Figure(figsize=(4.6, 3.5))
        axes = figure.subplots()
        by_variant = curves.groupby("variant", sort=False)
        for (name, curve), colour in zip(by_variant, (EMPIRICAL, ORANGE, SKY, INK), strict=True):
            _band(axes, curve, colour, alpha=0.2)
            axes.plot(curve["episode"], curve["mean"], color=colour, lw=1.2, label=name)
        axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
        axes.set(
            title=f"the same rates, answering to … (95 % band, {curves['n'].iloc[0]} repetitions)",
            xlabel="episode",
            ylabel="choice accuracy",
            xlim=(0, curves["episode"].max()),
            ylim=(_floor([curves]), 1.02),
        )
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2, handlelength=1.4)
        save(figure, path)


def _floor(tables: Sequence[pd.DataFrame]) -> float:
    """Return where the axis of accuracies begins: a tenth that is below all bands, 0.4 at the most."""
    lowest = min(float((table["mean"] - table["half_width"].fillna(0)).min()) for table in tables)
    return max(0.0, min(0.4, np.floor(10 * lowest) / 10))


def _empirical(table: pd.DataFrame) -> pd.DataFrame:
    return table[(table["simulation"] == "SIM1") & (table["variant"] == "emp")]


def _colours(names: Sequence[str]) -> dict[str, Any]:
    levels = sorted((name for name in names if name != "emp"), key=float)
    ramp = colormaps["viridis_r"](np.linspace(0.25, 0.95, max(len(levels), 1)))
    return {"emp": EMPIRICAL, **dict(zip(levels, ramp, strict=False))}


def _panel(axes: Axes, curves: pd.DataFrame, title: str, colours: dict[str, Any], low: float) -> None:
    axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
    for name, curve in sorted(curves.groupby("variant", sort=False), key=lambda pair: str(pair[0]).endswith("emp")):
        colour = colours.get(str(name).split()[-1])
        if colour is None:  # one subject's decoder
            axes.plot(curve["episode"], curve["mean"], color=GREY, lw=0.5, alpha=0.7)
            continue
        _band(axes, curve, colour, alpha=0.25)
        axes.plot(curve["episode"], curve["mean"], color=colour, lw=1.2)
    axes.set(title=title, xlabel="episode", xlim=(0, curves["episode"].max()), ylim=(low, 1.02))


def _band(axes: Axes, curve: pd.DataFrame, colour: Any, *, alpha: float) -> None:
    low, high = curve["mean"] - curve["half_width"], curve["mean"] + curve["half_width"]
    axes.fill_between(curve["episode"], low, high, color=colour, alpha=alpha, linewidth=0)


def _legend(figure: Figure, colours: dict[str, Any], n: int) -> None:
    lines = [Line2D([], [], color=colour, lw=1.5) for colour in colours.values()]
    labels = ["empirical decoder" if name == "emp" else f"{name} % correct" for name in colours]
    bands = Patch(color=GREY, alpha=0.25, linewidth=0)
    figure.legend(
        [*lines, bands],
        [*labels, f"95 % band of the mean, {n} repetitions"],
        loc="outside lower center",
        ncols=6,
        handlelength=1.2,
        columnspacing=1.2,
    )


def _expected(axes: Axes, expected: np.ndarray) -> None:
    if not len(expected):
        return
    axes.plot(np.arange(1, len(expected) + 1), expected, color="black", lw=0.8, ls=(0, (4, 2)))
    axes.annotate(
        "analytic\nexpectation",
        (0.42 * len(expected), expected[int(0.42 * len(expected))]),
        xytext=(14, -20),
        textcoords="offset points",
        arrowprops={"arrowstyle": "-", "lw": 0.5, "shrinkB": 0},
        fontsize=7,
    )


def _milestones(axes: Axes, milestones: pd.DataFrame, low: float) -> None:
    reached = milestones.drop_duplicates("level").dropna(subset="episode")
    for i, (level, episode) in enumerate(zip(reached["level"], reached["episode"].astype(int), strict=True)):
        axes.plot([0, episode, episode], [level, level, low], color=GREY, lw=0.7, ls="--")
        # One above the other: two levels are often reached within few episodes.
        axes.annotate(
            f"{100 * level:g} % at episode {episode}",
            (episode, low),
            xytext=(2, 4 + 9 * (len(reached) - 1 - i)),
            textcoords="offset points",
            fontsize=7,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )


def _reassignments(axes: Axes, relearning: pd.DataFrame) -> None:
    # The last assignment holds to the end.
    for episode in sorted(relearning["episode"].unique())[:-1]:
        axes.axvline(episode + 0.5, color=GREY, lw=0.7, ls="--")


def _letter(axes: Axes, letter: str) -> None:
    axes.set_title(letter, loc="left", fontsize=11, fontweight="bold", x=-0.16)
