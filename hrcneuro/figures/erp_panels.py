"""What the figures of erp show: which waveforms, which maps, at which times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrcneuro.eeg.evoked import difference_interval, farthest_from_zero, half_interval, peak_times
from hrcneuro.eeg.significance import ContrastWaves, SignificanceMap
from hrcneuro.figures.erp import Panel, Trace
from hrcneuro.figures.notes import contrast_title
from hrcneuro.figures.style import CONTINUATION, INK, colours
from hrcneuro.figures.topomap import Topography, peak_title

Floats = NDArray[np.float64]

_MAPS = 4
# So many conditions are also shown one by one, all channels behind the chosen one.
_FEW = 3
# Maps closer together show the same component twice.
_APART_S = 0.08


@dataclass(frozen=True)
class PanelSettings:
    """What all panels share.

    Attributes:
        channels: Their names.
        times: Time of each sample, ndarray, shape (n_times,), s.
        row: The place of the waveforms' channel.
        gap_s: The shortest time to the next onset, s; NaN if unknown.
        map_times_s: Times of the maps, s; empty for the largest value and the most pronounced maps.
        confidence: Level of the differences' intervals.
    """

    channels: Sequence[str]
    times: Floats
    row: int
    gap_s: float
    map_times_s: Sequence[float]
    confidence: float


def of_subject(
    counts: Mapping[str, int],
    means: Mapping[str, Floats],
    errors: Mapping[str, Floats],
    contrasts: Mapping[str, Sequence[str]],
    shown: PanelSettings,
) -> list[Panel]:
    """Return a panel a contrast over all scenarios; without contrast, or with few conditions, a panel a condition too.

    Args:
        counts: Condition -> trials.
        means, errors: Condition -> mean and its standard error, ndarray, shape (n_channels, n_times), µV.
        contrasts: Name -> [plus, minus], names of conditions.
        shown: Times, channel and maps.
    """
    hues = colours([plus for plus, _ in contrasts.values()] or list(means))

    def trace(name: str, colour: str) -> Trace:
        return Trace(f"{name} ({counts[name]})", means[name][shown.row], errors[name][shown.row], colour)

    def difference(plus: str, minus: str) -> Trace:
        error = difference_interval(
            (errors[plus][shown.row], errors[minus][shown.row]),
            (counts[plus], counts[minus]),
            confidence=shown.confidence,
        )
        return Trace("difference", means[plus][shown.row] - means[minus][shown.row], error, INK)

    panels = [
        Panel(
            name,
            [trace(minus, CONTINUATION), trace(plus, hues[plus])],
            _maps(means[plus] - means[minus], None, shown, shown.gap_s),
            difference=difference(plus, minus),
        )
        for name, (plus, minus) in contrasts.items()
        if plus in means and minus in means
    ]
    if panels and len(means) > _FEW:
        return panels
    return panels + [
        Panel(name, [trace(name, hues.get(name, CONTINUATION))], _maps(mean, None, shown, np.inf), background=mean)
        for name, mean in means.items()
    ]


@dataclass(frozen=True)
class GroupPanel:
    """A tested contrast.

    Attributes:
        scenario, name, plus, minus: What is compared.
        tested: The map of its difference.
        waves: The shown channel's waveforms.
    """

    scenario: str
    name: str
    plus: str
    minus: str
    tested: SignificanceMap
    waves: ContrastWaves


def of_group(contrasts: Sequence[GroupPanel], shown: PanelSettings) -> list[Panel]:
    """Return a panel a tested contrast."""
    hues = colours([one.plus for one in contrasts])
    panels = []
    for one in contrasts:
        significant = one.tested.significant if one.tested.tested else None
        waves, n = one.waves, one.tested.n
        half = half_interval(waves.sd / np.sqrt(n), n - 1.0, confidence=shown.confidence)
        panels.append(
            Panel(
                contrast_title(one.scenario, one.name, n),
                [
                    Trace(one.minus, waves.minus, waves.minus_error, CONTINUATION),
                    Trace(one.plus, waves.plus, waves.plus_error, hues[one.plus]),
                ],
                _maps(one.tested.difference, significant, shown, shown.gap_s),
                None if significant is None else significant[shown.row],
                difference=Trace("difference", waves.difference, half, INK),
            )
        )
    return panels


@dataclass(frozen=True)
class CoefficientPanel:
    """A coefficient of a regression, of one subject or of the group.

    Attributes:
        title: Above the panel.
        map: Its values, and where they are significant.
        sd: Over subjects, ndarray, shape (n_channels, n_times), µV; NaN of one.
    """

    title: str
    map: SignificanceMap
    sd: Floats


def of_coefficients(coefficients: Sequence[CoefficientPanel], shown: PanelSettings) -> list[Panel]:
    """Return a panel a coefficient, its wave with the confidence interval."""
    hues = colours([one.title.partition(": ")[2] for one in coefficients])
    panels = []
    for one in coefficients:
        n, name = one.map.n, one.title.partition(": ")[2]
        significant = one.map.significant if one.map.tested else None
        half = np.full(one.map.difference.shape[1], np.nan)
        if n > 1:
            half = half_interval(one.sd[shown.row] / np.sqrt(n), n - 1.0, confidence=shown.confidence)
        panels.append(
            Panel(
                one.title,
                [Trace(name, one.map.difference[shown.row], half, hues[name])],
                _maps(one.map.difference, significant, shown, shown.gap_s),
                None if significant is None else significant[shown.row],
            )
        )
    return panels


def _maps(
    values: Floats, significant: NDArray[np.bool_] | None, shown: PanelSettings, stop_s: float
) -> list[Topography]:
    """Return maps at the wanted times, else at the largest value and where maps are most pronounced.

    The largest value and the two most pronounced maps may lie anywhere, the others up to ``stop_s``.
    """
    times, wanted = shown.times, shown.map_times_s
    row, peak = farthest_from_zero(values)
    if not wanted:
        strength = values.std(axis=0)
        if significant is not None and significant.any():
            # Where something is significant, show that; the factor only sets it above all else.
            strength = strength * (1 + 1000 * significant.sum(axis=0))
        stop = float(stop_s) if np.isfinite(stop_s) else float(times[-1])
        wanted = _most_pronounced(float(times[peak]), strength, values[shown.row], times, stop)
    samples = [int(np.argmin(np.abs(times - t))) for t in wanted]
    marks = [None if significant is None else significant[:, i] for i in samples]
    titles = [peak_title(times[i], shown.channels[row]) if i == peak else "" for i in samples]
    return [
        Topography(float(times[i]), values[:, i], marked, title)
        for i, marked, title in zip(samples, marks, titles, strict=True)
    ]


def _most_pronounced(first: float, strength: Floats, wave: Floats, times: Floats, stop: float) -> list[float]:
    """Return a first time, when a map is strongest and the shown wave largest, and others up to ``stop``, s.

    Args:
        first: Where it must not miss, s.
        strength: Of the map, ndarray, shape (n_times,).
        wave: The shown channel's, ndarray, shape (n_times,), µV.
        times: ndarray, shape (n_times,), s.
        stop: Where responses begin to overlap, s.
    """
    chosen = [first]
    for values in (strength, np.abs(wave)):
        (peak,) = peak_times(values, times, start=0.0, stop=float(times[-1]), count=1, apart=_APART_S)
        chosen += [peak] if all(abs(peak - other) >= _APART_S for other in chosen) else []
    for count in range(2 * _MAPS, 0, -1):
        others = peak_times(strength, times, start=0.0, stop=stop, count=count, apart=_APART_S)
        free = [t for t in others if all(abs(t - one) >= _APART_S for one in chosen)]
        if len(chosen) + len(free) <= _MAPS:
            return sorted(chosen + free)
    return sorted(chosen)
