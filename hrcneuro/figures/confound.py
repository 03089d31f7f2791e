"""The confound panel: is it the takeover that is decoded, or what goes with it?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import GREY, STYLE, save

_PLAIN, _STRATUM, _RETRAINED, _FREE = "#222222", "#b0246a", "#2166ac", "#b36b00"
# Column of the subjects' scores -> label, colour, stratum whose trials it rests on; a gap before each block.
ROWS: tuple[tuple[str, str, str, tuple[str, bool] | None] | None, ...] = (
    ("bacc", "all trials", _PLAIN, None),
    ("lobo_bacc", "one block left out", _PLAIN, None),
    None,
    ("prev_error_no_bacc", "after no error", _STRATUM, ("prev_error", False)),
    ("prev_error_yes_bacc", "after an error", _STRATUM, ("prev_error", True)),
    ("turn_no_bacc", "no turn ahead", _STRATUM, ("turn", False)),
    ("turn_yes_bacc", "turn ahead", _STRATUM, ("turn", True)),
    None,
    ("matched_bacc", "retrained after no error", _RETRAINED, ("prev_error", False)),
    None,
    ("prev_error_fitted_bacc", "no EEG: previous error", _FREE, None),
    ("turn_fitted_bacc", "no EEG: turn ahead", _FREE, None),
)


# What qualifies the plain result: without any of it there is nothing to show.
QUALIFIERS = [row[0] for row in ROWS if row and row[0] not in ("bacc", "lobo_bacc")]


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
    figure = Figure(figsize=(1.9 + 2.0 * len(panels), 3.8), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, sharex=True, squeeze=False)[0]
    for axis, (key, part) in zip(axes, panels, strict=True):
        place = dict(zip(("scenario", "problem", "decoder"), key, strict=True))
        sizes = None if strata is None else _at(strata, place)
        _panel(axis, part, _at(table2, place).set_index("measure"), sizes)
        axis.set_title(f"{place['scenario']}: {place['problem']}, n = {len(part)}")
        axis.set_xlabel("balanced accuracy (%)")
    values = scores[["bacc", *QUALIFIERS]].to_numpy(float)
    axes[0].set_xlim(min(40.0, np.nanquantile(values, 0.01)) - 1, max(70.0, np.nanmax(values)) + 3)
    axes[0].set_yticks(*_ticks())
    axes[0].set_ylim(-len(ROWS) + 0.4, 0.6)
    return figure


def _at(table: pd.DataFrame, place: Mapping[str, Any]) -> pd.DataFrame:
    """Return the rows of one scenario, problem and decoder."""
    return table[np.logical_and.reduce([table[column] == value for column, value in place.items()])]


def _ticks() -> tuple[list[int], list[str]]:
    rows = [(-i, row[1]) for i, row in enumerate(ROWS) if row]
    return [place for place, _ in rows], [label for _, label in rows]


def _panel(axis: Axes, part: pd.DataFrame, group: Any, sizes: pd.DataFrame | None) -> None:
    axis.axvline(50, color=GREY, lw=0.8)
    axis.tick_params(axis="y", length=0)
    for i, row in enumerate(ROWS):
        if row is None:
            axis.axhline(-i, color="0.85", lw=0.6)
            continue
        column, _, colour, stratum = row
        values = part[column].to_numpy(float)
        values = values[np.isfinite(values)]
        # A stratum that few subjects have says nothing of the group.
        if 2 * len(values) < len(part):
            axis.text(50.6, -i, "too few trials", fontsize=6.5, color=GREY, va="center")
            continue
        axis.plot(values, np.full(len(values), -i), "o", ms=2.5, color=colour, alpha=0.3, mew=0)
        mean, half = (float(group.loc[column, name]) for name in ("mean", "half_width"))
        if np.isfinite(half):
            axis.plot([mean - half, mean + half], [-i, -i], color=colour, lw=2)
        axis.plot(mean, -i, "D", ms=5, color=colour)
        if colour != _FREE:
            axis.plot(group.loc[column, "detectable"], -i - 0.32, "^", ms=3.2, color=GREY, mew=0)
        if stratum and sizes is not None:
            rows = sizes[(sizes["cue"] == stratum[0]) & (sizes["value"].astype(bool) == stratum[1])]
            text = f"{rows['n1'].mean():.0f} : {rows['n2'].mean():.0f}"
            axis.text(
                0.99, -i, text, transform=axis.get_yaxis_transform(), ha="right", va="center", fontsize=6, color=GREY
            )
