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
from matplotlib.ticker import MaxNLocator
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

    def group(self, tested: Sequence[Tested], path: Path, *, test: str) -> None:
        """Draw tested contrasts over subjects, each with its number of subjects; nothing where there is none."""
        rows = [
            Row(
                f"{t.name if t.scenario == ALL else f'{t.scenario}: {t.name}'}, n = {t.result.n}",
                t.result.difference,
                None if t.result.test is None else t.result.test.significant,
            )
            for t in tested
        ]
        if rows:
            self._draw(
                rows,
                path,
                unit="µV",
                note=f"full colour: {test}" if any(t.result.test is not None for t in tested) else test,
            )

    def _draw(self, rows: Sequence[Row], path: Path, *, unit: str, note: str) -> None:
        picked = [list(self.axes["channel"]).index(name) for name in self.shown]
        limit = float(np.quantile(np.abs([row.values[picked] for row in rows]), 0.995)) or 1.0
        with rc_context(STYLE):
            width, height = 2.1 * len(picked) + 1.5, 1.35 * len(rows) + 1.2
            figure = Figure(figsize=(width, height))
            left, right, top, bottom = 0.75 / width, 1 - 0.75 / width, 1 - 0.35 / height, 0.85 / height
            between = 0.36 / height
            pitch = (top - bottom + between) / len(rows)
            strip = _Strip(np.asarray(self.axes["times"]) * 1000, np.asarray(self.axes["frequency_hz"]), len(picked))
            for i, row in enumerate(rows):
                lowest = top - (i + 1) * pitch + between
                axes = figure.add_axes((left, lowest, right - left, pitch - between))
                image = strip.draw(axes, row, picked, limit)
                strip.shade(axes, self.gap_s)
                axes.set_ylabel("frequency (Hz)")
                titles = [f"{row.title}   {self.shown[0]}", *self.shown[1:]]
                strip.label(axes, titles, times=i == len(rows) - 1)
            span = min(1.6 / height, 0.8)
            bar = figure.colorbar(image, cax=figure.add_axes((1 - 0.6 / width, 0.5 - span / 2, 0.1 / width, span)))
            bar.ax.tick_params(labelsize=6, length=2)
            bar.ax.set_title(unit, fontsize=7, pad=4)
            if bar.solids is not None:
                bar.solids.set_alpha(1)
            bar.outline.set_linewidth(0.4)
            figure.text(0.1 / width, 0.06 / height, note, fontsize=6.5, color=GREY, va="bottom")
            legend_below(figure, [], self.gap_s, float(self.axes["times"][-1]))
            save(figure, path)


@dataclass(frozen=True)
class _Strip:
    """Maps side by side in one Axes: as many Axes as maps would cost ten times the time, most of it for their ticks.

    Times in milliseconds; the first map keeps its own times, each further one lies ``pitch`` later.
    """

    times: NDArray[np.float64]
    frequencies: NDArray[np.float64]
    count: int

    @property
    def step(self) -> float:
        """From one sample to the next."""
        return float(self.times[-1] - self.times[0]) / max(1, len(self.times) - 1) or 1.0

    @property
    def gap(self) -> int:
        """Empty samples between two maps."""
        return max(1, round(0.1 * len(self.times)))

    @property
    def pitch(self) -> float:
        """From one map to the next."""
        return (len(self.times) + self.gap) * self.step

    def draw(self, axes: Axes, row: Row, picked: Sequence[int], limit: float) -> Any:
        """Draw one row's maps of these channels; return the image."""
        values = np.ma.masked_invalid(self._joined(row.values[picked], np.nan))
        half = (
            self.step / 2,
            (self.frequencies[-1] - self.frequencies[0]) / max(1, len(self.frequencies) - 1) / 2 or 1,
        )
        extent = (
            self.times[0] - half[0], self.times[0] + values.shape[1] * self.step - half[0],
            self.frequencies[0] - half[1], self.frequencies[-1] + half[1],
        )  # fmt: skip
        mask = None if row.significant is None else self._joined(row.significant[picked], False)
        image = axes.imshow(
            values, cmap="RdBu_r", vmin=-limit, vmax=limit, origin="lower", aspect="auto", interpolation="nearest",
            extent=extent, alpha=1 if mask is None else np.where(mask, 1, _FADED),
        )  # fmt: skip
        if mask is not None and mask.any() and len(self.frequencies) > 1:
            columns = self.times[0] + self.step * np.arange(values.shape[1])
            axes.contour(columns, self.frequencies, mask.astype(float), levels=[0.5], colors="k", linewidths=0.6)
        axes.set(xlim=extent[:2], ylim=extent[2:])
        return image

    def shade(self, axes: Axes, gap_s: float) -> None:
        """Mark the onsets, and hatch what lies after the shortest gap between them."""
        low, high = axes.get_ylim()
        starts = self.pitch * np.arange(self.count)
        axes.vlines(starts, low, high, color="0.3", lw=0.6)
        shade_gap(axes, gap_s, float(self.times[-1]) / 1000, above=True, starts_ms=starts.tolist())

    def label(self, axes: Axes, titles: Sequence[str], *, times: bool) -> None:
        """Write a title above each map, and, where wanted, times below it; draw the axes' lines below maps alone."""
        low, high = axes.get_ylim()
        starts = self.pitch * np.arange(self.count)
        ticks = np.array([t for t in MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(*self.times[[0, -1]])
                          if self.times[0] <= t <= self.times[-1]])  # fmt: skip
        axes.set_xticks((starts[:, None] + ticks).ravel(), [f"{t:.0f}" for t in ticks] * self.count if times else [])
        axes.spines["bottom"].set_visible(False)
        axes.hlines(np.full(self.count, low), starts + self.times[0], starts + self.times[-1], color="k", lw=0.7,
                    clip_on=False)  # fmt: skip
        for start, title in zip(starts, titles, strict=True):
            axes.annotate(title, (start + self.times[0], high), (0, 3), textcoords="offset points", fontsize=8.5)
        if times:
            for start in starts:
                middle = (start + self.times[[0, -1]].mean(), low)
                axes.annotate(
                    "time from onset (ms)", middle, (0, -17), textcoords="offset points", ha="center", va="top"
                )

    def _joined(self, maps: NDArray[Any], between: Any) -> NDArray[Any]:
        gap = np.full((len(self.frequencies), self.gap), between, dtype=maps.dtype)
        return np.concatenate([part for one in maps for part in (one, gap)][:-1], axis=1)
