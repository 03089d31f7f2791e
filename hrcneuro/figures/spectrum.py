"""The spectra of a recording before and after it was cleaned: which frequencies were taken out, who is still loud."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from hrcneuro.figures.style import COLOURS, CONTINUATION, GREY, STYLE, save

if TYPE_CHECKING:
    import pandas as pd

# Signal -> colour and label; what a recording was, and what cleaning has made of it, looks alike in all figures.
SIGNALS = {"recorded": (CONTINUATION, "as recorded"), "clean": (COLOURS[0], "clean")}
_NAMED_AT = {"recorded": 0.5, "clean": 0.8}  # how far along the pass band a signal's loud channel is named
# A channel whose power is so many times the median one, on the logarithmic average over the pass band, is named.
_LOUD = 3.0
_DECADES_BELOW = 2.0


def draw(signals: Mapping[str, pd.DataFrame], band_hz: tuple[float, float], path: Path) -> None:
    """Draw every channel as a thin line and the median over channels as a thick one, recorded and clean.

    Args:
        signals: ``recorded`` and ``clean`` -> power in µV²/Hz, a row a frequency (Hz), a column a channel.
        band_hz: What the filter lets through, Hz.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(4.8, 3.5), layout="constrained")
        axes = figure.subplots()
        for edge in band_hz:
            axes.axvline(edge, color=GREY, lw=0.7, ls=":", label=f"pass band {band_hz[0]:g}–{band_hz[1]:g} Hz"
                         if edge == band_hz[0] else "_nolegend_")  # fmt: skip
        floor = min(_draw_signal(axes, name, power, band_hz) for name, power in signals.items())
        finish(axes, floor, signals)
        axes.plot([], [], color=GREY, lw=0.4, alpha=0.8, label="a channel")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2, handlelength=1.4)
        save(figure, path)


def curve(axes: Axes, power: pd.Series | pd.DataFrame, **look: Any) -> None:
    """Draw power over its index, Hz; a flat channel has none, and a logarithm shows none of it."""
    values = power.to_numpy(float)
    axes.plot(power.index.to_numpy(float), np.where(values > 0, values, np.nan), **look)


def finish(axes: Axes, floor: float, signals: Mapping[str, pd.DataFrame]) -> None:
    """Name the axes and set their limits: what the filter takes out falls without end, the rest fills the picture.

    Args:
        axes: Where the spectra are.
        floor: The lowest power that matters, µV²/Hz.
        signals: As in :func:`draw`.
    """
    axes.set_yscale("log")
    axes.set_ylim(bottom=floor * 10**-_DECADES_BELOW)
    axes.set_xlim(0, max(float(power.index.max()) for power in signals.values()))
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("power (µV²/Hz)")


def lowest(median: pd.Series, band_hz: tuple[float, float]) -> float:
    """Return the lowest power of a median over channels within a band, µV²/Hz; little where it has none."""
    inside = median[(median.index >= band_hz[0]) & (median.index <= band_hz[1])]
    return float(inside.min()) if len(inside) and (inside > 0).all() else 1e-3


def _draw_signal(axes: Axes, name: str, power: pd.DataFrame, band_hz: tuple[float, float]) -> float:
    """Draw one signal; return the lowest median power in the pass band."""
    colour, label = SIGNALS[name]
    curve(axes, power, color=colour, lw=0.4, alpha=0.45)
    median = power.median(axis=1)
    curve(axes, median, color=colour, lw=1.8, label=f"{label}, median of {len(power.columns)} channels")
    band = power[(power.index >= band_hz[0]) & (power.index <= band_hz[1])]
    if not len(band) or not (median[band.index] > 0).all():
        return lowest(median, band_hz)
    with np.errstate(divide="ignore"):
        louder = np.log10(band.to_numpy(float) / median[band.index].to_numpy(float)[:, None]).mean(axis=0)
    loudest = int(np.argmax(louder))
    if louder[loudest] > np.log10(_LOUD):
        at = int(_NAMED_AT[name] * len(band))
        place = (float(band.index.to_numpy(float)[at]), float(band.to_numpy(float)[at, loudest]))
        text = axes.annotate(
            str(power.columns[loudest]), place, (0, 4), textcoords="offset points", fontsize=7, color=colour,
            ha="center",
        )  # fmt: skip
        text.set_path_effects([withStroke(linewidth=2, foreground="w")])
    return lowest(median, band_hz)
