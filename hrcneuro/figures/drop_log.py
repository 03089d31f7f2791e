"""The drop log: how large every trial's amplitude is over the recording, and what was kept of each condition."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, STYLE, VERMILION, save

# Reason -> colour; amplitude is the one that the upper panel explains.
_COLOURS = {"amplitude": VERMILION, "marked": PURPLE, "boundary": ORANGE, "outside": GREEN, "no onset": INK}


def draw(log: pd.DataFrame, conditions: pd.DataFrame, limit_uv: float, path: Path) -> None:
    """Draw the trials' largest amplitudes over the recording, and below the kept and rejected ones by condition.

    Args:
        log: Rows of drop_log.parquet.
        conditions: Rows of conditions.parquet.
        limit_uv: Above which an epoch was rejected, µV.
        path: The PNG file; the PDF lies beside it.
    """
    rows = conditions[conditions["kept"] + conditions["rejected"] > 0]
    width, high, low = 4.8, 2.1, 0.19 * len(rows) + 0.1
    height = high + low + 1.75
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        left, right = 0.75 / width, 1 - 0.12 / width
        upper = figure.add_axes((left, 1 - (0.35 + high) / height, right - left, high / height))
        bars_left = max(0.75, 0.068 * max(map(len, _labels(rows)), default=0) + 0.15) / width
        lower = figure.add_axes((bars_left, 0.75 / height, right - bars_left, low / height))
        _amplitudes(upper, log, limit_uv)
        _conditions(lower, rows)
        dots, bars = (dict(zip(*reversed(one.get_legend_handles_labels()), strict=True)) for one in (upper, lower))
        handles = dots | bars
        # Of rejections that no condition counts (a study's other moves) the upper panel tells.
        figure.legend(
            handles.values(), handles, loc="lower left", ncols=4, fontsize=7, borderaxespad=0.3, handlelength=1,
            columnspacing=1,
        )  # fmt: skip
        save(figure, path)


def _amplitudes(axes: Axes, log: pd.DataFrame, limit_uv: float) -> None:
    placed = log[log["onset_s"].notna() & (log["peak_uv"] > 0)]
    minutes = placed["onset_s"].to_numpy(float) / 60
    peaks, rejected = placed["peak_uv"].to_numpy(float), placed["reason"].notna().to_numpy()
    axes.plot(minutes[~rejected], peaks[~rejected], "o", ms=1.8, mew=0, color=BLUE, alpha=0.6, label="an epoch")
    for reason, colour in _COLOURS.items():
        own = (placed["reason"] == reason).to_numpy(bool)
        axes.plot(minutes[own], peaks[own], "x", ms=4, mew=1, color=colour)
    axes.set_yscale("log")
    axes.axhline(limit_uv, color=VERMILION, lw=0.8, ls="--")
    axes.annotate(
        f"limit {limit_uv:g} µV", (1, limit_uv), (0, -2), xycoords=axes.get_yaxis_transform(),
        textcoords="offset points", ha="right", va="top", fontsize=7, color=VERMILION,
    )  # fmt: skip
    low = float(peaks.min()) if len(peaks) else limit_uv / 10
    axes.set_ylim(0.7 * min(low, limit_uv), 1.6 * max(limit_uv, float(peaks.max(initial=0))))
    axes.set_xlabel("onset (min)")
    axes.set_ylabel("largest |amplitude| (µV)")
    count = int(log["reason"].notna().sum())
    text = f"{len(log) - count} of {len(log)} epochs kept"
    loud = log.loc[log["reason"] == "amplitude", "channel"].value_counts(sort=False)
    # The commonest first; of equals, by name.
    worst = sorted(loud.items(), key=lambda item: (-item[1], str(item[0])))[:3]
    if worst:
        text += f"; too large at {', '.join(f'{name} ({n})' for name, n in worst)}"
    axes.set_title(text, loc="left")


def _labels(rows: pd.DataFrame) -> list[str]:
    return [" ".join(part for part in (_scenario(r), r["case"], _position(r)) if part) for r in rows.to_dict("records")]


def _scenario(row: Mapping[object, object]) -> str:
    return "" if row["scenario"] == "all" else str(row["scenario"])


def _position(row: Mapping[object, object]) -> str:
    return "" if row["position"] == "event" else str(row["position"])


def _conditions(axes: Axes, rows: pd.DataFrame) -> None:
    places = np.arange(len(rows))
    start = rows["kept"].to_numpy(float)
    axes.barh(places, start, color=PALE, label="kept")
    for place, kept in enumerate(rows["kept"]):
        axes.text(0, place, f" {kept}", va="center", fontsize=6.5, color=INK)
    for reason, colour in _COLOURS.items():
        counts = rows[reason.replace(" ", "_")].to_numpy(float)
        if counts.any():
            axes.barh(places, counts, left=start, color=colour, label=reason)
            start = start + counts
    axes.set_yticks(places, _labels(rows))
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("epochs", color="k")
    axes.tick_params(axis="y", length=0)
    axes.axvline(0, color=GREY, lw=0.7)
