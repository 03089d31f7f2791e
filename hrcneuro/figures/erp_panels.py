"""What the figures of erp show: which waveforms, which maps, at which times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrcneuro.eeg.contrasts import Averages, Tested
from hrcneuro.eeg.evoked import difference_interval, half_interval, peak_times, standard_error
from hrcneuro.eeg.selection import ALL, Cell, Trials
from hrcneuro.figures.erp import Panel, Trace
from hrcneuro.figures.style import CONTINUATION, INK, colours
from hrcneuro.figures.topomap import Map

Floats = NDArray[np.float64]

_MAPS = 4
# So many conditions are also shown one by one, all channels behind the chosen one.
_FEW = 3
# Maps closer together show the same component twice.
_APART_S = 0.08


def of_subject(
    trials: Trials, data: Floats, cells: Sequence[Cell], means: Floats, config: Any, channel: str, gap_s: float
) -> list[Panel]:
    """Return a panel a contrast over all scenarios; without contrast, or with few conditions, a panel a condition too.

    Args:
        trials: The epochs.
        data: The same with their baseline subtracted.
        cells, means: What was averaged, and the averages.
        config: erp's Config.
        channel: Whose waveforms are shown.
        gap_s: The shortest time to the next onset, NaN if unknown.
    """
    row = trials.info["ch_names"].index(channel)
    mean_of = {cell.condition: mean for cell, mean in zip(cells, means, strict=True) if cell.scenario == ALL}
    mask_of = {cell.condition: cell.mask for cell in cells if cell.scenario == ALL}
    hues = colours([plus for plus, _ in config.contrasts.values()] or list(mean_of))

    def trace(name: str, colour: str) -> Trace:
        # Single trials still hold their neighbours' responses, so regressed averages have no such error.
        error = standard_error(data[mask_of[name], row]) if config.overlap == "keep" else np.zeros(len(trials.times))
        return Trace(f"{name} ({int(mask_of[name].sum())})", mean_of[name][row], error, colour)

    def difference(plus: str, minus: str) -> Trace:
        error = np.zeros(len(trials.times))
        if config.overlap == "keep":
            parts = [data[mask_of[name], row] for name in (plus, minus)]
            error = difference_interval(*parts, confidence=config.confidence)
        return Trace("difference", mean_of[plus][row] - mean_of[minus][row], error, INK)

    def maps(values: Floats, stop_s: float) -> list[Map]:
        return _maps(values, None, trials.times, stop_s, config.map_times_s)

    panels = [
        Panel(
            name,
            [trace(minus, CONTINUATION), trace(plus, hues[plus])],
            maps(mean_of[plus] - mean_of[minus], gap_s),
            difference=difference(plus, minus),
        )
        for name, (plus, minus) in config.contrasts.items()
        if plus in mean_of and minus in mean_of
    ]
    if panels and len(mean_of) > _FEW:
        return panels
    return panels + [
        Panel(name, [trace(name, hues.get(name, CONTINUATION))], maps(mean, np.inf), background=mean)
        for name, mean in mean_of.items()
    ]


@dataclass(frozen=True)
class Group:
    """The subjects' averages (microvolt), and what is drawn of them."""

    averages: Mapping[str, Averages]
    times: Floats
    channels: Sequence[str]
    channel: str
    gap_s: float
    map_times_s: Sequence[float]
    confidence: float

    def panels(self, tested: Sequence[Tested]) -> list[Panel]:
        """Return a panel a tested contrast."""
        hues = colours([t.plus for t in tested])
        row = list(self.channels).index(self.channel)
        panels = []
        for one in tested:
            test = one.result.test
            significant = None if test is None else test.significant
            panels.append(
                Panel(
                    f"{one.name if one.scenario == ALL else f'{one.scenario}: {one.name}'}, n = {len(one.units)}",
                    [self._trace(one, one.minus, CONTINUATION), self._trace(one, one.plus, hues[one.plus])],
                    _maps(one.result.difference, significant, self.times, self.gap_s, self.map_times_s),
                    None if significant is None else significant[row],
                    difference=self._difference(one),
                )
            )
        return panels

    def _difference(self, one: Tested) -> Trace:
        row, result = list(self.channels).index(self.channel), one.result
        error = np.zeros(len(self.times))
        if result.n > 1:
            error = half_interval(result.sd[row] / np.sqrt(result.n), result.n - 1.0, confidence=self.confidence)
        return Trace("difference", result.difference[row], error, INK)

    def _trace(self, one: Tested, condition: str, colour: str) -> Trace:
        row = list(self.channels).index(self.channel)
        waves = np.stack([self.averages[unit][one.scenario, condition][row] for unit in one.units])
        return Trace(condition, waves.mean(axis=0), standard_error(waves), colour)


def _maps(
    values: Floats, significant: NDArray[np.bool_] | None, times: Floats, stop_s: float, wanted: Sequence[float]
) -> list[Map]:
    """Return maps at the wanted times, else where the map is most pronounced up to ``stop_s`` (the end if NaN)."""
    if not wanted:
        stop = float(stop_s) if np.isfinite(stop_s) else float(times[-1])
        strength = values.std(axis=0)
        if significant is not None and significant.any():
            # Where something is significant, show that; the factor only sets it above all else.
            strength = strength * (1 + 1000 * significant.sum(axis=0))
        wanted = peak_times(strength, times, start=0.0, stop=stop, count=_MAPS, apart=_APART_S)
    samples = [int(np.argmin(np.abs(times - t))) for t in wanted]
    return [Map(float(times[i]), values[:, i], None if significant is None else significant[:, i]) for i in samples]
