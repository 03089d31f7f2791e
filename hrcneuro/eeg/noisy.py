"""Steadily noisy channels, which kurtosis cannot see: the deviation and the correlation of PREP.

Kurtosis finds rare, large samples; a contact that is bad all the time has none. PREP (Bigdely-Shamlo et al. 2015,
doi:10.3389/fninf.2015.00016) asks how large a channel is beside the others, and whether it goes with any of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.eeg.channels import MIN_CHANNELS

DEVIATION, CORRELATION = "deviation", "correlation"
WINDOW_S = 1.0
# Of a normal distribution the SD is so much of the distance between its quartiles.
_SD_OF_IQR = 0.7413
# A channel goes with others as well as with its second-best fiftieth: one copy of it is no proof that it is sound.
_NEAREST = 0.98
# Windows whose quantiles are taken in one call, which takes as long as the rest of a window.
_TOGETHER = 200
# Channels of few electrodes, far apart, may hardly go together: what would set so many apart is no noise of a channel.
_MOST_ALONE = 0.25


@dataclass(frozen=True)
class Noise:
    """How noisy channels are.

    Attributes:
        deviation: ndarray, shape (n_channels,), SD: robust z of the channel's robust SD; NaN where it was not compared.
        alone: ndarray, shape (n_channels,): share of the windows in which no other channel correlates well enough; NaN
            where there is no window or it was not compared.
        reason: ``deviation``, ``correlation``, ``deviation, correlation``, or an empty string.
        n_alone: How many channels go with no other, where these are too many for correlation to tell of noise; else 0.
    """

    deviation: np.ndarray
    alone: np.ndarray
    reason: list[str]
    n_alone: int = 0

    @property
    def noisy(self) -> np.ndarray:
        """Which channels are noisy: ndarray, shape (n_channels,), bool."""
        return np.array([bool(why) for why in self.reason], bool)


def judge(
    data: np.ndarray,
    sfreq: float,
    *,
    used: np.ndarray,
    deviation: float,
    correlation: float,
    share: float,
    borders: Sequence[int] = (),
) -> Noise:
    """Return which channels are noisy. Fewer than four to compare are all good.

    Where more than a quarter of them go with no other, none is called noisy for that.

    Args:
        data: ndarray, shape (n_channels, n_times), µV, without slow drifts.
        sfreq: Sampling rate, in Hz.
        used: ndarray, shape (n_channels,), bool: which are compared; flat and marked ones are not.
        deviation: Noisy where the robust z of the robust SD lies further from 0, in SD.
        correlation: A window counts against a channel where its correlation with others lies below.
        share: Noisy where more than this share of the windows counts against it.
        borders: First samples of new stretches; no window crosses one.
    """
    z, alone = (np.full(len(data), math.nan) for _ in range(2))
    rows = np.flatnonzero(used)
    if len(rows) >= MIN_CHANNELS:
        z[rows] = robust_z(np.array([robust_sd(data[row]) for row in rows]))
        nearest = nearest_correlations(data, sfreq, rows=rows, borders=borders)
        if nearest.shape[1]:
            alone[rows] = (nearest < correlation).mean(axis=1)
    apart = alone > share
    n_alone = int(apart.sum()) if apart.sum() > _MOST_ALONE * len(rows) else 0
    marks = ((DEVIATION, np.abs(z) > deviation), (CORRELATION, apart & (n_alone == 0)))
    reason = [", ".join(name for name, mask in marks if mask[row]) for row in range(len(data))]
    return Noise(z, alone, reason, n_alone)


def robust_sd(values: np.ndarray) -> float:
    """Return 0.7413 of the distance between the quartiles of values, shape (n,): of a normal distribution the SD."""
    # PREP's limits are meant in MATLAB's quantiles, which are Hazen's.
    low, high = np.quantile(values, (0.25, 0.75), method="hazen")
    return float(_SD_OF_IQR * (high - low))


def robust_z(values: np.ndarray) -> np.ndarray:
    """Return (values - median) / robust SD, shape (n,); zeros and infinities where most values are equal."""
    difference, spread = values - np.median(values), robust_sd(values)
    if spread == 0:
        return np.where(difference == 0, 0.0, np.copysign(np.inf, difference))
    return np.asarray(difference / spread)


def nearest_correlations(
    data: np.ndarray, sfreq: float, *, rows: np.ndarray | None = None, borders: Sequence[int] = ()
) -> np.ndarray:
    """Return how well each channel goes with others in each window of a second: the 0.98 quantile of |r| over them.

    A channel that does not vary in a window goes with none there.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        sfreq: Sampling rate, in Hz.
        rows: Of the channels that are compared; None: all.
        borders: First samples of new stretches; no window crosses one, and what is left at an end is in none.

    Returns:
        ndarray, shape (n_compared, n_windows).
    """
    rows = np.arange(len(data)) if rows is None else rows
    length = max(2, round(WINDOW_S * sfreq))
    edges = sorted({0, *borders, data.shape[1]})
    starts = [s for a, b in itertools.pairwise(edges) for s in range(a, b - length + 1, length)]
    nearest = np.zeros((len(rows), len(starts)))
    for first in range(0, len(starts), _TOGETHER):
        some = starts[first : first + _TOGETHER]
        r = np.stack([_correlations(data[rows, start : start + length]) for start in some])
        nearest[:, first : first + len(some)] = np.quantile(r, _NEAREST, axis=2, method="hazen").T
    return nearest


def _correlations(window: np.ndarray) -> np.ndarray:
    """Return |r| of each channel with each other, 0 with itself; ``window``, shape (n_channels, n), is used up."""
    window -= window.mean(axis=1, keepdims=True)
    size = np.sqrt(np.einsum("ij,ij->i", window, window))
    with np.errstate(divide="ignore"):
        window *= np.where(size > 0, 1 / size, 0.0)[:, None]
    r = np.abs(window @ window.T)
    np.fill_diagonal(r, 0.0)
    return r
