"""Event-related potentials: baseline, averages and the times worth a map (paper §2.5.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def subtract_baseline(data: Floats, times: Floats, window_s: tuple[float, float], *, in_place: bool = False) -> Floats:
    """Return the epochs minus each trial's and channel's own mean within the window, both ends included.

    Args:
        data: Epochs, shape (trials, channels, samples).
        times: Time of each sample, in seconds.
        window_s: Start and end of the baseline, in seconds.
        in_place: Whether to change ``data`` itself; a second copy of all epochs takes memory and time.

    Raises:
        ValueError: No sample lies in the window.
    """
    inside = within(times, *window_s)
    if not inside.any():
        raise ValueError(
            f"the baseline {window_s[0]:g}…{window_s[1]:g} s holds no sample of epochs {times[0]:g}…{times[-1]:g} s"
        )
    first, last = np.flatnonzero(inside)[[0, -1]]
    level = data[..., first : last + 1].mean(axis=-1, keepdims=True)
    corrected: Floats = np.subtract(data, level, out=data if in_place else None)
    return corrected


def averages(data: Floats, masks: NDArray[np.bool_]) -> Floats:
    """Return the mean over the trials of each condition, shape (conditions, channels, samples).

    Args:
        data: Epochs, shape (trials, channels, samples).
        masks: Which trials belong to which condition, shape (conditions, trials).

    Raises:
        ValueError: A condition has no trial.
    """
    counts = masks.sum(axis=1)
    if (counts == 0).any():
        raise ValueError(f"conditions {np.flatnonzero(counts == 0).tolist()} have no trial")
    sums = masks.astype(float) @ data.reshape(len(data), -1)
    return sums.reshape(-1, *data.shape[1:]) / counts[:, None, None]


def standard_error(data: Floats) -> Floats:
    """Return the standard error of the mean over the first axis; zeros where there is only one row."""
    if len(data) < 2:
        return np.zeros(data.shape[1:])
    error: Floats = data.std(axis=0, ddof=1) / np.sqrt(len(data))
    return error


def half_interval(error: Floats, freedom: Floats | float, *, confidence: float) -> Floats:
    """Return how far a mean's confidence interval reaches to either side: Student's t times its standard error."""
    from scipy.special import stdtrit

    half: Floats = stdtrit(freedom, (1 + confidence) / 2) * error
    return half


def difference_interval(first: Floats, second: Floats, *, confidence: float) -> Floats:
    """Return half the confidence interval of the difference between the means of two sets of trials, shape (samples,).

    Their variances need not be equal (Welch 1947, doi:10.1093/biomet/34.1-2.28). Zeros where a set has only one trial.

    Args:
        first, second: One channel's trials, shape (trials, samples).
        confidence: Level of the interval.
    """
    if min(len(first), len(second)) < 2:
        return np.zeros(first.shape[1:])
    parts = [standard_error(data) ** 2 for data in (first, second)]
    total = parts[0] + parts[1]
    weight = parts[0] ** 2 / (len(first) - 1) + parts[1] ** 2 / (len(second) - 1)
    freedom = np.divide(total**2, weight, out=np.ones_like(total), where=weight > 0)
    return half_interval(np.sqrt(total), freedom, confidence=confidence)


def within(times: Floats, start: float, stop: float) -> NDArray[np.bool_]:
    """Return which samples lie in the closed interval, forgiving rounding of the time axis."""
    slack = 1e-6
    inside: NDArray[np.bool_] = (times >= start - slack) & (times <= stop + slack)
    return inside


def peak_times(strength: Floats, times: Floats, *, start: float, stop: float, count: int, apart: float) -> list[float]:
    """Return the times of the highest local maxima within an interval, in order of time.

    Args:
        strength: One value a sample, such as the SD over channels.
        times: Time of each sample, in seconds.
        start, stop: The interval, in seconds.
        count: How many times at most; at least one is returned, the highest sample, if there is no local maximum.
        apart: Smallest distance between two of them, in seconds.
    """
    inside = np.flatnonzero(within(times, start, stop))
    if not len(inside):
        inside = np.arange(len(times))
    values = strength[inside]
    edged = np.concatenate([[np.inf], values, [np.inf]])
    peaks = np.flatnonzero((edged[:-2] < values) & (values >= edged[2:]))
    if not len(peaks):
        peaks = np.array([np.argmax(values)])
    chosen: list[float] = []
    for i in peaks[np.argsort(-values[peaks], kind="stable")]:
        time = float(times[inside[i]])
        if len(chosen) < count and all(abs(time - other) >= apart for other in chosen):
            chosen.append(time)
    return sorted(chosen)
