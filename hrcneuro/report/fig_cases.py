"""The paper's Figs 2 and 3, composed as printed: maps, potentials at Cz and masked rhythms of each contrast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hrcneuro.analyses.contrasts import named_test
from hrcneuro.figures.style import COLOURS, CONTINUATION, GREY, STYLE, legend_below, shade_gap
from hrcneuro.figures.topomap import Map, Scalp
from hrcneuro.report.maps import Tested
from hrcneuro.report.results import Results

TITLES = {"HR": "robot takes over from human", "RH": "human takes over from robot"}
_HUES = {"HR": COLOURS[0], "RH": COLOURS[1]}
# Where the responses of this paradigm lie; the nearest gives way to where most electrodes are significant.
_MAP_TIMES_S = (0.1, 0.3, 0.5, 0.7)
_WIDTH, _HEIGHT = 4.7, 4.5  # inches a panel
_HEAD, _FOOT = 0.5, 0.85  # inches above and below all panels


@dataclass(frozen=True)
class Panel:
    """One contrast in one scenario."""

    letter: str
    scenario: str
    plus: str
    minus: str

    @property
    def key(self) -> tuple[str, str]:
        """The panel's place among the tested maps."""
        case, position = self.plus.split("_", 1)
        return self.scenario, f"{case}-{self.minus.split('_')[0]}_{position}"

    @property
    def title(self) -> str:
        """What is compared, in words."""
        case, position = self.plus.split("_", 1)
        scenario = "" if self.scenario == "all" else f"{self.scenario}, "
        return f"{scenario}{position}: {TITLES[case]}"


FIG_2 = (
    Panel("A", "all", "HR_before", "HH_before"),
    Panel("B", "all", "HR_after", "HH_after"),
    Panel("C", "all", "RH_before", "RR_before"),
    Panel("D", "all", "RH_after", "RR_after"),
)
FIG_3 = (Panel("A", "sC", "RH_before", "RR_before"), Panel("B", "iC", "RH_before", "RR_before"))


def draw(results: Results, panels: Sequence[Panel]) -> Figure | None:
    """Return the figure; None where the group's potentials have not been tested."""
    erp, ersp = results.maps("erp"), results.maps("ersp")
    means = results.table("erp", "group", "erp.parquet")
    if means is None or any(panel.key not in erp for panel in panels):
        return None
    channel = results.settings.sections["erp"].channel
    traces = {(r["scenario"], r["condition"]): r for r in means[means["channel"] == channel].to_dict("records")}
    limit = max(float(np.quantile(np.abs(erp[p.key].difference), 0.998)) for p in panels)
    scalp = Scalp.of(_positions(results, erp[panels[0].key].channels))
    gap = _gap_s(results)
    rows = len(panels) // 2
    high = rows * _HEIGHT + _FOOT - 0.17
    with rc_context(STYLE):
        figure = Figure(figsize=(2 * _WIDTH, high))
        grid = figure.add_gridspec(
            rows, 2, left=0.07, right=0.955, top=1 - _HEAD / high, bottom=_FOOT / high, wspace=0.2, hspace=0.32
        )
        waves = []
        for i, panel in enumerate(panels):
            cell = grid[i // 2, i % 2]
            parts = cell.subgridspec(5, 1, height_ratios=[1.1, 0.06, 2.1, 0.25, 1.1], hspace=0)
            tested = erp[panel.key]
            times = map_times(tested)
            if scalp is not None:
                shown = [_map(tested, time) for time in times]
                scalp.draw(figure.add_subplot(parts[0]), shown, limit, slots=len(_MAP_TIMES_S), bar=True)
            axes = figure.add_subplot(parts[2])
            _waves(axes, panel, traces, tested, times, channel)
            shade_gap(axes, gap, float(tested.times[-1]))
            waves.append(axes)
            below = figure.add_subplot(parts[4], sharex=axes)
            _rhythms(figure, below, ersp.get(panel.key))
            shade_gap(below, gap, float(tested.times[-1]), above=True)
            place = cell.get_position(figure)
            figure.text(place.x0 - 0.055, place.y1 + 0.3 / high, panel.letter, fontsize=12, fontweight="bold")
            figure.text(place.x0 - 0.03, place.y1 + 0.31 / high, panel.title, fontsize=9)
        spans = [Patch(facecolor="0.82", label="significant difference")]
        marked = any(erp[p.key].within((channel,)).any for p in panels)
        legend_below(figure, spans if marked else [], gap, max(float(erp[p.key].times[-1]) for p in panels))
        foot = f"bands: standard error; {_tests(results, panels[0].key)}"
        figure.text(0.1 / (2 * _WIDTH), 0.06 / high, foot, fontsize=6.5, color=GREY, va="bottom")
        low, top = min(a.get_ylim()[0] for a in waves), max(a.get_ylim()[1] for a in waves)
        for axes in waves:
            axes.set_ylim(low, top)
    return figure


def _tests(results: Results, key: tuple[str, str]) -> str:
    """Return what the tests of potentials and rhythms are: apart where they differ."""
    named = {
        what: named_test(results.settings.sections[stage], subjects=results.maps(stage)[key].n)
        for stage, what in (("erp", "potentials"), ("ersp", "rhythms"))
        if key in results.maps(stage)
    }
    if len(set(named.values())) == 1:
        return named["potentials"]
    return "; ".join(f"{what}: {test}" for what, test in named.items())


def _gap_s(results: Results) -> float:
    """Return the shortest time to the next onset over subjects and averages, as erp's own figures have it; or NaN."""
    gaps = [table["gap_s"].min() for table in results.tables("erp", "averages.parquet").values()]
    return float(min((gap for gap in gaps if np.isfinite(gap)), default=np.nan))


def map_times(tested: Tested) -> list[float]:
    """Return the times of the maps, one of them where most electrodes are significant."""
    times = [t for t in _MAP_TIMES_S if tested.times[0] <= t <= tested.times[-1]]
    if tested.any and times:
        count = tested.significant.sum(axis=0)
        # The middle of the longest plateau, not its first sample.
        best = float(np.median(tested.times[count == count.max()]))
        times[int(np.argmin(np.abs(np.array(times) - best)))] = best
    return sorted(times)


def _map(tested: Tested, time: float) -> Map:
    at = int(np.argmin(np.abs(tested.times - time)))
    return Map(time, tested.difference[:, at], tested.significant[:, at])


def _waves(
    axes: Axes, panel: Panel, traces: dict[Any, Any], tested: Tested, times: Sequence[float], channel: str
) -> None:
    ms = 1000 * tested.times
    here = tested.within((channel,)).significant.any(axis=0)
    if here.any():
        half = (ms[1] - ms[0]) / 2
        for start, stop in np.flatnonzero(np.diff(np.r_[False, here, False].astype(int))).reshape(-1, 2):
            axes.axvspan(ms[start] - half, ms[stop - 1] + half, color="0.82", lw=0, zorder=0)
    axes.axhline(0, color="0.6", lw=0.5)
    axes.axvline(0, color="0.6", lw=0.5)
    for x in times:
        axes.axvline(1000 * x, color=GREY, lw=0.5, ls=(0, (1, 2)), zorder=1)
    for condition, colour in ((panel.minus, CONTINUATION), (panel.plus, _HUES[panel.plus[:2]])):
        found = traces.get((panel.scenario, condition))
        if found is None:
            continue
        mean, error = np.asarray(found["mean_uv"], float), np.asarray(found["sd_uv"], float) / np.sqrt(found["n"])
        axes.plot(ms, mean, color=colour, lw=1.4, label=condition.split("_")[0])
        if np.isfinite(error).all():
            axes.fill_between(ms, mean - error, mean + error, color=colour, alpha=0.18, lw=0)
    axes.set_xlim(ms[0], ms[-1])
    axes.margins(y=0.08)
    axes.set_ylabel(f"{channel} (µV)")
    axes.tick_params(labelbottom=False)
    axes.legend(loc="upper left", title=f"n = {tested.n}", title_fontsize=7, borderaxespad=0.1, handlelength=1.3)


def _rhythms(figure: Figure, axes: Axes, tested: Tested | None) -> None:
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
    limit = float(np.abs(extreme).max())
    shown = np.ma.masked_where(extreme == 0, extreme)
    image = axes.pcolormesh(ms, hz, shown, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="nearest", rasterized=True)
    names = np.array(tested.channels)[np.unique(np.abs(masked).argmax(axis=0)[extreme != 0])]
    text = ", ".join(names[:6]) + (" ..." if len(names) > 6 else "")
    axes.text(0.01, 0.95, f"significant at {text}", transform=axes.transAxes, va="top", fontsize=7)
    bar = figure.colorbar(image, cax=axes.inset_axes((1.01, 0, 0.012, 0.85)))
    bar.ax.set_title("µV", fontsize=6, pad=3)
    bar.ax.tick_params(labelsize=6, length=2, pad=1)


def _positions(results: Results, channels: Sequence[str]) -> NDArray[np.float64]:
    """Return where the channels are on the head, shape (channels, 3), in metres; NaN where that is not known."""
    tables = results.tables("ersp", "channels.parquet")
    if tables:
        table: pd.DataFrame = next(iter(tables.values())).set_index("channel")
        places = {name: table.loc[name, ["x_m", "y_m", "z_m"]].to_numpy(float) for name in table.index}
    else:
        import mne

        places = mne.channels.make_standard_montage("standard_1005").get_positions()["ch_pos"]
    return np.array([places.get(name, np.full(3, np.nan)) for name in channels])
