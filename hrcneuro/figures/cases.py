"""The paper's Figs 2 and 3, composed as printed: maps, potentials at Cz and masked rhythms of each contrast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hrcneuro.eeg.evoked import farthest_from_zero
from hrcneuro.eeg.significance import ContrastWaves, SignificanceMap
from hrcneuro.eeg.spans import spans
from hrcneuro.figures.style import (
    COLOURS,
    CONTINUATION,
    GREY,
    STYLE,
    foot_height,
    foot_lines,
    legend_below,
    shade_gap,
    write_foot,
)
from hrcneuro.figures.topomap import Scalp, Topography, peak_title

_TITLES = {"HR": "robot takes over from human", "RH": "human takes over from robot"}
_HUES = {"HR": COLOURS[0], "RH": COLOURS[1]}
# Where the responses of this paradigm lie; the nearest give way to the largest difference, and to where most electrodes
# are significant.
_MAP_TIMES_S = (0.1, 0.3, 0.5, 0.7)
_WIDTH, _HEIGHT = 4.7, 4.5  # inches a panel
_HEAD, _FOOT = 0.5, 0.85  # inches above and below all panels


@dataclass(frozen=True)
class CasePanel:
    """A takeover against the continuation of its owner, before or after.

    Attributes:
        letter: As printed.
        scenario: One of them, or ``all``.
        case: The takeover: ``HR`` or ``RH``.
        continuation: ``HH`` or ``RR``.
        position: ``before`` or ``after``.
        potentials: Where they differ.
        waves: The shown channel's potentials.
        rhythms: Where the magnitudes differ; None where ersp has not run.
    """

    letter: str
    scenario: str
    case: str
    continuation: str
    position: str
    potentials: SignificanceMap
    waves: ContrastWaves
    rhythms: SignificanceMap | None

    @property
    def title(self) -> str:
        """What is compared, in words."""
        scenario = "" if self.scenario == "all" else f"{self.scenario}, "
        return f"{scenario}{self.position}: {_TITLES[self.case]}"


def compose(
    panels: Sequence[CasePanel], positions: NDArray[np.float64], *, channel: str, gap_s: float, note: str
) -> Figure:
    """Return the figure, two panels a row.

    Args:
        panels: In reading order.
        positions: Of the channels in head coordinates, ndarray, shape (n_channels, 3), m; NaN where unknown.
        channel: Whose waveforms are shown.
        gap_s: The shortest time to the next onset, s; NaN if unknown.
        note: A line below the picture.
    """
    limit = max(float(np.quantile(np.abs(panel.potentials.difference), 0.998)) for panel in panels)
    scalp = Scalp.of(positions)
    rows = -(-len(panels) // 2)
    lines = foot_lines(note, 2 * _WIDTH)
    more = foot_height(lines)
    foot = _FOOT + more
    high = rows * _HEIGHT + foot - 0.17
    with rc_context(STYLE):
        figure = Figure(figsize=(2 * _WIDTH, high))
        grid = figure.add_gridspec(
            rows, 2, left=0.07, right=0.955, top=1 - _HEAD / high, bottom=foot / high, wspace=0.2, hspace=0.32
        )
        waves = []
        for i, panel in enumerate(panels):
            cell = grid[i // 2, i % 2]
            parts = cell.subgridspec(5, 1, height_ratios=[1.1, 0.06, 2.1, 0.25, 1.1], hspace=0)
            tested = panel.potentials
            # Without maps there are no lines at their times either.
            times = map_times(tested) if scalp is not None else []
            if scalp is not None:
                maps = [_topography(tested, time) for time in times]
                scalp.draw(figure.add_subplot(parts[0]), maps, limit, slots=len(_MAP_TIMES_S), bar=True)
            axes = figure.add_subplot(parts[2])
            _draw_waves(axes, panel, times, channel)
            shade_gap(axes, gap_s, float(tested.times[-1]))
            waves.append(axes)
            below = figure.add_subplot(parts[4], sharex=axes)
            _draw_rhythms(figure, below, panel.rhythms)
            shade_gap(below, gap_s, float(tested.times[-1]), above=True)
            place = cell.get_position(figure)
            figure.text(place.x0 - 0.055, place.y1 + 0.3 / high, panel.letter, fontsize=12, fontweight="bold")
            figure.text(place.x0 - 0.03, place.y1 + 0.31 / high, panel.title, fontsize=9)
        patches = [Patch(facecolor="0.82", label="significant difference")]
        marked = any(panel.potentials.within((channel,)).any for panel in panels)
        last = max(float(panel.potentials.times[-1]) for panel in panels)
        legend_below(figure, patches if marked else [], gap_s, last, above=more)
        write_foot(figure, lines)
        low, top = min(a.get_ylim()[0] for a in waves), max(a.get_ylim()[1] for a in waves)
        for axes in waves:
            axes.set_ylim(low, top)
    return figure


def map_times(tested: SignificanceMap) -> list[float]:
    """Return the times of the maps, s: two of them where most electrodes are significant, and at the largest value."""
    times = [t for t in _MAP_TIMES_S if tested.times[0] <= t <= tested.times[-1]]
    musts = [float(tested.times[farthest_from_zero(tested.difference)[1]])]
    if tested.any:
        count = tested.significant.sum(axis=0)
        # The middle of the longest plateau, not its first sample.
        musts.append(float(np.median(tested.times[count == count.max()])))
    for i, must in enumerate(musts):
        free = [t for t in times if t not in musts[:i]]
        if free:
            times[times.index(min(free, key=lambda t: abs(t - must)))] = must
    return sorted(set(times))


def _topography(tested: SignificanceMap, time: float) -> Topography:
    at = int(np.argmin(np.abs(tested.times - time)))
    row, peak = farthest_from_zero(tested.difference)
    title = peak_title(time, tested.channels[row]) if at == peak else ""
    return Topography(time, tested.difference[:, at], tested.significant[:, at], title)


def _draw_waves(axes: Axes, panel: CasePanel, times: Sequence[float], channel: str) -> None:
    tested, waves = panel.potentials, panel.waves
    ms = 1000 * tested.times
    half = (ms[1] - ms[0]) / 2
    for start, stop in spans(tested.of_channels([channel]).significant[0]):
        axes.axvspan(ms[start] - half, ms[stop - 1] + half, color="0.82", lw=0, zorder=0)
    axes.axhline(0, color="0.6", lw=0.5)
    axes.axvline(0, color="0.6", lw=0.5)
    for x in times:
        axes.axvline(1000 * x, color=GREY, lw=0.5, ls=(0, (1, 2)), zorder=1)
    for label, mean, error, colour in (
        (panel.continuation, waves.minus, waves.minus_error, CONTINUATION),
        (panel.case, waves.plus, waves.plus_error, _HUES[panel.case]),
    ):
        axes.plot(ms, mean, color=colour, lw=1.4, label=label)
        if np.isfinite(error).all():
            axes.fill_between(ms, mean - error, mean + error, color=colour, alpha=0.18, lw=0)
    axes.set_xlim(ms[0], ms[-1])
    axes.margins(y=0.08)
    axes.set_ylabel(f"{channel} (µV)")
    axes.tick_params(labelbottom=False)
    axes.legend(loc="upper left", title=f"n = {tested.n}", title_fontsize=7, borderaxespad=0.1, handlelength=1.3)


def _draw_rhythms(figure: Figure, axes: Axes, tested: SignificanceMap | None) -> None:
    """Draw, for every time and frequency, the significant difference that is largest over the channels."""
    axes.set_xlabel("time from onset (ms)")
    axes.set_ylabel("frequency (Hz)")
    if tested is None:
        axes.text(0.5, 0.5, "ersp has not run", transform=axes.transAxes, ha="center", color=GREY)
        return
    masked = np.where(tested.significant, tested.difference, 0.0)
    extreme = np.take_along_axis(masked, np.abs(masked).argmax(axis=0)[None], axis=0)[0]
    ms, hz = 1000 * tested.times, tested.frequencies
    axes.set_ylim(hz[0] - 1, hz[-1] + 1)
    axes.axvline(0, color="0.6", lw=0.5)
    if not tested.any:
        axes.text(
            0.5, 0.5, "ERSP: no bin is significant", transform=axes.transAxes, ha="center", color=GREY, fontsize=8
        )
        return
    # A single bin should not bleach all others.
    limit = float(np.quantile(np.abs(extreme[extreme != 0]), 0.95))
    shown = np.ma.masked_where(extreme == 0, extreme)
    image = axes.pcolormesh(ms, hz, shown, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="nearest", rasterized=True)
    names = np.array(tested.channels)[np.unique(np.abs(masked).argmax(axis=0)[extreme != 0])]
    text = ", ".join(names[:6]) + (" ..." if len(names) > 6 else "")
    axes.text(0.01, 0.95, f"significant at {text}", transform=axes.transAxes, va="top", fontsize=7)
    bar = figure.colorbar(image, cax=axes.inset_axes((1.01, 0, 0.012, 0.85)), extend="both")
    bar.ax.set_title("µV", fontsize=6, pad=3)
    bar.ax.tick_params(labelsize=6, length=2, pad=1)
