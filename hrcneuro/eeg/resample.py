"""Polyphase down-sampling on one time grid: sample k of the result lies at k · down / up samples of the source."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from hrcneuro.eeg.breaks import segments
from hrcneuro.eeg.refusals import RateError

# A finer ratio would need a filter of more phases than it is worth: at most this many steps between two samples.
_MAX_FACTOR = 1000
_ATTENUATION_DB = 120.0
# New samples that are computed together: enough for a quick product, few enough that most weights are not zero.
_RUN = 32
# The low-pass lasts about 8 s divided by its transition band in Hz, and each new sample costs as many products.
_MIN_TRANSITION_HZ = 1.0


@dataclass(frozen=True)
class Ratio:
    """New rate = ``source`` · ``up`` / ``down``, never above the source."""

    source: float
    up: int
    down: int

    @property
    def sfreq(self) -> float:
        """The new sampling rate, in Hz."""
        return self.source * self.up / self.down

    def length(self, n_samples: int) -> int:
        """Return how many new samples lie within ``n_samples`` old ones."""
        return -(-n_samples * self.up // self.down)

    def nearest(self, samples: np.ndarray) -> np.ndarray:
        """Return the new sample nearest to each old one (½ goes up): at most half a new sample off, without drift.

        Args:
            samples: ndarray of integers, any shape.

        Returns:
            ndarray of integers, of that shape.
        """
        return (2 * np.asarray(samples, np.int64) * self.up + self.down) // (2 * self.down)

    def first(self, sample: int) -> int:
        """Return the first new sample at or after an old one: where a stretch that begins there begins."""
        return -(-sample * self.up // self.down)


def ratio(source: float, target: float) -> Ratio:
    """Return the ratio that takes ``source`` Hz to ``target`` Hz, or as near as factors up to 1000 come.

    A source at or below the target keeps its rate: up-sampling adds no information.
    """
    if source <= target:
        return Ratio(source, 1, 1)
    # Rates arrive as decimals, some through single precision; their ratio is meant to be the simple one nearby.
    wanted = Fraction(target) / Fraction(source)
    near = wanted.limit_denominator(_MAX_FACTOR)
    if near > 1:
        near = Fraction(1)
    return Ratio(source, near.numerator, near.denominator)


def common_rate(sources: Sequence[float]) -> int | None:
    """Return the highest whole rate, in Hz, that all sources reach with equal samples; None where there is none.

    Rates count as equal where their grids stay within 10 µs for a second, a hundredth of a sample at 1000 Hz.
    """
    for rate in range(math.floor(min(sources)), 1, -1):
        rates = [ratio(source, rate).sfreq for source in sources]
        if max(rates) - min(rates) <= 1e-5 * rate:
            return rate
    return None


def antialias_taps(ratio: Ratio, pass_freq: float) -> np.ndarray:
    """Return the low-pass on the grid of ``source · up`` Hz, with gain ``up``: ndarray, shape (n_taps,), n_taps odd.

    It keeps 0 … ``pass_freq`` and stops what would fold onto that band, 120 dB each. What lies between may fold among
    itself, above ``pass_freq``: the windowed sinc has taken it away, of the causal low-pass its skirt is left (with a
    pass band up to 40 Hz, at 70 Hz a tenth of the signal, at 250 Hz sampling rate a twenty-fifth).

    Raises:
        RateError: Less than 1 Hz lies between ``pass_freq`` and the frequency that would fold onto it.
    """
    grid = ratio.source * ratio.up
    width = ratio.sfreq - 2 * pass_freq
    if width < _MIN_TRANSITION_HZ:
        raise RateError(
            f"a signal up to {pass_freq:g} Hz does not fit a sampling rate of {ratio.sfreq:g} Hz: the low-pass before "
            f"it has {max(width, 0):.2g} Hz to fall in, and needs {_MIN_TRANSITION_HZ:g}",
            least=math.ceil(2 * pass_freq + _MIN_TRANSITION_HZ),
        )
    # Kaiser's formulas (Oppenheim & Schafer, Discrete-Time Signal Processing, §7.5.3): this many taps, this window.
    # scipy.signal has them too, but takes half a second to import.
    n_taps = math.ceil((_ATTENUATION_DB - 7.95) / (2.285 * 2 * math.pi * width / grid) + 1) | 1
    beta = 0.1102 * (_ATTENUATION_DB - 8.7)
    at = np.arange(n_taps) - n_taps // 2
    taps = np.sinc(ratio.sfreq / grid * at) * np.kaiser(n_taps, beta)
    return taps * (ratio.up / taps.sum())


def resample(data: np.ndarray, ratio: Ratio, *, pass_freq: float, borders: Sequence[int] = ()) -> np.ndarray:
    """Return ``data`` at the new rate, as a view into ``data``'s own memory (its old content is lost).

    Stretches between borders do not mix: each is continued by its own point reflection at its ends, which keeps level
    and slope. The grid goes on across borders, so that no event drifts.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit, at ``ratio.source`` Hz.
        ratio: Of the new rate to the old one.
        pass_freq: Highest frequency to keep, in Hz.
        borders: First samples of new stretches.

    Returns:
        ndarray, shape (n_channels, ``ratio.length(n_times)``), in that unit.

    Raises:
        RateError: See :func:`antialias_taps`.
    """
    if ratio.up == ratio.down:
        return data
    taps = antialias_taps(ratio, pass_freq)
    n_new = ratio.length(data.shape[1])
    plans = [_Stretch(a, b, ratio, taps) for a, b in segments(borders, data.shape[1])]
    for channel in data:
        for plan in plans:
            channel[plan.new_start : plan.new_stop] = plan.apply(channel)
    return data[:, :n_new]


class _Stretch:
    """One stretch's share of the common grid. In place is safe: the stretch is copied before its samples are written.

    New samples ``up`` apart weigh their neighbours alike, so a run of them is one product of a matrix: a row a
    repetition, in it the old samples around the run, times the taps that each new sample has for them.
    """

    def __init__(self, start: int, stop: int, ratio: Ratio, taps: np.ndarray) -> None:
        self.start, self.stop = start, stop
        self.new_start, self.new_stop = ratio.first(start), ratio.first(stop)
        half = len(taps) // 2
        self.pad = math.ceil(half / ratio.up)
        turns = -(-_RUN // ratio.up)
        self.new_step, self.old_step = turns * ratio.up, turns * ratio.down
        self.repetitions = max(0, -(-(self.new_stop - self.new_start) // self.new_step))
        # (the run's new samples, counted from new_start; its first old one, counted from the padding's; weights)
        self.runs: list[tuple[slice, int, np.ndarray]] = []
        for first in range(0, self.new_step, _RUN):
            last = min(first + _RUN, self.new_step)
            fine = (self.new_start + np.arange(first, last)) * ratio.down  # on the grid of source · up
            low, high = -(-(int(fine[0]) - half) // ratio.up), (int(fine[-1]) + half) // ratio.up
            tap = fine - ratio.up * np.arange(low, high + 1)[:, None] + half
            reached = (tap >= 0) & (tap < len(taps))
            weights = np.where(reached, taps[np.where(reached, tap, 0)], 0.0)
            self.runs.append((slice(first, last), low - start + self.pad, weights))
        # Held for all channels: the system clears fresh memory page by page. The zeros at the end serve the new samples
        # that fill the last repetition.
        length = stop - start + 2 * self.pad + self.old_step + max(len(w) for *_, w in self.runs)
        self.padded, self.out = np.zeros(length), np.empty((self.repetitions, self.new_step))

    def apply(self, channel: np.ndarray) -> np.ndarray:
        """Return the stretch's new samples; the next call overwrites them."""
        padded, out = self._padded(channel[self.start : self.stop]), self.out
        for new, first, weights in self.runs:
            rows = np.lib.stride_tricks.sliding_window_view(padded[first:], len(weights))[:: self.old_step]
            np.matmul(rows[: self.repetitions], weights, out=out[:, new])
        return out.ravel()[: self.new_stop - self.new_start]

    def _padded(self, old: np.ndarray) -> np.ndarray:
        """Return the stretch, continued at both ends, and zeros."""
        # The ends suffice to continue them; a short stretch is reflected more than once.
        ends = np.concatenate([old[: self.pad + 1], old[-self.pad - 1 :]]) if len(old) > 2 * self.pad + 2 else old
        ends = np.pad(ends, self.pad, mode="reflect", reflect_type="odd")
        padded = self.padded
        padded[: self.pad] = ends[: self.pad]
        padded[self.pad : self.pad + len(old)] = old
        padded[self.pad + len(old) : 2 * self.pad + len(old)] = ends[len(ends) - self.pad :]
        return padded
