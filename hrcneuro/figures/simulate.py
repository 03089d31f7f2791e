"""The figures of the stage simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hrcneuro.figures.style import GREY, PLACED, VERMILION, save
from hrcneuro.learning.milestones import first_at
from hrcneuro.learning.simulations import Curve, Variant

EMPIRICAL = VERMILION  # the curve that counts; the levels are ordered, so their colours are a ramp

_TOP = (
    ("A", "SIM1", "empirical decoder"),
    ("B", "SIM2", "better and worse decoders"),
    ("C", "SIM3", "tasks reassigned"),
)

Pairs = list[tuple[Variant, Curve]]


def fig4(
    variants: Sequence[Variant], curves: Sequence[Curve], expected: Mapping[tuple[str, str], np.ndarray], path: Path
) -> None:
    """Draw Fig 4: A SIM1, B SIM2, C SIM3, D SIM4 with one plot a test case; A with the analytic expectation."""
    pairs = list(zip(variants, curves, strict=True))
    cases = list(dict.fromkeys(v.name.split()[0] for v, _ in pairs if v.simulation == "SIM4"))
    colours = _colours([v.name for v, _ in pairs if v.simulation == "SIM2"])
    with rc_context(PLACED):
        figure = Figure(figsize=(7.2, 5.0 if cases else 2.9))
        grid = figure.add_gridspec(2 if cases else 1, 12)
        for i, (letter, simulation, title) in enumerate(_TOP):
            axes = figure.add_subplot(grid[0, 4 * i : 4 * i + 4])
            chosen = [(v, c) for v, c in pairs if v.simulation == simulation]
            _panel(axes, chosen, f"{simulation}: {title}", colours)
            _letter(axes, letter)
            if letter == "A":
                _milestones(axes, chosen[0][1])
                _expected(axes, expected.get(("SIM1", "emp")))
                axes.set_ylabel("choice accuracy")
            if letter == "C":
                _reassignments(axes, chosen[0][0])
        edges = np.linspace(0, 12, max(len(cases), 1) + 1).astype(int)
        for i, case in enumerate(cases):
            axes = figure.add_subplot(grid[1, edges[i] : edges[i + 1]])
            n, m = (int(part) for part in case.split("/"))
            chosen = [(v, c) for v, c in pairs if v.simulation == "SIM4" and v.name.split()[0] == case]
            _panel(axes, chosen, f"{n} subtasks\nhuman {m}, robot {n - m}", colours)
            axes.set_ylabel("choice accuracy" if i == 0 else "")
            if i == 0:
                _letter(axes, "D")
        _legend(figure, colours, curves[0].n)
        save(figure, path)


def _colours(names: Sequence[str]) -> dict[str, Any]:
    levels = sorted((name for name in names if name != "emp"), key=float)
    ramp = colormaps["viridis_r"](np.linspace(0.25, 0.95, max(len(levels), 1)))
    return {"emp": EMPIRICAL, **dict(zip(levels, ramp, strict=False))}


def _panel(axes: Axes, pairs: Pairs, title: str, colours: dict[str, Any]) -> None:
    axes.axhline(0.5, color=GREY, lw=0.7, ls=":")
    for variant, curve in sorted(pairs, key=lambda pair: pair[0].name.endswith("emp")):
        episode = np.arange(1, len(curve.mean) + 1)
        colour = colours.get(variant.name.split()[-1])
        if colour is None:  # one subject's decoder
            axes.plot(episode, curve.mean, color=GREY, lw=0.5, alpha=0.7)
            continue
        band = curve.half_width
        axes.fill_between(episode, curve.mean - band, curve.mean + band, color=colour, alpha=0.25, linewidth=0)
        axes.plot(episode, curve.mean, color=colour, lw=1.2)
    axes.set(title=title, xlabel="episode", xlim=(0, len(pairs[0][1].mean)), ylim=(0.4, 1.02))


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


def _expected(axes: Axes, expected: np.ndarray | None) -> None:
    if expected is None:
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


def _milestones(axes: Axes, curve: Curve) -> None:
    for level in (0.7, 0.8):
        episode = first_at(curve.mean, level)
        if episode is not None:
            axes.plot([0, episode, episode], [level, level, 0.4], color=GREY, lw=0.7, ls="--")
            axes.annotate(
                f"{level:.0%} at\nepisode {episode}",
                (episode, 0.41),
                xytext=(3, 1),
                textcoords="offset points",
                fontsize=7,
            )


def _reassignments(axes: Axes, variant: Variant) -> None:
    for episode in np.flatnonzero(np.diff(variant.task.segment)) + 1:
        axes.axvline(episode + 0.5, color=GREY, lw=0.7, ls="--")


def _letter(axes: Axes, letter: str) -> None:
    axes.set_title(letter, loc="left", fontsize=11, fontweight="bold", x=-0.16)
