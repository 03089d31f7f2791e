"""The figures of erp: waveforms with maps above them, as in the paper's Figs 2 and 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpecBase
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from hrcneuro.eeg.spans import spans
from hrcneuro.figures.style import (
    GREY,
    STYLE,
    foot_height,
    foot_lines,
    legend_below,
    save,
    shade_gap,
    write_foot,
)
from hrcneuro.figures.topomap import Scalp, Topography

Floats = NDArray[np.float64]

_WIDTH, _HEIGHT, _FOOT = 4.1, 3.2, 0.75  # inches a panel, and below all of them
_BELOW = 0.75  # inches more where panels have a difference
_BETWEEN = 0.9  # inches between rows: the times below one, the title of the next
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_MAPS = 4
_WIDEST = 2.5  # times the largest difference: as far as its interval is drawn


@dataclass(frozen=True)
class Trace:
    """A waveform.

    Attributes:
        label: For the legend.
        mean, error: The wave, and how far the band around it reaches to either side; each ndarray, shape (n_times,),
            µV. No band is drawn where the error is NaN.
        colour: Of both.
    """

    label: str
    mean: Floats
    error: Floats
    colour: str


@dataclass(frozen=True)
class Panel:
    """One plot: waveforms of a channel, spans in which they differ, maps above, the waveforms' difference below.

    Attributes:
        title: Above it.
        traces: The waveforms.
        maps: The maps.
        significant: When they differ, ndarray, shape (n_times,); None without a test.
        background: All channels, drawn thin behind, ndarray, shape (n_channels, n_times), µV.
        difference: Drawn below, where there is one.
    """

    title: str
    traces: Sequence[Trace]
    maps: Sequence[Topography]
    significant: NDArray[np.bool_] | None = None
    background: Floats | None = None
    difference: Trace | None = None


def draw(
    panels: Sequence[Panel],
    times: Floats,
    positions: Floats,
    path: Path,
    *,
    channel: str,
    gap_s: float,
    note: str = "",
) -> None:
    """Write the panels as one picture, two a row.

    Args:
        panels: In reading order.
        times: Time of each sample, ndarray, shape (n_times,), s.
        positions: Of the maps' channels in head coordinates, ndarray, shape (n_channels, 3), m; NaN where unknown.
        path: The PNG file; the PDF lies beside it.
        channel: Whose waveforms the panels show.
        gap_s: The shortest time to the next onset, s, NaN if unknown: what lies beyond is shaded.
        note: A line below the picture.
    """
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    below = _BELOW if any(panel.difference for panel in panels) else 0.0
    scalp = Scalp.of(positions)
    if scalp is None:
        # Without maps there are no lines at their times either.
        panels = [replace(panel, maps=()) for panel in panels]
    limit = _limit([m for p in panels for m in p.maps])
    width = _WIDTH * columns + 0.3
    lines = foot_lines("; ".join([note, *_marks(panels)]), width)
    more = foot_height(lines)
    foot = _FOOT + more
    height = (_HEIGHT + below) * rows + foot
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(
            rows,
            columns,
            left=0.6 / width,
            right=1 - 0.4 / width,
            top=1 - 0.45 / height,
            bottom=(foot + 0.1) / height,
            wspace=0.24,
            hspace=rows * _BETWEEN / (height - foot - 0.55 - (rows - 1) * _BETWEEN),
        )
        for i, panel in enumerate(panels):
            cell = grid[i // columns, i % columns]
            above = 1 if scalp is not None else 0.05
            parts = [above, 2.1, 1.4 * below] if below else [above, 2.1]
            inner = cell.subgridspec(len(parts), 1, height_ratios=parts, hspace=0.08)
            axes = _plots(figure, inner, panels, panel, times, gap_s)
            for one, label in zip(axes, (f"{channel} (µV)", "difference (µV)"), strict=False):
                one.set_ylabel(label if i % columns == 0 else "", fontsize=8 if one is axes[0] else 7)
            figure.align_ylabels(axes)
            axes[-1].set_xlabel("time from onset (ms)" if i + columns >= len(panels) else "")
            if scalp is not None and panel.maps:
                last_in_row = (i + 1) % columns == 0 or i + 1 == len(panels)
                room = inner[0].get_position(figure)
                row = figure.add_axes((room.x0, room.y0, room.width, room.height + 0.15 / height))
                scalp.draw(row, panel.maps[:_MAPS], limit, slots=_MAPS, bar=last_in_row)
            place = cell.get_position(figure)
            left, top = place.x0 - 0.45 / width, place.y1 + 0.38 / height
            figure.text(left, top, _LETTERS[i % len(_LETTERS)], fontsize=11, fontweight="bold", va="top")
            figure.text(left + 0.22 / width, top - 0.02 / height, panel.title, fontsize=9, va="top")
        _legend(figure, panels, gap_s, times[-1], more)
        write_foot(figure, lines)
        save(figure, path)


def _plots(
    figure: Figure, inner: GridSpecBase, panels: Sequence[Panel], panel: Panel, times: Floats, gap_s: float
) -> list[Axes]:
    """Draw a panel's waveforms, and their difference below where it has one; all panels share both scales."""
    axes = [figure.add_subplot(inner[1] if panel.difference else inner[1:])]
    _waveforms(axes[0], panel, panel.traces, times, gap_s)
    # The legend lies below.
    axes[0].set_ylim(_range([t for p in panels for t in p.traces], [p.background for p in panels], foot=3))
    axes[0].legend(loc="lower right", handlelength=1.4, borderaxespad=0.1)
    if panel.difference:
        axes.append(figure.add_subplot(inner[2]))
        _waveforms(axes[1], panel, [panel.difference], times, gap_s)
        axes[1].set_ylim(_difference_range([p.difference for p in panels if p.difference]))
        axes[1].yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes[0].tick_params(labelbottom=False)
    return axes


def _waveforms(axes: Axes, panel: Panel, traces: Sequence[Trace], times: Floats, gap_s: float) -> None:
    ms = times * 1000
    if panel.significant is not None:
        for start, stop in spans(panel.significant):
            half = (ms[1] - ms[0]) / 2
            axes.axvspan(ms[start] - half, ms[stop - 1] + half, color="0.82", lw=0, zorder=0)
    shade_gap(axes, gap_s, times[-1])
    axes.axhline(0, color="0.6", lw=0.5, zorder=1)
    axes.axvline(0, color="0.6", lw=0.5, zorder=1)
    if panel.background is not None and traces is panel.traces:
        axes.plot(ms, panel.background.T, color="0.8", lw=0.35, zorder=1.5)
    for trace in traces:
        if np.isfinite(trace.error).any():
            low, high = trace.mean - trace.error, trace.mean + trace.error
            axes.fill_between(ms, low, high, color=trace.colour, alpha=0.18, lw=0, zorder=2)
        axes.plot(ms, trace.mean, color=trace.colour, lw=1.3, label=trace.label, zorder=3)
    for one in panel.maps:
        axes.axvline(one.time * 1000, color=GREY, lw=0.5, ls=(0, (1, 2)), zorder=1)
    axes.set_xlim(ms[0], ms[-1])


def _legend(figure: Figure, panels: Sequence[Panel], gap_s: float, stop_s: float, above: float) -> None:
    patches = []
    if any(p.significant is not None and p.significant.any() for p in panels):
        patches.append(Patch(facecolor="0.82", label="significant difference"))
    legend_below(figure, patches, gap_s, stop_s, above=above)


def _marks(panels: Sequence[Panel]) -> list[str]:
    """Return sentences on what is drawn and named in no legend."""
    marks = ["dotted: times of the maps"] if any(panel.maps for panel in panels) else []
    if any(one.title for panel in panels for one in panel.maps):
        marks.append("map with a channel's name: largest of all channels and times")
    return marks + (["thin grey: all channels"] if any(panel.background is not None for panel in panels) else [])


def bands(panels: Sequence[Panel]) -> dict[str, bool]:
    """Return whether any of the ``waves`` has a band, and any ``difference``, and whether one of those is ``cut``."""
    waves = [trace for panel in panels for trace in panel.traces]
    differences = [panel.difference for panel in panels if panel.difference]
    kinds = (("waves", waves), ("difference", differences))
    drawn = {kind: any(np.isfinite(trace.error).any() for trace in traces) for kind, traces in kinds}
    return drawn | {"cut": bool(differences) and _widest(differences) > _most(differences)}


def _limit(maps: Sequence[Topography]) -> float:
    # One strong electrode should not bleach all maps.
    largest = max((float(np.quantile(np.abs(m.values), 0.98)) for m in maps), default=0.0)
    return largest or 1.0


def _most(differences: Sequence[Trace]) -> float:
    """Return how far from 0 intervals are drawn: of two subjects they would make all differences a flat line."""
    return _WIDEST * max(float(np.abs(one.mean).max()) for one in differences)


def _widest(differences: Sequence[Trace]) -> float:
    return max(float((np.abs(one.mean) + np.nan_to_num(one.error)).max()) for one in differences)


def _difference_range(differences: Sequence[Trace]) -> tuple[float, float]:
    low, high = _range(differences)
    most = _most(differences) or high
    return max(low, -most), min(high, most)


def _range(
    traces: Sequence[Trace], backgrounds: Sequence[Floats | None] = (), *, foot: float = 1
) -> tuple[float, float]:
    """Return the limits that hold all waveforms, with some room, ``foot`` times as much below as above."""
    edges = [t.mean + sign * np.nan_to_num(t.error) for t in traces for sign in (-1, 1)]
    edges += [one for one in backgrounds if one is not None]
    low, high = min(float(e.min()) for e in edges), max(float(e.max()) for e in edges)
    room = 0.05 * (high - low) or 1.0
    return low - foot * room, high + room
