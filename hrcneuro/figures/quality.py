"""The figure of preprocess: how good the channels are and what was done to them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.figures.style import BLUE, COLOURS, STYLE, VERMILION, save

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]

_NOISY = COLOURS[4]


def draw(channels: pd.DataFrame, weights: dict[str, Floats], threshold: float, path: Path) -> None:
    """Draw, a row a channel: normalised kurtosis with its limits, regression weights, RMS before and after.

    Args:
        channels: Rows of quality.parquet: ``channel``, ``z``, ``reason``, ``noisy``, ``interpolated``,
            ``rms_before_uv`` and ``rms_after_uv``.
        weights: EOG channel -> its share in each channel, shape (n_channels,).
        threshold: Normalised kurtosis beyond which a channel is bad, in SD.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(STYLE):
        save(_figure(channels, weights, threshold), path)


def _figure(channels: pd.DataFrame, weights: dict[str, Floats], threshold: float) -> Figure:
    names = list(channels["channel"])
    rows = np.arange(len(names))
    bad = channels["reason"].notna().to_numpy()
    height = max(3.0, 1.2 + 0.2 * len(names))
    figure = Figure(figsize=(9.4, height))
    # Margins in inches: a layout engine would draw everything twice.
    figure.subplots_adjust(left=0.06, right=0.99, bottom=0.7 / height, top=1 - 0.35 / height, wspace=0.12)
    left, middle, right = figure.subplots(1, 3, sharey=True, width_ratios=(2, 1.3, 2))
    _draw_kurtosis(left, channels, rows, bad, threshold)
    _draw_weights(middle, weights)
    right.barh(rows - 0.2, channels["rms_before_uv"], 0.4, color="0.7")
    right.barh(rows + 0.2, channels["rms_after_uv"].fillna(0.0), 0.4, color="0.3")
    right.set_xlabel("RMS amplitude (µV)")
    right.set_title("band-passed (light), clean (dark)")
    noisy = _name_noisy(right, channels)
    left.set_yticks(rows, names, fontsize="small")
    for label, is_bad, is_noisy in zip(left.get_yticklabels(), bad, noisy, strict=True):
        label.set_color(VERMILION if is_bad else _NOISY if is_noisy else "black")
    left.set_ylim(len(names) - 0.5, -0.5)
    for axes in (middle, right):
        axes.tick_params(axis="y", length=0)
    return figure


def _draw_kurtosis(
    axes: Any, channels: pd.DataFrame, rows: NDArray[np.intp], bad: NDArray[np.bool_], threshold: float
) -> None:
    z = np.nan_to_num(channels["z"].to_numpy(float), posinf=1e3, neginf=-1e3)
    axes.barh(rows, z, color=np.where(bad, VERMILION, BLUE))
    axes.axvline(-threshold, color="0.5", linestyle="--", linewidth=1)
    axes.axvline(threshold, color="0.5", linestyle="--", linewidth=1)
    # One loose contact would squeeze all others into a line.
    axes.set_xscale("symlog", linthresh=2 * threshold)
    axes.minorticks_off()
    limit = max(2 * threshold, float(np.abs(z).max()) * 4)
    axes.set_xlim(max(-limit, min(float(z.min()) * 1.3, -1.5 * threshold)), limit)
    axes.set_xticks([v for v in (-threshold, 0, threshold, 10, 100, 1000) if abs(v) <= limit])
    axes.xaxis.set_major_formatter("{x:g}")
    beyond = f", logarithmic beyond {2 * threshold:g}" if np.abs(z).max() > 2 * threshold else ""
    axes.set_xlabel(f"normalised kurtosis (SD){beyond}")
    axes.set_title(f"{int(bad.sum())} bad, {int(channels['interpolated'].sum())} interpolated")
    for row, why in enumerate(channels["reason"]):
        if bad[row]:
            axes.annotate(why, (z[row], row), (3, 0), textcoords="offset points", va="center", fontsize="x-small")


def _name_noisy(axes: Any, channels: pd.DataFrame) -> NDArray[np.bool_]:
    """Write beside a channel's amplitude by what it is noisy all the time; return which channels are."""
    noisy = channels["noisy"].notna().to_numpy()
    ends = channels[["rms_before_uv", "rms_after_uv"]].max(axis=1).to_numpy(float)
    for row in np.flatnonzero(noisy):
        text = f"noisy: {channels['noisy'].iloc[row]}"
        place = (ends[row], row)
        axes.annotate(text, place, (3, 0), textcoords="offset points", va="center", fontsize="x-small", color=_NOISY)
    if noisy.any():
        axes.set_xlim(0, 1.45 * np.nanmax(ends))
    return noisy


def _draw_weights(axes: Any, weights: dict[str, Floats]) -> None:
    axes.set_title("EOG removed (µV per µV)")
    if not weights:
        axes.text(0.5, 0.5, "no EOG", transform=axes.transAxes, ha="center", va="center")
        axes.set_xticks([])
        return
    shares = np.column_stack(list(weights.values()))
    limit = max(float(np.abs(shares).max()), 1e-9)
    image = axes.imshow(shares, cmap="RdBu_r", vmin=-limit, vmax=limit, aspect="auto")
    axes.set_xticks(np.arange(len(weights)), list(weights), fontsize="small", rotation=90 if len(weights) > 3 else 0)
    bar = axes.figure.colorbar(image, ax=axes, pad=0.04, fraction=0.08)
    bar.ax.tick_params(labelsize="small", length=2)
