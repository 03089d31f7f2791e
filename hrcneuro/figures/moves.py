"""The figure of all subjects' moves: how long they take, how closely the arm follows, how punctual the markers are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hrcneuro.figures.style import COLOURS, GREY, STYLE, save

Means = Mapping[str, tuple[float, float]]


def draw(
    moves: Mapping[str, pd.DataFrame],
    trials: Mapping[str, pd.DataFrame],
    published_ms: Means,
    radius_m: float,
    path: Path,
) -> None:
    """Draw the distributions over all moves: onset to onset, tracking errors, arrival, and motion after marker.

    Args:
        moves: Subject -> rows of robot's moves.parquet, of one subject at least.
        trials: Subject -> rows of acquire's trials.parquet.
        published_ms: Scenario -> mean and standard deviation of the published time from onset to onset, ms.
        radius_m: Distance from a tile's centre within which the next move is taken.
        path: Of the PNG; the PDF lies beside it.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(5.4, 4.9), layout="constrained")
        (durations, errors), (arrival, markers) = figure.subplots(2, 2)
        _durations(durations, trials, published_ms)
        _errors(errors, moves, 1e3 * radius_m)
        everything = pd.concat(list(moves.values()))
        share = (everything["t_2mm_s"] / everything["t_f_s"]).dropna().to_numpy(float)
        _histogram(arrival, share, f"arrival in the {1e3 * radius_m:g} mm radius", "time of entry / $t_f$", 4, "")
        latency = everything["trigger_latency_ms"].dropna().to_numpy(float)
        _histogram(markers, latency, "from marker to motion", "motion onset after marker (ms)", 2, " ms")
        save(figure, path)


def _histogram(axes: Axes, values: np.ndarray, title: str, label: str, digits: int, unit: str) -> None:
    axes.set(title=title, xlabel=label, ylabel="moves")
    axes.xaxis.set_major_locator(MaxNLocator(4))
    if not len(values):
        axes.text(0.5, 0.5, "none was measured", transform=axes.transAxes, ha="center", color=GREY)
        return
    axes.hist(values, bins=60, color=COLOURS[0])
    axes.set_ylim(0, 1.25 * axes.get_ylim()[1])
    spread = np.std(values, ddof=min(1, len(values) - 1))
    text = f"{values.mean():.{digits}f} ± {spread:.{digits}f}{unit}, n = {len(values)}"
    axes.text(0.98, 0.97, text, transform=axes.transAxes, ha="right", va="top", fontsize=7)


def _durations(axes: Axes, trials: Mapping[str, pd.DataFrame], published_ms: Means) -> None:
    axes.set_title("from onset to onset")
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("share of the moves")
    moves = pd.concat([t[~t["practice"].astype(bool)] for t in trials.values()]) if trials else pd.DataFrame()
    if moves.empty:
        return
    for (scenario, (mean, _)), colour in zip(published_ms.items(), COLOURS, strict=False):
        soa = 1000 * moves.loc[moves["scenario"] == scenario, "soa_s"].dropna().to_numpy(float)
        if len(soa):
            bins = [float(b) for b in range(400, 2000, 25)]
            axes.hist(
                soa, bins=bins, weights=np.full(len(soa), 1 / len(soa)), histtype="step", color=colour, label=scenario
            )
            axes.axvline(mean, color=colour, lw=0.8, ls="--")
    axes.set_xlim(500, 1500)
    axes.plot([], [], color=GREY, lw=0.8, ls="--", label="published mean")
    axes.set_ylim(0, 1.3 * axes.get_ylim()[1])
    axes.legend(loc="upper right", fontsize=6.5)


def _errors(axes: Axes, moves: Mapping[str, pd.DataFrame], radius_mm: float) -> None:
    for column, colour, label in (
        ("max_error_mm", COLOURS[1], "greatest on the way"),
        ("end_error_mm", COLOURS[0], "on arrival"),
    ):
        for i, table in enumerate(moves.values()):
            values = np.sort(table[column].dropna().to_numpy(float))
            share = np.arange(1, len(values) + 1) / max(len(values), 1)
            axes.plot(values, share, color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    axes.axvline(radius_mm, color=GREY, lw=0.8, ls="--", label=f"the {radius_mm:g} mm radius")
    axes.set_xscale("log")
    axes.set_xlabel("distance from the reference (mm)")
    axes.set_ylabel("share of the moves up to it")
    axes.set_title(f"tracking error, {len(moves)} subject{'s' if len(moves) != 1 else ''}")
    axes.set_xlim(0.005, 4)
    axes.legend(loc="upper left", fontsize=6.5)
    axes.set_ylim(0, 1.35)
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1])
