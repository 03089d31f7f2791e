"""How channels look at a glance, while they are recorded: size, noise of the mains, flat or railed."""

from __future__ import annotations

import numpy as np

FLAT, RAILED = "flat", "railed"


def rms(data: np.ndarray) -> np.ndarray:
    """Return the root mean square about the mean of each channel.

    Args:
        data: ndarray, shape (n_channels, n_times), µV.

    Returns:
        ndarray, shape (n_channels,), µV.
    """
    return np.asarray(data, float).std(axis=1)


def line_noise(data: np.ndarray, sfreq: float, line_hz: float) -> np.ndarray:
    """Return the RMS of each channel at the frequency of the mains, within half a hertz or what the length allows.

    Args:
        data: ndarray, shape (n_channels, n_times), µV.
        sfreq: Sampling rate, Hz.
        line_hz: Frequency of the mains, Hz.

    Returns:
        ndarray, shape (n_channels,), µV; zeros where the rate is too low to see it.
    """
    data = np.asarray(data, float)
    n = data.shape[1]
    if n < 2 or line_hz >= sfreq / 2:
        return np.zeros(len(data))
    window = np.hanning(n)
    spectrum = np.fft.rfft((data - data.mean(axis=1, keepdims=True)) * window, axis=1)
    power = 2 * np.abs(spectrum) ** 2 / (n * (window**2).sum())
    frequencies = np.fft.rfftfreq(n, 1 / sfreq)
    near = np.abs(frequencies - line_hz) <= max(0.5, 2 * sfreq / n)
    return np.asarray(np.sqrt(power[:, near].sum(axis=1)))


def states(data: np.ndarray, *, flat_uv: float, rail_uv: float) -> list[str]:
    """Return ``flat``, ``railed`` or an empty string for each channel.

    Args:
        data: ndarray, shape (n_channels, n_times), µV.
        flat_uv: Flat is what varies by a smaller SD, µV.
        rail_uv: Railed is what reaches this, µV; 0 for no such bound.
    """
    data = np.asarray(data, float)
    with np.errstate(invalid="ignore"):
        flat, most = ~(data.std(axis=1) >= flat_uv), np.abs(data).max(axis=1, initial=0.0)
    railed = most >= rail_uv if rail_uv else np.zeros(len(data), bool)
    return [RAILED if high else FLAT if still else "" for high, still in zip(railed, flat, strict=True)]
