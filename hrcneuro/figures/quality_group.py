"""How clean the recordings are: which channels were repaired, spectra and blinks before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.eeg.blinks import AROUND_S
from hrcneuro.figures import spectrum
from hrcneuro.figures.style import GREY, STYLE, save

if TYPE_CHECKING:
    import pandas as pd

_SHOWN_HZ = (1.0, 40.0)  # whose lowest power the picture holds, with some room below


@dataclass(frozen=True)
class Blinks:
    """The mean blink of a recording in its frontal channels, each ndarray, shape (n_times,), µV.

    Attributes:
        recorded, clean: Before and after it was cleaned.
    """

    recorded: NDArray[np.float64]
    clean: NDArray[np.float64]


def draw(
    channels: Mapping[str, pd.DataFrame],
    spectra: Sequence[Mapping[str, pd.DataFrame]],
    blinks: Sequence[Blinks],
    path: Path,
) -> None:
    """Draw every subject's channels, and spectra and blinks of some.

    Args:
        channels: Subject -> rows of quality.parquet: ``channel``, ``z``, ``noisy`` and ``interpolated``.
        spectra: Of each recording, as the figure of a subject's spectrum takes them.
        blinks: Of each recording that has any.
        path: The PNG file; the PDF lies beside it.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(9.4, 1.2 + max(2.4, 0.2 * len(channels) + 0.9)), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=[1.9, 1, 1])
        _draw_channels(figure, left, channels)
        _draw_spectra(middle, spectra)
        _draw_blinks(right, blinks)
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
    marks = [text for mask, text in ((replaced, "x: replaced"), (noisy, "□: always noisy")) if mask.any()]
    axes.set_title("normalised kurtosis (SD)" + (f"; {', '.join(marks)}" if marks else ""))
    bar = figure.colorbar(image, ax=axes, pad=0.01, fraction=0.04, extend="both")
    bar.ax.tick_params(labelsize=6)


def _draw_spectra(axes: Axes, spectra: Sequence[Mapping[str, pd.DataFrame]]) -> None:
    axes.set_title(f"spectra, median over channels, n = {len(spectra)}")
    for which, (colour, label) in spectrum.SIGNALS.items():
        for i, one in enumerate(spectra):
            name = label if i == 0 else "_nolegend_"
            spectrum.curve(axes, one[which].median(axis=1), color=colour, lw=0.8, alpha=0.7, label=name)
    if spectra:
        floor = min(spectrum.lowest(one["recorded"].median(axis=1), _SHOWN_HZ) for one in spectra)
        spectrum.finish(axes, floor, spectra[0])
        axes.legend(loc="lower left")


def _draw_blinks(axes: Axes, blinks: Sequence[Blinks]) -> None:
    axes.set_title(f"mean blink, n = {len(blinks)}")
    axes.set_xlabel("time from the peak (ms)")
    axes.set_ylabel("frontal channels (µV)")
    if not blinks:
        axes.text(0.5, 0.5, "no EOG channel, or no blink", transform=axes.transAxes, ha="center", color=GREY)
        return
    for which, (colour, label) in spectrum.SIGNALS.items():
        for i, one in enumerate(blinks):
            blink = getattr(one, which)
            ms = 1000 * np.linspace(-AROUND_S, AROUND_S, len(blink))
            axes.plot(ms, blink, color=colour, lw=0.8, alpha=0.7, label=label if i == 0 else "_nolegend_")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.15 * (high - low))  # room for the legend
    axes.legend(loc="upper right")
