"""Polyphase down-sampling on one time grid: sample k of the result lies at k · down / up samples of the source.

Arrays are channels × samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from hrcneuro.eeg.breaks import segments
from hrcneuro.errors import ConfigError

# A finer ratio would need a filter of more phases than it is worth: at most this many steps between two samples.
_MAX_FACTOR = 1000
_ATTENUATION_DB = 120.0


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
        """Return the new sample nearest to each old one (½ goes up): at most half a new sample off, without drift."""
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


def antialias_taps(made: Ratio, pass_freq: float) -> np.ndarray:
    """Return the low-pass on the grid of ``source · up`` Hz, with gain ``up``.

    It keeps 0 … ``pass_freq`` and stops what would fold onto that band, 120 dB each. What lies between may fold among
    itself: the filter before has taken it away.

    Raises:
        ConfigError: ``pass_freq`` is not below the new Nyquist rate.
    """
    from scipy.signal import firwin, kaiserord

    if not 0 < pass_freq < made.sfreq / 2:
        raise ConfigError(
            f"a signal up to {pass_freq:g} Hz does not fit a sampling rate of {made.sfreq:g} Hz",
            cure=f"set preprocess.sfreq above {2 * pass_freq:g} Hz, or lower preprocess.h_freq",
        )
    grid = made.source * made.up
    width = made.sfreq - 2 * pass_freq
    n_taps, beta = kaiserord(_ATTENUATION_DB, width / (grid / 2))
    taps = firwin(n_taps | 1, made.sfreq / 2, window=("kaiser", beta), fs=grid)
    return taps * (made.up / taps.sum())


def resample(data: np.ndarray, made: Ratio, *, pass_freq: float, borders: Sequence[int] = ()) -> np.ndarray:
    """Return ``data`` at the new rate, as a view into ``data``'s own memory (its old content is lost).

    Stretches between borders do not mix: each is continued by its own point reflection at its ends, which keeps level
    and slope. The grid goes on across borders, so that no event drifts.

    Args:
        data: channels × samples at ``made.source`` Hz.
        made: The ratio.
        pass_freq: Highest frequency to keep, in Hz.
        borders: First samples of new stretches.

    Raises:
        ConfigError: See :func:`antialias_taps`.
    """
    if made.up == made.down:
        return data
    taps = antialias_taps(made, pass_freq)
    n_new = made.length(data.shape[1])
    plans = [_Stretch(a, b, made, taps) for a, b in segments(borders, data.shape[1])]
    for channel in data:
        for plan in plans:
            channel[plan.new_start : plan.new_stop] = plan.apply(channel)
    return data[:, :n_new]


class _Stretch:
    """One stretch's share of the common grid. In place is safe: new samples never lie after the old they come from."""

    def __init__(self, start: int, stop: int, made: Ratio, taps: np.ndarray) -> None:
        self.start, self.stop, self.made = start, stop, made
        self.new_start, self.new_stop = made.first(start), made.first(stop)
        half = len(taps) // 2
        self.pad = math.ceil(half / made.up)
        # On the fine grid, new sample new_start + j lies this far after the padded stretch's first sample, plus j·down.
        offset = self.new_start * made.down - (start - self.pad) * made.up + half
        lead = -offset % made.down
        self.skip = (offset + lead) // made.down
        self.taps = np.concatenate([np.zeros(lead), taps])

    def apply(self, channel: np.ndarray) -> np.ndarray:
        from scipy.signal import upfirdn

        padded = np.pad(channel[self.start : self.stop], self.pad, mode="reflect", reflect_type="odd")
        out = upfirdn(self.taps, padded, self.made.up, self.made.down)
        return out[self.skip : self.skip + self.new_stop - self.new_start]
