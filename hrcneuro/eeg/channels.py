"""Contaminated channels: EEGLAB's normalised kurtosis; and the common average reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrcneuro.eeg.refusals import NotFiniteError

# A channel whose SD after the filter lies below this, in microvolt, carries no signal: its kurtosis would be that of
# rounding errors.
FLAT_UV = 1e-6
# Trimming and a standard deviation need a few channels to compare with.
MIN_CHANNELS = 4
_TRIM = 0.1
_SLAB = 1 << 18


@dataclass(frozen=True)
class Verdict:
    """What the kurtosis step says of each channel.

    Attributes:
        kurtosis: ndarray, shape (n_channels,), of a normal distribution 3; NaN where flat.
        z: ndarray, shape (n_channels,), SD: see :func:`trimmed_z`; NaN where flat or marked.
        flat: ndarray, shape (n_channels,), bool: carries no signal.
        bad: ndarray, shape (n_channels,), bool: flat, marked, or too far from the mean.
    """

    kurtosis: np.ndarray
    z: np.ndarray
    flat: np.ndarray
    bad: np.ndarray


def check_finite(data: np.ndarray, names: list[str], sfreq: float) -> None:
    """Refuse samples that are no numbers.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        names: The channels.
        sfreq: Sampling rate, in Hz.

    Raises:
        NotFiniteError: Names the first such channel, its first such sample and their share.
    """
    for name, channel in zip(names, data, strict=True):
        # The sum is finite only if all samples are (or overflow, which is no EEG either): one fast pass.
        if np.isfinite(channel.sum()):
            continue
        broken = ~np.isfinite(channel)
        first = int(np.argmax(broken))
        raise NotFiniteError(
            f"channel {name} has samples that are no finite numbers: {broken.mean():.2%} of them, the first at "
            f"sample {first} ({first / sfreq:.3f} s)",
            channel=name,
        )


def kurtosis(channel: np.ndarray) -> float:
    """Return m4 / m2² of one channel, shape (n_times,): a normal distribution gives 3, what does not vary NaN."""
    return _moments(channel)[1]


def _moments(channel: np.ndarray) -> tuple[float, float]:
    """Return the SD (over n) and the kurtosis of one channel, in slabs to spare memory."""
    mean = channel.mean()
    second = fourth = 0.0
    for start in range(0, len(channel), _SLAB):
        square = channel[start : start + _SLAB] - mean
        square *= square
        second += float(square.sum())
        fourth += float(square @ square)
    return math.sqrt(second / len(channel)), fourth * len(channel) / second**2 if second else math.nan


def trimmed_z(values: np.ndarray) -> np.ndarray:
    """Return (values - mean) / SD, both over the ranks that EEGLAB's normalisation keeps (``rejkurt``, §2.3.3).

    Of N sorted values these are the ranks max(round(0.1 N), 1) … N - round(0.1 N), counted from 1; the SD has N - 1 in
    its denominator. Without the trimming one bad channel hides the others. Equal values give zeros.

    Args:
        values: ndarray, shape (n_channels,).

    Returns:
        ndarray, shape (n_channels,).
    """
    n = len(values)
    cut = math.floor(_TRIM * n + 0.5)
    kept = np.sort(values)[max(cut, 1) - 1 : n - cut]
    spread = kept.std(ddof=1) if len(kept) > 1 else 0.0
    difference = values - kept.mean()
    if spread == 0:
        return np.where(difference == 0, 0.0, np.copysign(np.inf, difference))
    return difference / spread


def judge(data: np.ndarray, threshold: float, *, marked: np.ndarray | None = None) -> Verdict:
    """Return which channels kurtosis calls contaminated: |z| above ``threshold`` standard deviations.

    Flat channels are bad without a z; they, and channels marked bad beforehand, stay out of the mean and SD. Fewer than
    four channels to compare are all good.

    Args:
        data: ndarray, shape (n_channels, n_times), µV.
        threshold: In SD.
        marked: ndarray, shape (n_channels,), bool: bad beforehand; None for none.
    """
    spread, kurtoses = np.array([_moments(channel) for channel in data]).T
    flat = spread < FLAT_UV
    kurtoses[flat] = math.nan
    marked = np.zeros(len(data), bool) if marked is None else marked
    z = np.full(len(data), math.nan)
    used = ~(flat | marked)
    if used.sum() >= MIN_CHANNELS:
        z[used] = trimmed_z(kurtoses[used])
    else:
        z[used] = 0.0
    return Verdict(kurtoses, z, flat, flat | marked | (np.abs(z) > threshold))


def average_reference(data: np.ndarray) -> np.ndarray:
    """Subtract the mean over channels from every sample, in place, slab by slab.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.

    Returns:
        ``data``.
    """
    for start in range(0, data.shape[1], _SLAB):
        slab = data[:, start : start + _SLAB]
        slab -= slab.mean(axis=0)
    return data
