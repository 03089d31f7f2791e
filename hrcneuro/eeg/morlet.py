"""Complex Morlet wavelets as Cohen writes them, and the magnitude of their convolution with epochs (paper §2.5.3).

This is the plain reading of the recipe; :mod:`hrcneuro.eeg.morlet_means` gives the same condition means, faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Wavelets:
    """A family of wavelets at one sampling rate.

    Args:
        frequencies: Centre frequencies in Hz.
        cycles: Number of cycles of each wavelet; the Gaussian's SD is ``cycles / (2π frequency)`` seconds.
        sfreq: Sampling rate in Hz.
        length_s: Length of the kernels; they reach from ``-length_s / 2`` to ``length_s / 2``.

    Raises:
        ValueError: Lengths differ, or a frequency lies outside 0 Hz … Nyquist.
    """

    frequencies: tuple[float, ...]
    cycles: tuple[float, ...]
    sfreq: float
    length_s: float = 1.0

    def __post_init__(self) -> None:
        if len(self.frequencies) != len(self.cycles) or not self.frequencies:
            raise ValueError(f"{len(self.frequencies)} frequencies but {len(self.cycles)} numbers of cycles")
        low, high = min(self.frequencies), max(self.frequencies)
        if not 0 < low <= high < self.sfreq / 2:
            raise ValueError(
                f"wavelets at {low:g}…{high:g} Hz; at {self.sfreq:g} Hz they must lie in 0…{self.sfreq / 2:g}"
            )
        if min(self.cycles) <= 0 or self.length_s <= 0:
            raise ValueError(f"cycles {min(self.cycles):g} and length {self.length_s:g} s must be positive")

    @property
    def half(self) -> int:
        """Samples on each side of a kernel's centre."""
        # A centre sample must exist at any rate; Cohen's -0.5:1/fs:0.5 has one only where fs is even.
        return int(self.sfreq * self.length_s / 2)

    @property
    def kernels(self) -> NDArray[np.complex128]:
        """The kernels, shape (n_frequencies, 2 half + 1): complex sine times Gaussian, 1 at the centre.

        M. X. Cohen, Analyzing Neural Time Series Data (MIT Press 2014), ch. 12-13; design of s from paper §2.5.3.
        """
        frequency = np.array(self.frequencies)[:, None]
        sd = np.array(self.cycles)[:, None] / (2 * np.pi * frequency)
        t = np.arange(-self.half, self.half + 1) / self.sfreq
        return np.exp(2j * np.pi * frequency * t) * np.exp(-(t**2) / (2 * sd**2))

    def peaks(self, n_times: int) -> NDArray[np.float64]:
        """Return each spectrum's maximum on the grid of the convolution with ``n_times`` samples: Cohen's unit gain."""
        peak: NDArray[np.float64] = np.abs(np.fft.fft(self.kernels, n_times + 2 * self.half)).max(axis=-1)
        return peak


def linear_cycles(frequencies: tuple[float, ...], *, first: float, last: float) -> tuple[float, ...]:
    """Return a number of cycles a frequency, rising in equal steps from ``first`` to ``last``."""
    return tuple(float(c) for c in np.linspace(first, last, len(frequencies)))


def magnitudes(data: NDArray[np.floating], wavelets: Wavelets, *, step: int = 1) -> NDArray[np.float64]:
    """Return twice the magnitude of each epoch's convolution with each wavelet, so that a sine gives its amplitude.

    Each epoch is padded with zeros by itself, nothing is subtracted, and every ``step``-th sample is kept.

    Args:
        data: Epochs, ndarray, shape (..., n_times).

    Returns:
        ndarray, shape (..., n_frequencies, ceil(n_times / step)), in the unit of ``data``.
    """
    n_times, half = data.shape[-1], wavelets.half
    length = n_times + 2 * half
    spectrum = np.fft.fft(wavelets.kernels, length) / wavelets.peaks(n_times)[:, None]
    wave = np.fft.ifft(np.fft.fft(data, length)[..., None, :] * spectrum)
    kept: NDArray[np.float64] = 2 * np.abs(wave[..., half : half + n_times : step])
    return kept


def mean_magnitudes(
    data: NDArray[np.floating], masks: NDArray[np.bool_], wavelets: Wavelets, *, step: int = 1
) -> NDArray[np.float64]:
    """Return the mean of :func:`magnitudes` over the trials of each condition, one trial in memory at a time.

    Args:
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times).
        masks: Which trials belong to which condition, ndarray, shape (n_conditions, n_epochs); a trial may belong to
            several.

    Returns:
        ndarray, shape (n_conditions, n_channels, n_frequencies, ceil(n_times / step)), in the unit of ``data``.

    Raises:
        ValueError: A condition has no trial.
    """
    counts = trial_counts(data, masks)
    total = np.zeros((len(masks), data.shape[1], len(wavelets.frequencies), -(-data.shape[2] // step)))
    for trial, members in zip(data, masks.T, strict=True):
        if members.any():
            total[members] += magnitudes(trial, wavelets, step=step)
    return total / counts[:, None, None, None]


def trial_counts(data: NDArray[np.floating], masks: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the number of trials a condition, ndarray, shape (n_conditions,).

    Raises:
        ValueError: The shapes do not fit, or a condition has no trial.
    """
    if data.ndim != 3 or masks.ndim != 2 or masks.shape[1] != len(data):
        raise ValueError(f"data {data.shape} must be (trials, channels, samples) and masks {masks.shape} (…, trials)")
    counts: NDArray[np.intp] = masks.sum(axis=1)
    if (counts == 0).any():
        raise ValueError(f"conditions {np.flatnonzero(counts == 0).tolist()} have no trial")
    return counts
