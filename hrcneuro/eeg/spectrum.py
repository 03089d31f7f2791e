"""How much power a recording has at each frequency, channel by channel."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BAND_HZ = (0.5, 60.0)
WINDOW_S = 2.0
MOST = 600
"""So many windows of a long recording, evenly spread, tell its spectrum: ten minutes of half overlapping ones."""

_TOGETHER = 32  # windows transformed in one call: they fit the cache


def power_spectra(data: Floats, sfreq: float, *, borders: Sequence[int] = ()) -> tuple[Floats, Floats]:
    """Return frequencies from 0.5 to 60 Hz and each channel's power there, by Welch's method (1967).

    Windows of two seconds (Hann, each less its mean) lie half over each other; none reaches across a break. Of a
    recording with more than :data:`MOST` of them, that many are taken, evenly spread. Where every stretch is shorter
    than a window, the longest stretch is the window. doi:10.1109/TAU.1967.1161901

    Args:
        data: ndarray, shape (n_channels, n_times), µV.
        sfreq: Sampling rate, Hz.
        borders: First samples of new stretches.

    Returns:
        Frequencies, ndarray, shape (n_freqs,), Hz, and power, ndarray, shape (n_channels, n_freqs), µV²/Hz.
    """
    from scipy.fft import rfft, rfftfreq

    starts, length = _windows(data.shape[1], int(WINDOW_S * sfreq), borders)
    # scipy.signal, which has this window, takes longer to import than the spectra take.
    taper = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length) if length > 1 else np.ones(1)
    hz = rfftfreq(length, 1 / sfreq)
    kept = np.flatnonzero((hz >= BAND_HZ[0]) & (hz <= BAND_HZ[1]))
    power = np.empty((len(data), len(kept)))
    each = np.empty((len(kept), len(starts)))
    for channel, own in zip(data, power, strict=True):
        windows = np.lib.stride_tricks.sliding_window_view(channel, length)
        for first in range(0, len(starts), _TOGETHER):
            pieces = windows[starts[first : first + _TOGETHER]]
            pieces -= pieces.mean(axis=1, keepdims=True)
            pieces *= taper
            spectrum = rfft(pieces, axis=1, overwrite_x=True)[:, kept]
            each[:, first : first + _TOGETHER] = (spectrum.real**2 + spectrum.imag**2).T
        own[:] = each.mean(axis=1)
    # Half of the power lies at negative frequencies, but not at 0 and half the rate.
    both = np.where((kept > 0) & (2 * kept != length), 2.0, 1.0)
    return hz[kept], power * both / (sfreq * (taper @ taper))


def _windows(n_times: int, length: int, borders: Sequence[int]) -> tuple[NDArray[np.intp], int]:
    """Return the windows' first samples, and their length."""
    stretches = list(pairwise([0, *(b for b in borders if 0 < b < n_times), n_times]))
    length = max(1, min(length, max(stop - start for start, stop in stretches)))
    step = length - length // 2
    starts = np.concatenate([np.arange(start, stop - length + 1, step) for start, stop in stretches])
    if len(starts) > MOST:
        starts = starts[np.linspace(0, len(starts) - 1, MOST).round().astype(int)]
    return starts, length
