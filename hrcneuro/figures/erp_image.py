"""ERP images: the trials of both conditions of a contrast, in the order of the time to the next onset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.eeg.trial_image import TrialImage
from hrcneuro.figures.style import GREY, INK, STYLE, save

# A contrast's name -> its conditions' names and trials, from top to bottom.
Panels = Mapping[str, Sequence[tuple[str, TrialImage]]]

_COLUMN, _IMAGE = 2.35, 0.95  # inches: a panel's width, an image's height
_LEFT, _RIGHT, _TOP, _FOOT, _BETWEEN = 0.55, 0.55, 0.3, 0.75, 0.62
_APART = 0.1


def draw(panels: Panels, times: NDArray[np.float64], path: Path, *, channel: str, note: str) -> None:
    """Draw a panel a contrast, two a row: its conditions' trials as lines, with the mean time to the next onset.

    Args:
        panels: In reading order.
        times: ndarray, shape (n_times,), s.
        path: The PNG file; the PDF lies beside it.
        channel: Whose trials they are.
        note: A line below the picture.
    """
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    images = max(map(len, panels.values()))
    tall = images * _IMAGE + (images - 1) * _APART
    width = _LEFT + columns * _COLUMN + (columns - 1) * 0.3 + _RIGHT
    height = _TOP + rows * tall + (rows - 1) * _BETWEEN + _FOOT
    limit = float(np.quantile(np.abs(np.concatenate([i.lines.ravel() for p in panels.values() for _, i in p])), 0.99))
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        for k, (name, panel) in enumerate(panels.items()):
            left = _LEFT + (k % columns) * (_COLUMN + 0.3)
            top = height - _TOP - (k // columns) * (tall + _BETWEEN)
            last = k + columns >= len(panels)
            for i, (condition, image) in enumerate(panel):
                low = top - (i + 1) * _IMAGE - i * _APART
                axes = figure.add_axes((left / width, low / height, _COLUMN / width, _IMAGE / height))
                drawn = _image(axes, image, times, condition, limit or 1.0)
                lowest = i == len(panel) - 1
                axes.tick_params(labelbottom=lowest)
                axes.set_xlabel("time from onset (ms)" if lowest and last else "")
                axes.set_ylabel("trials" if k % columns == 0 else "")
            figure.text(left / width, (top + 0.08) / height, name, fontsize=8.5)
        tall_bar = min(1.3, tall)
        place = (1 - 0.42 / width, (height - _TOP - tall_bar) / height, 0.09 / width, tall_bar / height)
        bar = figure.colorbar(drawn, cax=figure.add_axes(place), extend="both")
        bar.ax.set_title(f"{channel}\n(µV)", fontsize=7, pad=4)
        bar.ax.tick_params(labelsize=6.5, length=2)
        figure.text(0.1 / width, 0.07 / height, note, fontsize=6.5, color=GREY, va="bottom", linespacing=1.4)
        save(figure, path)


def _image(axes: Axes, image: TrialImage, times: NDArray[np.float64], condition: str, limit: float) -> Any:
    ms = 1000 * times
    half, trials = (ms[1] - ms[0]) / 2, image.ranks[-1] + image.ranks[0] + 1
    drawn = axes.imshow(
        image.lines, cmap="RdBu_r", vmin=-limit, vmax=limit, aspect="auto", interpolation="nearest",
        extent=(ms[0] - half, ms[-1] + half, trials, 0),
    )  # fmt: skip
    axes.axvline(0, color=INK, lw=0.6)
    if image.by_gap:
        axes.plot(1000 * image.gaps_s, image.ranks + 0.5, color="k", lw=1.1)
    axes.set(xlim=(ms[0] - half, ms[-1] + half), ylim=(trials, 0))
    axes.spines[["top", "right"]].set_visible(True)
    axes.set_yticks([trials], [f"{trials:.0f}"])
    axes.text(
        0.015, 0.95, condition, transform=axes.transAxes, va="top", fontsize=7,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0},
    )  # fmt: skip
    return drawn
