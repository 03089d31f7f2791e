"""The spectra of a recording before and after it was cleaned: which frequencies were taken out, who is still loud."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.figures.style import COLOURS, CONTINUATION, GREY, STYLE, save

if TYPE_CHECKING:
    import pandas as pd

# Signal -> colour, label, and how far along the pass band its loud channel is named.
_SIGNALS = {"recorded": (CONTINUATION, "as recorded", 0.5), "clean": (COLOURS[0], "clean", 0.8)}
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
        figure = Figure(figsize=(4.8, 3.4), layout="constrained")
        axes = figure.subplots()
        for edge in band_hz:
            axes.axvline(edge, color=GREY, lw=0.7, ls=":", label=f"pass band {band_hz[0]:g}–{band_hz[1]:g} Hz"
                         if edge == band_hz[0] else "_nolegend_")  # fmt: skip
        floor = min(_draw_signal(axes, signals[name], *_SIGNALS[name], band_hz) for name in _SIGNALS if name in signals)
        axes.set_yscale("log")
        # What the filter takes out falls without end; the rest should fill the picture.
        axes.set_ylim(bottom=floor * 10**-_DECADES_BELOW)
        axes.set_xlim(0, max(float(power.index.max()) for power in signals.values()))
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel("power (µV²/Hz)")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=3, handlelength=1.4)
        save(figure, path)


def _draw_signal(
    axes: Axes, power: pd.DataFrame, colour: str, label: str, along: float, band_hz: tuple[float, float]
) -> float:
    """Draw one signal; return the lowest median power in the pass band."""
    hz, values = power.index.to_numpy(float), power.to_numpy(float)
    # A flat channel has no power: a logarithm shows none of it.
    shown = np.where(values > 0, values, np.nan)
    axes.plot(hz, shown, color=colour, lw=0.4, alpha=0.45)
    median = np.median(values, axis=1)
    axes.plot(
        hz, np.where(median > 0, median, np.nan), color=colour, lw=1.8, label=f"{label}, median of {len(power.columns)}"
    )
    inside = (hz >= band_hz[0]) & (hz <= band_hz[1])
    if not inside.any() or not (median[inside] > 0).all():
        return 1e-3
    with np.errstate(divide="ignore"):
        louder = np.log10(values[inside] / median[inside, None]).mean(axis=0)
    loudest = int(np.argmax(louder))
    if louder[loudest] > np.log10(_LOUD):
        at = np.flatnonzero(inside)[int(along * inside.sum())]
        axes.annotate(
            str(power.columns[loudest]), (hz[at], values[at, loudest]), (0, 3), textcoords="offset points", fontsize=7,
            color=colour, ha="center",
        )  # fmt: skip
    return float(median[inside].min())
