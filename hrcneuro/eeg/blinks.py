"""Blinks of a recording: when they come, and their mean in other channels, which tells what cleaning left of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

AROUND_S = 0.5
"""So much of a blink is averaged on either side of its peak, in seconds."""

_BLINK_UV = 60.0
_BLINK_HZ = (1.0, 10.0)
_REFRACTORY_S = 0.5


def blink_peaks(eog: Floats, sfreq: float) -> Floats:
    """Return the times of the blinks' peaks in seconds from the first sample, shape (n_blinks,).

    A blink stands out of the channel nearest the lids, the one with the heaviest tail between 1 and 10 Hz: it exceeds
    60 µV and 2.5 standard deviations there.

    Args:
        eog: ndarray, shape (n_eog, n_times), µV.
        sfreq: Sampling rate, in Hz.
    """
    from scipy.signal import butter, find_peaks, sosfiltfilt

    slow = sosfiltfilt(butter(2, _BLINK_HZ, "bandpass", fs=sfreq, output="sos"), eog, axis=1)
    tail = ((slow / slow.std(axis=1, keepdims=True)) ** 4).mean(axis=1)
    lid = slow[int(tail.argmax())]
    lid = lid * np.sign((lid**3).mean())
    peaks, _ = find_peaks(lid, height=max(_BLINK_UV, 2.5 * lid.std()), distance=int(_REFRACTORY_S * sfreq))
    return peaks / sfreq


def mean_blink(data: Floats, sfreq: float, peaks_s: Floats) -> Floats:
    """Return the mean over channels and blinks, half a second on either side of the peak, from its first eighth.

    Args:
        data: ndarray, shape (n_channels, n_times), µV.
        sfreq: Sampling rate, in Hz.
        peaks_s: ndarray, shape (n_blinks,), s.

    Returns:
        ndarray, shape (n_times,), µV; two zeros where every blink lies too near an end.
    """
    half = int(AROUND_S * sfreq)
    signal = data.mean(axis=0)
    cuts = [signal[i - half : i + half] for i in (peaks_s * sfreq).astype(int) if half <= i < len(signal) - half]
    if not cuts:
        return np.zeros(2)
    mean = np.mean(cuts, axis=0)
    return np.asarray(mean - mean[: half // 4].mean())
