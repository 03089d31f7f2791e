"""How clean the recordings are: which channels were repaired, spectra and blinks before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hrcneuro.eeg.quality import AROUND_S, Quality
from hrcneuro.figures.style import COLOURS, CONTINUATION, GREY, STYLE, save

if TYPE_CHECKING:
    import pandas as pd

_LINES = (("before", CONTINUATION, "as recorded"), ("after", COLOURS[0], "clean"))


def draw(channels: Mapping[str, pd.DataFrame], qualities: Sequence[Quality], path: Path) -> None:
    """Draw every subject's channels, and spectra and blinks of some.

    Args:
        channels: Subject -> rows of quality.parquet: ``channel``, ``z``, ``noisy`` and ``interpolated``.
        qualities: Recordings before and after cleaning, one a line of the spectra.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(9.4, 1.2 + max(2.4, 0.2 * len(channels) + 0.9)), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=[1.9, 1, 1])
        _draw_channels(figure, left, channels)
        _draw_spectra(middle, qualities)
        _draw_blinks(right, [one for one in qualities if one.blink_before is not None])
        save(figure, path)


def _draw_channels(figure: Figure, axes: Axes, channels: Mapping[str, pd.DataFrame]) -> None:
    names = list(dict.fromkeys(name for table in channels.values() for name in table["channel"]))
    z = np.full((len(channels), len(names)), np.nan)
    replaced, noisy = np.zeros(z.shape, bool), np.zeros(z.shape, bool)
    for row, table in enumerate(channels.values()):
        columns = [names.index(name) for name in table["channel"]]
        z[row, columns] = table["z"].astype(float)
        replaced[row, columns] = table["interpolated"].fillna(False).astype(bool)
        noisy[row, columns] = table["noisy"].notna()
    image = axes.imshow(z, cmap="RdBu_r", vmin=-6, vmax=6, aspect="auto", interpolation="nearest")
    for mask, mark, size in ((replaced, "x", 4), (noisy, "s", 7)):
        there = np.argwhere(mask)
        axes.plot(there[:, 1], there[:, 0], mark, color="k", ms=size, mew=1, fillstyle="none")
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6.5)
    axes.set_yticks(range(len(channels)), list(channels))
    axes.set_title("normalised kurtosis (SD); x: replaced, □: always noisy")
    bar = figure.colorbar(image, ax=axes, pad=0.01, fraction=0.04, extend="both")
    bar.ax.tick_params(labelsize=6)


def _draw_spectra(axes: Axes, qualities: Sequence[Quality]) -> None:
    for which, colour, label in _LINES:
        for i, one in enumerate(qualities):
            hz, power = getattr(one, f"spectrum_{which}")
            axes.semilogy(hz, power, color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    if qualities:
        axes.set_ylim(bottom=min(float(one.spectrum_before[1].min()) for one in qualities) / 30)
    axes.set_xlim(0, 60)
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("power, median over channels (µV²/Hz)")
    axes.set_title(f"spectra, n = {len(qualities)}")
    axes.legend(loc="lower left")


def _draw_blinks(axes: Axes, qualities: Sequence[Quality]) -> None:
    axes.set_title(f"blinks, n = {len(qualities)}")
    axes.set_xlabel("time from the peak (ms)")
    axes.set_ylabel("frontal channels (µV)")
    if not qualities:
        axes.text(0.5, 0.5, "no EOG channel, or no blink", transform=axes.transAxes, ha="center", color=GREY)
        return
    for which, colour, label in _LINES:
        for i, one in enumerate(qualities):
            blink = getattr(one, f"blink_{which}")
            ms = 1000 * np.linspace(-AROUND_S, AROUND_S, len(blink))
            axes.plot(ms, blink, color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.15 * (high - low))  # room for the legend
    axes.legend(loc="upper right")
