"""The figures of ersp: time-frequency maps of differences, a row a contrast, a column a channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hrcneuro.eeg.contrasts import Tested
from hrcneuro.eeg.selection import ALL
from hrcneuro.figures.style import GREY, STYLE, legend_below, save, shade_gap

Floats = NDArray[np.floating]

# How much of the colour is left where a difference is not significant.
_FADED = 0.35


@dataclass(frozen=True)
class Row:
    """A row of maps, each channels × frequencies × times."""

    title: str
    values: Floats
    significant: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class Drawing:
    """Draws maps of some channels.

    Attributes:
        axes: ``channel``, ``frequency_hz`` and ``times``, each with its labels.
        shown: The channels to draw.
        gap_s: The shortest time to the next onset, NaN if unknown.
    """

    axes: Mapping[str, Any]
    shown: Sequence[str]
    gap_s: float

    def subject(
        self, maps: Mapping[tuple[str, str], Floats], contrasts: Mapping[str, Sequence[str]], path: Path, *, unit: str
    ) -> None:
        """Draw the differences of one subject, or, without a contrast, each condition over its mean in time."""
        rows = [
            Row(name, maps[ALL, plus] - maps[ALL, minus])
            for name, (plus, minus) in contrasts.items()
            if (ALL, plus) in maps and (ALL, minus) in maps
        ]
        if rows:
            self._draw(rows, path, unit="µV", note=f"{unit}; differences of mean magnitudes")
            return
        rows = [
            Row(condition, 100 * (value / value.mean(axis=-1, keepdims=True) - 1))
            for (scenario, condition), value in maps.items()
            if scenario == ALL
        ]
        self._draw(rows, path, unit="%", note=f"{unit}; mean magnitude over its mean in time")

    def group(self, tested: Sequence[Tested], path: Path, *, n: int) -> None:
        """Draw tested contrasts over subjects; nothing where there is none."""
        rows = [
            Row(
                t.name if t.scenario == ALL else f"{t.scenario}: {t.name}",
                t.result.difference,
                None if t.result.test is None else t.result.test.significant,
            )
            for t in tested
        ]
        if rows:
            self._draw(rows, path, unit="µV", note=f"n = {n}; pale: not significant")

    def _draw(self, rows: Sequence[Row], path: Path, *, unit: str, note: str) -> None:
        picked = [list(self.axes["channel"]).index(name) for name in self.shown]
        limit = float(np.quantile(np.abs([row.values[picked] for row in rows]), 0.995)) or 1.0
        with rc_context(STYLE):
            width, height = 2.1 * len(picked) + 1.5, 1.35 * len(rows) + 1.2
            figure = Figure(figsize=(width, height))
            grid = figure.add_gridspec(
                len(rows),
                len(picked),
                left=0.75 / width,
                right=1 - 0.75 / width,
                top=1 - 0.35 / height,
                bottom=0.85 / height,
                wspace=0.1,
                hspace=0.38,
            )
            for i, row in enumerate(rows):
                for j, channel in enumerate(picked):
                    axes = figure.add_subplot(grid[i, j])
                    image = self._map(axes, row, channel, limit)
                    last = i == len(rows) - 1
                    axes.tick_params(labelleft=j == 0, labelbottom=last)
                    axes.set_xlabel("time from onset (ms)" if last else "")
                    axes.set_ylabel("Hz" if j == 0 else "")
                    axes.set_title(f"{row.title}   {self.shown[0]}" if j == 0 else self.shown[j], loc="left", pad=3)
            span = min(1.6 / height, 0.8)
            bar = figure.colorbar(image, cax=figure.add_axes((1 - 0.6 / width, 0.5 - span / 2, 0.1 / width, span)))
            bar.ax.tick_params(labelsize=6, length=2)
            bar.ax.set_title(unit, fontsize=7, pad=4)
            if bar.solids is not None:
                bar.solids.set_alpha(1)
            bar.outline.set_linewidth(0.4)
            figure.text(0.1 / width, 0.06 / height, note, fontsize=6.5, color=GREY, va="bottom")
            legend_below(figure, [], self.gap_s)
            save(figure, path)

    def _map(self, axes: Axes, row: Row, channel: int, limit: float) -> Any:
        times, frequencies = np.asarray(self.axes["times"]) * 1000, np.asarray(self.axes["frequency_hz"])
        values = row.values[channel]
        colour: Any = dict(cmap="RdBu_r", vmin=-limit, vmax=limit, shading="nearest", rasterized=True)
        tested = row.significant is not None
        image = axes.pcolormesh(times, frequencies, values, alpha=_FADED if tested else 1, **colour)
        if row.significant is not None and row.significant[channel].any():
            mask = row.significant[channel]
            image = axes.pcolormesh(times, frequencies, np.ma.masked_array(values, ~mask), **colour)
            if len(frequencies) > 1:
                axes.contour(times, frequencies, mask.astype(float), levels=[0.5], colors="k", linewidths=0.6)
        axes.axvline(0, color="0.3", lw=0.6)
        shade_gap(axes, self.gap_s, float(times[-1]) / 1000, above=True)
        axes.set_xlim(times[0], times[-1])
        return image
