"""Time in a stream of samples: where some are missing, how fast they came, and when each was taken.

Stamps of a stream are when samples were sent or arrived, so each is late by chance. Samples within a segment are taken
to come at a steady rate, as pyxdf does; but pyxdf looks over gaps below 500 samples, whatever the rate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_LEAST_GAP_S = 0.05
_LEAST_GAP_SAMPLES = 5
_AROUND_S = 2.0
_STEADY = 0.05  # of the sampling interval
_OFTEN = 3  # so many steps that are early are no accident
_WAVER = 8.0  # so many times the usual deviation of a step is no usual one
_KEPT = 0.005  # by this share a sender that counts samples does not miss its rate
_FEW = 0.1  # of all samples: a clock that runs backwards is no late chunk
_LATE_S = 30.0  # a chunk that comes later than that behind its neighbours is not put back among them


def usual_step(early: np.ndarray, interval: float) -> float:
    """Return by how much a step between two stamps may differ from the sampling interval without a word, s.

    Most steps within a chunk are exact: those between chunks waver, and what comes late once comes early next. Only
    what is early tells of that: where samples are lost, all steps are late.

    Args:
        early: ndarray, shape (n_steps,), by how much each step is shorter than the interval, s.
        interval: Nominal, s.
    """
    wavering = early[early > _STEADY * interval]
    if len(wavering) < _OFTEN:
        return 0.5 * interval
    return max(0.5 * interval, _WAVER * float(np.median(wavering)))


def in_order(stamps: np.ndarray, rate: float) -> np.ndarray:
    """Return the places of the samples in the order of time, where chunks came behind younger ones; else as they are.

    A clock that was set back is no such chunk: its stamps lie among those that are there already, not in their gaps.

    Args:
        stamps: ndarray, shape (n_samples,), s.
        rate: Nominal sampling rate, in Hz.
    """
    as_they_are = np.arange(len(stamps))
    back = np.diff(stamps)[np.diff(stamps) < 0]
    if not 0 < len(back) < _FEW * len(stamps) or not rate or back.min() < -_LATE_S:
        return as_they_are
    order = np.argsort(stamps, kind="stable")
    return order if np.diff(stamps[order]).min() > 0.5 / rate else as_they_are


def segments(stamps: np.ndarray, rate: float, known: Sequence[int] = ()) -> list[tuple[int, int]]:
    """Return (first sample, one past the last) of the stretches between which samples are missing.

    A sample that is only late is followed by others that are not; after a gap all come later. So a jump counts where
    the earliest arrival after it, against a steady clock, lies behind the earliest one before it. How short a gap can
    be told hangs on how the stamps waver: of a steady clock that keeps its rate, one sample.

    Args:
        stamps: ndarray, shape (n_samples,), s.
        rate: Nominal sampling rate, in Hz.
        known: First samples after gaps that the recorder has marked, however short.
    """
    period = _period(stamps, rate)
    late = stamps - np.arange(len(stamps)) * period
    least = max(_LEAST_GAP_S, _LEAST_GAP_SAMPLES * period)
    # A sender that does not keep its own rate has pauses in which nothing was lost.
    if len(stamps) > 1 and abs(period * rate - 1) < _KEPT:
        least = min(least, usual_step(period - np.diff(stamps), period))
    around = max(int(_AROUND_S / period), 2)
    starts = [0]
    for at in np.flatnonzero(np.abs(np.diff(late)) > least) + 1:
        before, after = late[max(at - around, starts[-1]) : at], late[at : at + around]
        if abs(after.min() - before.min()) > least:
            starts.append(int(at))
    starts = sorted({*starts, *(at for at in known if 0 < at < len(stamps))})
    return list(zip(starts, [*starts[1:], len(stamps)], strict=True))


def steady(stamps: np.ndarray, parts: list[tuple[int, int]]) -> tuple[np.ndarray, float]:
    """Return the time of each sample at a steady rate within each segment, and the measured rate over all, in Hz.

    The rate is 0 where no segment has two samples at different times.
    """
    times = stamps.copy()
    periods = duration = 0.0
    for start, stop in parts:
        if stop - start < 2:
            continue
        index = np.arange(stop - start)
        slope, offset = np.polyfit(index, stamps[start:stop], 1)
        times[start:stop] = offset + slope * index
        periods += stop - start - 1
        duration += slope * (stop - start - 1)
    return times, periods / duration if duration > 0 else 0.0


def samples_at(times: np.ndarray, parts: list[tuple[int, int]], when: np.ndarray, period: float) -> np.ndarray:
    """Return the place among the samples of each moment, in samples and their fractions; NaN where none was taken.

    A moment up to a sample before or after a segment belongs to it.
    """
    places = np.full(len(when), np.nan)
    # A thousandth more: whether just one sample lies within one would else be for the processor's rounding to say.
    reach = 1.001 * period
    for start, stop in parts:
        inside = (when >= times[start] - reach) & (when <= times[stop - 1] + reach) & np.isnan(places)
        places[inside] = np.interp(when[inside], times[start:stop], np.arange(start, stop))
    return places


def _period(stamps: np.ndarray, rate: float) -> float:
    """Return the time from sample to sample: the middle one of long stretches, so that a gap does not count."""
    stretch = int(min(10 * rate, len(stamps) // 4))
    if stretch < 1:
        return 1 / rate
    return float(np.median(stamps[stretch:] - stamps[:-stretch])) / stretch or 1 / rate
