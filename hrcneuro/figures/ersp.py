"""The figures of ersp: time-frequency maps of differences, a row a contrast, a column a channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from hrcneuro.eeg.evoked import farthest_from_zero
from hrcneuro.eeg.selection import ALL
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.figures.notes import contrast_title
from hrcneuro.figures.style import STYLE, foot_height, foot_lines, legend_below, save, shade_gap, write_foot

Maps = NDArray[np.floating]
Floats = NDArray[np.float64]
Key = tuple[str, str]
"""Scenario, and condition or contrast."""

# So many maps in a row are narrower.
_MANY = 5
# How much of the colour is left where a difference is not significant.
_FADED = 0.55


@dataclass(frozen=True)
class MapRow:
    """A row of maps.

    Attributes:
        title: Above the first.
        channels: Their names, above each.
        values: ndarray, shape (n_channels, n_frequencies, n_times).
        significant: The same shape; None without a test.
        peak: The index of the largest value of all channels, which is marked; None for no mark.
    """

    title: str
    channels: Sequence[str]
    values: Maps
    significant: NDArray[np.bool_] | None = None
    peak: tuple[int, ...] | None = None

    def of_channels(self, names: Sequence[str]) -> MapRow:
        """Return the maps of these channels, in this order, each named once."""
        rows = [self.channels.index(name) for name in names]
        significant = None if self.significant is None else self.significant[rows]
        return MapRow(self.title, names, self.values[rows], significant)


@dataclass(frozen=True)
class MapSettings:
    """What all maps share.

    Attributes:
        frequencies: ndarray, shape (n_frequencies,), Hz.
        times: ndarray, shape (n_times,), s.
        gap_s: The shortest time to the next onset, s; NaN if unknown.
    """

    frequencies: Floats
    times: Floats
    gap_s: float


def of_subject(
    maps: Mapping[Key, Maps], contrasts: Mapping[str, Sequence[str]], names: Sequence[str], wanted: Sequence[str]
) -> tuple[list[MapRow], str]:
    """Return the rows of one subject and their unit: differences, or, without a contrast, conditions.

    Args:
        maps: (scenario, condition) -> ndarray, shape (n_channels, n_frequencies, n_times).
        contrasts: Name -> [plus, minus], names of conditions.
        names: Of the maps' channels.
        wanted: Of those to show.
    """
    rows = [
        MapRow(name, names, np.subtract(maps[ALL, plus], maps[ALL, minus], dtype=float))
        for name, (plus, minus) in contrasts.items()
        if (ALL, plus) in maps and (ALL, minus) in maps
    ]
    if rows:
        return _with_largest(rows, wanted), "µV"
    rows = [
        MapRow(condition, names, 100 * (value / value.mean(axis=-1, keepdims=True, dtype=float) - 1))
        for (scenario, condition), value in maps.items()
        if scenario == ALL
    ]
    return [row.of_channels(wanted) for row in rows], "%"


def of_group(tested: Mapping[Key, SignificanceMap], wanted: Sequence[str]) -> list[MapRow]:
    """Return a row a tested contrast of the wanted channels, each with its number of subjects."""
    rows = [
        MapRow(
            contrast_title(scenario, name, one.n),
            one.channels,
            one.difference,
            one.significant if one.tested else None,
        )
        for (scenario, name), one in tested.items()
    ]
    return _with_largest(rows, wanted)


def _with_largest(rows: Sequence[MapRow], wanted: Sequence[str]) -> list[MapRow]:
    """Return the wanted channels of each row and, where one's largest value lies elsewhere, that value's channel."""
    peaks = [farthest_from_zero(row.values) for row in rows]
    largest = [row.channels[peak[0]] for row, peak in zip(rows, peaks, strict=True)]
    more = not set(largest) <= set(wanted)
    shown = [row.of_channels([*wanted, *([name] if more else [])]) for row, name in zip(rows, largest, strict=True)]
    return [
        replace(row, peak=(len(row.channels) - 1 if more else row.channels.index(name), *peak[1:]))
        for row, name, peak in zip(shown, largest, peaks, strict=True)
    ]


def draw(rows: Sequence[MapRow], shown: MapSettings, path: Path, *, unit: str, note: str) -> None:
    """Write rows of maps as one picture.

    Args:
        rows: From top to bottom.
        shown: Channels, axes, and where the next onset may fall.
        path: The PNG file; the PDF lies beside it.
        unit: Of the values.
        note: A line below the picture.
    """
    if not any(row.significant is not None and row.significant.any() for row in rows):
        # Nothing to set apart: full colour for all.
        rows = [replace(row, significant=None) for row in rows]
    limit = float(np.quantile(np.abs([row.values for row in rows]), 0.995)) or 1.0
    count = len(rows[0].channels)
    with rc_context(STYLE):
        if any(row.peak for row in rows):
            note += "; cross: the largest difference of all channels"
        width = (2.1 if count < _MANY else 1.75) * count + 1.5
        lines = foot_lines(note, width)
        more = foot_height(lines)
        height = 1.55 * len(rows) + 1.25 + more
        figure = Figure(figsize=(width, height))
        left, right, top, bottom = 0.75 / width, 1 - 0.75 / width, 1 - 0.48 / height, (0.85 + more) / height
        between = 0.56 / height
        pitch = (top - bottom + between) / len(rows)
        strip = _Strip(np.asarray(shown.times) * 1000, np.asarray(shown.frequencies), count)
        for i, row in enumerate(rows):
            lowest = top - (i + 1) * pitch + between
            axes = figure.add_axes((left, lowest, right - left, pitch - between))
            image = strip.draw(axes, row, limit)
            strip.shade(axes, shown.gap_s)
            axes.set_ylabel("frequency (Hz)")
            strip.mark(axes, row.peak)
            strip.label(axes, row.channels, times=i == len(rows) - 1)
            figure.text(left, lowest + pitch - between + 0.23 / height, row.title, fontsize=8.5)
        span = min(1.6 / height, 0.8)
        bar = figure.colorbar(image, cax=figure.add_axes((1 - 0.6 / width, 0.5 - span / 2, 0.1 / width, span)))
        bar.ax.tick_params(labelsize=6, length=2)
        bar.ax.set_title(unit, fontsize=7, pad=4)
        if bar.solids is not None:
            bar.solids.set_alpha(1)
        bar.outline.set_linewidth(0.4)
        write_foot(figure, lines)
        legend_below(figure, [], shown.gap_s, float(shown.times[-1]), above=more)
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

    def draw(self, axes: Axes, row: MapRow, limit: float) -> Any:
        """Draw one row's maps; return the image."""
        values = np.ma.masked_invalid(self._joined(row.values, np.nan))
        half = (
            self.step / 2,
            (self.frequencies[-1] - self.frequencies[0]) / max(1, len(self.frequencies) - 1) / 2 or 1,
        )
        extent = (
            self.times[0] - half[0], self.times[0] + values.shape[1] * self.step - half[0],
            self.frequencies[0] - half[1], self.frequencies[-1] + half[1],
        )  # fmt: skip
        mask = None if row.significant is None else self._joined(row.significant, False)
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

    def mark(self, axes: Axes, peak: tuple[int, ...] | None) -> None:
        """Put a cross on a bin, if wanted."""
        if peak is not None:
            at = self.pitch * peak[0] + self.times[peak[2]], self.frequencies[peak[1]]
            axes.plot(*at, "x", color="k", ms=6, mew=2.2, clip_on=False)
            axes.plot(*at, "x", color="w", ms=5, mew=1, clip_on=False)

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
            axes.annotate(title, (start + self.times[0], high), (0, 3), textcoords="offset points", fontsize=7.5)
        if times:
            for start in starts:
                middle = (start + self.times[[0, -1]].mean(), low)
                axes.annotate(
                    "time from onset (ms)", middle, (0, -17), textcoords="offset points", ha="center", va="top"
                )

    def _joined(self, maps: NDArray[Any], between: Any) -> NDArray[Any]:
        gap = np.full((len(self.frequencies), self.gap), between, dtype=maps.dtype)
        return np.concatenate([part for one in maps for part in (one, gap)][:-1], axis=1)
