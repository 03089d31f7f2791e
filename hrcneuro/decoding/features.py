"""Features of single trials: means of each channel in 15 time windows (paper 2.5.4)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.decoding.recipes import FEATURES, N_STEPS
from hrcneuro.decoding.refusals import (
    EmptyWindowError,
    NoSignalError,
    NotFiniteTrialsError,
    VoltsError,
    WindowOutsideError,
)
from hrcneuro.decoding.scheme import MEAN_WINDOW_S

Span = tuple[float, float]

# The only even tiling of the printed spans with the printed numbers (paper 2.5.4): four windows of 50 ms
# side by side in 400-600 ms, then eleven of 100 ms, each half over the next, in 0-600 ms.
FINE_S: tuple[Span, ...] = tuple(((400 + 50 * i) / 1000, (450 + 50 * i) / 1000) for i in range(4))
COARSE_S: tuple[Span, ...] = tuple((50 * i / 1000, (50 * i + 100) / 1000) for i in range(11))
WINDOWS_S = FINE_S + COARSE_S
# For covariances that assume stationary steps: equal windows side by side.
STEPS_S: tuple[Span, ...] = tuple((50 * i / 1000, (50 * i + 50) / 1000) for i in range(N_STEPS))
# For spatial filters: steps of about 1/64 s.
FINEST_S: tuple[Span, ...] = tuple(itertools.pairwise(np.linspace(0.0, 0.6, 39).tolist()))
BANDS_SPAN_S: Span = (0.0, 0.6)
BANDS_HZ: dict[str, Span] = {"theta": (4.0, 7.5), "alpha": (7.5, 13.0), "beta": (13.0, 30.0)}
ONLINE_MEAN_S: Span = (0.0, 0.6)

# Scalp EEG in microvolt has a spread of some ten; the same numbers in volts are a million times smaller.
_SMALLEST_SPREAD_UV = 1e-2
_SLACK_S = 1e-6


def window_means(
    epochs_uv: np.ndarray,
    times_s: np.ndarray,
    *,
    windows_s: Sequence[Span] = WINDOWS_S,
    mean_window_s: Span = MEAN_WINDOW_S,
) -> np.ndarray:
    """Return the features of each trial: ndarray, shape (n_trials, n_channels × n_windows), µV (paper 2.5.4).

    The mean of each channel over ``mean_window_s`` is removed first. Every window is half open, [start, end), so that
    neighbours share no sample. Order: all windows of the first channel (in the order of ``windows_s``), then of the
    second, and so on; ``features.reshape(n_trials, n_channels, n_windows)`` takes it apart.

    Args:
        epochs_uv: ndarray, shape (n_trials, n_channels, n_times), µV.
        times_s: ndarray, shape (n_times,), s from the onset of the movement; any sampling rate.
        windows_s: Start and end of each window.
        mean_window_s: The window whose mean is removed (offline 0-0.8 s, online 0-0.6 s).

    Raises:
        WindowOutsideError, EmptyWindowError: A window reaches past the epoch, or holds no sample.
        NotFiniteTrialsError, NoSignalError, VoltsError: The data are not finite, all alike, or not in microvolt.
    """
    weights = window_weights(times_s, windows_s=windows_s, mean_window_s=mean_window_s)
    check_epochs(epochs_uv)
    return (epochs_uv @ weights.T).reshape(len(epochs_uv), -1)


def extract(
    kind: str,
    epochs_uv: np.ndarray,
    times_s: np.ndarray,
    *,
    mean_window_s: Span = MEAN_WINDOW_S,
    windows_s: Sequence[Span] = (),
) -> np.ndarray:
    """Return the features that a recipe names: ndarray, shape (n_trials, n_features).

    ``windows``: the study's, :func:`window_means`. ``windows_600``: the same with the 0-600 ms mean removed. ``steps``:
    twelve windows of 50 ms in 0-600 ms. ``windows_bands``: the study's and :func:`band_power`. ``epochs``: ndarray,
    shape (n_trials, n_channels, n_steps), averages over about 1/64 s in 0-600 ms. ``windows_s`` stands in the
    place of the study's windows.

    Raises:
        ValueError: The features are not known, or as :func:`window_means`.
    """
    windows_s = windows_s or WINDOWS_S
    if kind == "windows_600":
        return window_means(epochs_uv, times_s, windows_s=windows_s, mean_window_s=ONLINE_MEAN_S)
    if kind == "steps":
        return window_means(epochs_uv, times_s, windows_s=STEPS_S, mean_window_s=mean_window_s)
    means = window_means(epochs_uv, times_s, windows_s=windows_s, mean_window_s=mean_window_s)
    if kind == "windows":
        return means
    if kind == "windows_bands":
        return np.hstack([means, band_power(epochs_uv, times_s)])
    if kind == "epochs":
        steps = window_means(epochs_uv, times_s, windows_s=FINEST_S, mean_window_s=mean_window_s)
        return steps.reshape(len(epochs_uv), epochs_uv.shape[1], -1)
    raise ValueError(f"features {kind!r} are not known; allowed: {', '.join(FEATURES)}")


@dataclass(frozen=True)
class Feature:
    """What one number of a channel is: the mean, or the power of a band, over a span of time from the onset."""

    measure: str
    unit: str
    span_s: Span


def layout(kind: str, windows_s: Sequence[Span] = ()) -> list[list[Feature]]:
    """Return what the features are that a recipe names, a list a block.

    A vector of features holds block after block, and in each block all features of the first channel, then all of the
    second, and so on.

    Raises:
        ValueError: The features are not known.
    """
    if kind not in FEATURES:
        raise ValueError(f"features {kind!r} are not known; allowed: {', '.join(FEATURES)}")
    spans = {"steps": STEPS_S, "epochs": FINEST_S}.get(kind, tuple(windows_s) or WINDOWS_S)
    blocks = [[Feature("mean", "µV", span) for span in spans]]
    if kind == "windows_bands":
        blocks.append([Feature(band, "dB", BANDS_SPAN_S) for band in BANDS_HZ])
    return blocks


def band_power(epochs_uv: np.ndarray, times_s: np.ndarray, *, span_s: Span = BANDS_SPAN_S) -> np.ndarray:
    """Return the power in theta, alpha and beta: ndarray, shape (n_trials, n_channels × 3), dB (µV²).

    Hann-tapered periodogram of ``span_s`` after removing its mean, zero-padded to 1 Hz bins, averaged over each band.
    In dB the features have a spread of a few units, like the means in microvolt, so that one λ suits both.

    Raises:
        WindowOutsideError: The span reaches past the epoch.
    """
    inside = _mean_weights(times_s, span_s) > 0
    sfreq = 1 / (times_s[1] - times_s[0])
    piece = epochs_uv[:, :, inside]
    taper = np.hanning(piece.shape[2] + 2)[1:-1]
    n_fft = max(round(sfreq), piece.shape[2])
    spectrum = np.fft.rfft((piece - piece.mean(axis=2, keepdims=True)) * taper, n_fft, axis=2)
    power = np.abs(spectrum) ** 2 / (taper**2).sum()
    freqs = np.fft.rfftfreq(n_fft, 1 / sfreq)
    bands = [power[:, :, (freqs >= low) & (freqs < high)].mean(axis=2) for low, high in BANDS_HZ.values()]
    # A channel without any power (interpolated from silence) must not give -inf.
    return 10 * np.log10(np.stack(bands, axis=2) + 1e-6).reshape(len(epochs_uv), -1)


def window_weights(times_s: np.ndarray, *, windows_s: Sequence[Span], mean_window_s: Span) -> np.ndarray:
    """Return the weights of each sample in each feature: ndarray, shape (n_windows, n_times); each row sums to zero.

    Raises:
        WindowOutsideError, EmptyWindowError: A window reaches past the epoch, or holds no sample.
    """
    reference = _mean_weights(times_s, mean_window_s)
    return np.stack([_mean_weights(times_s, span) - reference for span in windows_s])


def check_epochs(epochs_uv: np.ndarray) -> None:
    """Refuse epochs that hold NaN or infinite samples, no signal at all, or volts.

    Raises:
        NotFiniteTrialsError: With the first trial and channel concerned.
        NoSignalError, VoltsError: With the value of all samples, or with their spread.
    """
    if not epochs_uv.size:
        return
    # A sum is finite only where all its terms are: one pass, no mask of the size of the data.
    with np.errstate(invalid="ignore"):
        bad = np.argwhere(~np.isfinite(epochs_uv.sum(axis=2)))
    if len(bad):
        raise NotFiniteTrialsError(
            f"{len(np.unique(bad[:, 0]))} of {len(epochs_uv)} trials hold samples that are not finite, the first in "
            f"trial {bad[0, 0]}, EEG channel {bad[0, 1]} (both counted from 0)"
        )
    sample = epochs_uv[:50]
    deviations = np.abs(sample - np.median(sample))
    # Samples that do not deviate, as those of flat channels, tell nothing of the unit.
    deviations = deviations[deviations > 0]
    if not deviations.size:
        raise NoSignalError(f"the epochs hold no signal: every sample is {sample.flat[0]:g}")
    spread = float(np.median(deviations))
    if spread < _SMALLEST_SPREAD_UV:
        raise VoltsError(
            f"the epochs' median deviation is {spread:.3g}; in microvolt it is above {_SMALLEST_SPREAD_UV:g}"
        )


def _mean_weights(times_s: np.ndarray, span: Span) -> np.ndarray:
    start, end = span
    step = times_s[1] - times_s[0] if len(times_s) > 1 else 0.0
    if times_s[0] > start + _SLACK_S or times_s[-1] + step < end - _SLACK_S:
        raise WindowOutsideError(
            f"the window {start:g}-{end:g} s reaches past the epoch, {times_s[0]:g}-{times_s[-1]:g} s"
        )
    inside = (times_s >= start - _SLACK_S) & (times_s < end - _SLACK_S)
    if not inside.any():
        raise EmptyWindowError(f"the window {start:g}-{end:g} s holds no sample at {1 / step:g} Hz")
    return inside / inside.sum()
