"""What a plain difference is made of: one panel a contrast, its predictors' parts as waves that add up to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.figures.style import COLOURS, GREY, INK, STYLE, foot_height, foot_lines, save, shade_gap, write_foot

Floats = NDArray[np.float64]

_WIDTH, _HEIGHT = 3.6, 2.4  # inches a panel


@dataclass(frozen=True)
class PartsPanel:
    """The parts of one contrast at one channel; each wave ndarray, shape (n_times,), µV.

    Attributes:
        title: Above it.
        plain: The difference of the averages.
        parts: Predictor -> its part.
        rest: What no predictor explains.
    """

    title: str
    plain: Floats
    parts: Mapping[str, Floats]
    rest: Floats


def draw(
    panels: Sequence[PartsPanel], times: Floats, path: Path, *, channel: str, gap_s: float, note: str = ""
) -> None:
    """Write the panels as one picture, two a row.

    Args:
        panels: In reading order.
        times: ndarray, shape (n_times,), s.
        path: The PNG file; the PDF lies beside it.
        channel: Whose waves are shown.
        gap_s: The shortest time to the next onset, s, NaN where overlap is regressed out: the plain difference beyond
            is hatched.
        note: A line below the picture.
    """
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    width = _WIDTH * columns + 0.4
    names = list(dict.fromkeys(name for panel in panels for name in panel.parts))
    hues = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}
    lines = foot_lines(note, width)
    legend_rows = -(-(len(names) + 2) // 4)
    foot = 0.45 + 0.16 * legend_rows + foot_height(lines)
    height = _HEIGHT * rows + foot
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        figure.subplots_adjust(
            left=0.6 / width, right=1 - 0.15 / width, top=1 - 0.3 / height, bottom=(foot + 0.2) / height, hspace=0.28,
            wspace=0.14,
        )  # fmt: skip
        for one, panel in zip(axes.flat, panels, strict=False):
            _panel(one, panel, times, hues, gap_s)
        for one in axes.flat[len(panels) :]:
            one.set_visible(False)
        for one in axes[:, 0]:
            one.set_ylabel(f"{channel} (µV)")
        for one in axes[-1]:
            one.set_xlabel("time from onset (ms)")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        every = dict(zip(labels, handles, strict=True))
        for one in axes.flat[1 : len(panels)]:
            handles, labels = one.get_legend_handles_labels()
            every |= dict(zip(labels, handles, strict=True))
        figure.legend(
            every.values(), every, loc="lower center", ncols=4, bbox_to_anchor=(0.5, foot_height(lines) / height)
        )
        write_foot(figure, lines)
        save(figure, path)


def _panel(axes: Axes, panel: PartsPanel, times: Floats, hues: Mapping[str, str], gap_s: float) -> None:
    ms = times * 1000
    shade_gap(axes, gap_s, times[-1])
    axes.axhline(0, color="0.6", lw=0.5, zorder=1)
    axes.axvline(0, color="0.6", lw=0.5, zorder=1)
    axes.plot(ms, panel.plain, color=INK, lw=1.8, label="plain difference", zorder=2)
    for name, wave in panel.parts.items():
        axes.plot(ms, wave, color=hues[name], lw=1.1, label=name, zorder=3)
    axes.plot(ms, panel.rest, color=GREY, lw=0.9, ls="--", label="rest: overlap and misfit", zorder=2.5)
    axes.set_title(panel.title, loc="left", pad=4)
    axes.set_xlim(ms[0], ms[-1])
