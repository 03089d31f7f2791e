"""The confound panel: is it the takeover that is decoded, or what goes with it?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hrcneuro.figures import intervals
from hrcneuro.figures.style import GREY, STYLE, save

_PLAIN, _STRATUM, _RETRAINED, _FREE = "#222222", "#b0246a", "#2166ac", "#b36b00"
_KINDS = {
    _PLAIN: "all trials",
    _STRATUM: "trained on all, scored within",
    _RETRAINED: "trained and scored within",
    _FREE: "a rule without EEG",
}
# Column of the subjects' scores -> label, colour, stratum whose trials it rests on; a gap between colours.
ROWS: dict[str, tuple[str, str, tuple[str, bool] | None]] = {
    "bacc": ("all trials", _PLAIN, None),
    "prev_error_no_bacc": ("after no error", _STRATUM, ("prev_error", False)),
    "prev_error_yes_bacc": ("after an error", _STRATUM, ("prev_error", True)),
    "turn_no_bacc": ("no turn ahead", _STRATUM, ("turn", False)),
    "turn_yes_bacc": ("turn ahead", _STRATUM, ("turn", True)),
    "matched_bacc": ("after no error", _RETRAINED, ("prev_error", False)),
    "prev_error_fitted_bacc": ("previous error", _FREE, None),
    "turn_fitted_bacc": ("turn ahead", _FREE, None),
}
# What qualifies the plain result: without any of it there is nothing to show.
QUALIFIERS = [name for name in ROWS if name != "bacc"]
_GAP = 0.6


def draw(scores: pd.DataFrame, table2: pd.DataFrame, strata: pd.DataFrame | None, path: Path) -> None:
    """Save one panel a scenario and problem.

    Args:
        scores: One decoder's rows of subjects.parquet; only computed ones.
        table2: The rows of table2.parquet.
        strata: All subjects' rows of strata.parquet, for the numbers of trials; None without.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(STYLE):
        save(figure(scores, table2, strata), path)


def figure(scores: pd.DataFrame, table2: pd.DataFrame, strata: pd.DataFrame | None) -> Figure:
    """Return the figure; arguments as :func:`draw` takes them."""
    panels = list(scores.groupby(["scenario", "problem", "decoder"], sort=True))
    rows = places([name for name in ROWS if np.isfinite(scores[name].to_numpy(float)).any()])
    columns = min(2, len(panels))
    lines = -(-len(panels) // columns)
    tall = 0.55 + 0.24 * (1 - min(rows.values()))
    figure = Figure(figsize=(1.3 + 2.0 * columns, lines * tall + 0.8), layout="constrained")
    axes = figure.subplots(lines, columns, sharey=True, sharex=True, squeeze=False)
    drawn: list[Any] = [scores[list(rows)].to_numpy(float).ravel()]
    cut = False
    for axis, (key, part) in zip(axes.flat, panels, strict=False):
        place = dict(zip(("scenario", "problem", "decoder"), key, strict=True))
        sizes = None if strata is None else _at(strata, place)
        group = _at(table2, place).set_index("measure").loc[list(rows)]
        drawn += [intervals.ends(row["mean"], row["half_width"]) for _, row in group.iterrows()]
        drawn += [group["detectable"].to_numpy(float).clip(intervals.LOW, intervals.HIGH)]
        cut |= _panel(axis, part, group, sizes, rows)
        scenario = "" if place["scenario"] == "all" else f"{place['scenario']}: "
        axis.set_title(f"{scenario}{place['problem']}, n = {len(part)}")
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("balanced accuracy (%)")
    values = np.concatenate(drawn)
    axes[0, 0].set_xlim(intervals.limits(float(np.nanmin(values)), float(np.nanmax(values)), at_least=(40.0, 70.0)))
    axes[0, 0].set_yticks(list(rows.values()), [ROWS[name][0] for name in rows])
    for axis in axes[:, 0]:
        for label, name in zip(axis.get_yticklabels(), rows, strict=True):
            label.set_color(ROWS[name][1])
    axes[0, 0].set_ylim(min(rows.values()) - 0.6, 0.6)
    _legend(figure, list(dict.fromkeys(ROWS[name][1] for name in rows)), columns, cut=cut)
    return figure


def places(names: Sequence[str]) -> dict[str, float]:
    """Return measure -> height of its row, from the top, with a gap wherever the kind changes."""
    rows: dict[str, float] = {}
    height, last = 1.0, ""
    for name in names:
        height -= 1 + _GAP * bool(last and ROWS[name][1] != last)
        rows[name], last = height, ROWS[name][1]
    return rows


def _legend(figure: Figure, shown: Sequence[str], columns: int, *, cut: bool) -> None:
    handles = [Line2D([], [], color=colour, marker="D", ms=4, lw=2, label=_KINDS[colour]) for colour in shown]
    grey: Any = {"color": GREY, "ls": "none", "mew": 0}
    handles += [
        Line2D([], [], marker="o", ms=3, label="a subject", **grey),
        Line2D([], [], marker="^", ms=4, label="smallest mean found with 80 % power", **grey),
    ]
    handles += [intervals.key()] if cut else []
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=6.5, handlelength=1.8)


def _at(table: pd.DataFrame, place: Mapping[str, Any]) -> pd.DataFrame:
    """Return the rows of one scenario, problem and decoder."""
    return table[np.logical_and.reduce([table[column] == value for column, value in place.items()])]


def _panel(axis: Axes, part: pd.DataFrame, group: Any, sizes: pd.DataFrame | None, rows: Mapping[str, float]) -> bool:
    """Draw a panel; return whether an interval goes on beyond what is drawn."""
    cut = False
    axis.axvline(50, color=GREY, lw=0.8)
    axis.tick_params(axis="y", length=0)
    for column, height in rows.items():
        _, colour, stratum = ROWS[column]
        values = part[column].to_numpy(float)
        values = values[np.isfinite(values)]
        # A stratum that few subjects have says nothing of the group.
        if 2 * len(values) < len(part):
            axis.text(50.6, height, "too few trials", fontsize=6.5, color=GREY, va="center")
            continue
        mean, half = (float(group.loc[column, name]) for name in ("mean", "half_width"))
        cut |= intervals.draw(axis, mean, half, height, colour)
        # Above the bar, which would hide them.
        axis.plot(values, np.full(len(values), height + 0.27), "o", ms=2.5, color=colour, alpha=0.6, mew=0)
        if colour != _FREE:
            axis.plot(group.loc[column, "detectable"], height - 0.32, "^", ms=3.2, color=GREY, mew=0)
        if stratum and sizes is not None:
            own = sizes[(sizes["cue"] == stratum[0]) & (sizes["value"].astype(bool) == stratum[1])]
            axis.text(
                1.02, height, f"{own['n1'].mean():.0f} : {own['n2'].mean():.0f}",
                transform=axis.get_yaxis_transform(), va="center", fontsize=6, color=GREY,
            )  # fmt: skip
    return cut
