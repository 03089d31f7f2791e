"""Event-related potentials: baseline, averages and the times worth a map (paper §2.5.2)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def subtract_baseline(data: Floats, times: Floats, window_s: tuple[float, float], *, in_place: bool = False) -> Floats:
    """Return the epochs minus each trial's and channel's own mean within the window, both ends included.

    Args:
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times), µV.
        times: Time of each sample, ndarray, shape (n_times,), s.
        window_s: Start and end of the baseline, s.
        in_place: Whether to change ``data`` itself; a second copy of all epochs takes memory and time.

    Returns:
        ndarray, shape (n_epochs, n_channels, n_times), µV; ``data`` where it is changed itself.

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
    """Return the mean over the trials of each condition.

    Args:
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times), µV.
        masks: Which trials belong to which condition, ndarray, shape (n_conditions, n_epochs).

    Returns:
        ndarray, shape (n_conditions, n_channels, n_times), µV.

    Raises:
        ValueError: A condition has no trial.
    """
    counts = masks.sum(axis=1)
    if (counts == 0).any():
        raise ValueError(f"conditions {np.flatnonzero(counts == 0).tolist()} have no trial")
    sums = masks.astype(float) @ data.reshape(len(data), -1)
    return sums.reshape(-1, *data.shape[1:]) / counts[:, None, None]


def standard_errors(data: Floats, masks: NDArray[np.bool_], means: Floats) -> Floats:
    """Return the standard error of each mean that :func:`averages` gave; NaN where a condition has one trial.

    Args:
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times), µV.
        masks: Which trials belong to which condition, ndarray, shape (n_conditions, n_epochs).
        means: The averages, ndarray, shape (n_conditions, n_channels, n_times), µV.

    Returns:
        ndarray, shape (n_conditions, n_channels, n_times), µV.
    """
    members, counts = masks.astype(float), masks.sum(axis=1)[:, None]
    errors = np.empty(means.shape)
    # A channel at a time: squares of all epochs at once would be a second copy of them.
    for channel, error in enumerate(errors.swapaxes(0, 1)):
        # Squares of what is nearly centred lose no digits when the mean's square is taken from them.
        centre = data[:, channel].mean(axis=0)
        squares = np.square(data[:, channel] - centre)
        spread = members @ squares - counts * np.square(means[:, channel] - centre)
        with np.errstate(divide="ignore", invalid="ignore"):
            error[:] = np.where(counts > 1, np.sqrt(spread.clip(min=0) / (counts * (counts - 1))), np.nan)
    return errors


def standard_error(data: Floats) -> Floats:
    """Return the standard error of the mean over the first axis; NaN where there is only one row."""
    if len(data) < 2:
        return np.full(data.shape[1:], np.nan)
    error: Floats = data.std(axis=0, ddof=1) / np.sqrt(len(data))
    return error


def half_interval(error: Floats, freedom: Floats | float, *, confidence: float) -> Floats:
    """Return how far a mean's confidence interval reaches to either side: Student's t times its standard error."""
    from scipy.special import stdtrit

    half: Floats = stdtrit(freedom, (1 + confidence) / 2) * error
    return half


def difference_interval(errors: tuple[Floats, Floats], counts: tuple[int, int], *, confidence: float) -> Floats:
    """Return half the confidence interval of the difference between two means, ndarray, shape (n_times,).

    Their variances need not be equal (Welch 1947, doi:10.1093/biomet/34.1-2.28). NaN where a set has only one trial.

    Args:
        errors: Standard error of each mean, ndarray, shape (n_times,).
        counts: Trials of each.
        confidence: Level of the interval.
    """
    if min(counts) < 2:
        return np.full(errors[0].shape, np.nan)
    parts = [error**2 for error in errors]
    total = parts[0] + parts[1]
    weight = parts[0] ** 2 / (counts[0] - 1) + parts[1] ** 2 / (counts[1] - 1)
    freedom = np.divide(total**2, weight, out=np.ones_like(total), where=weight > 0)
    return half_interval(np.sqrt(total), freedom, confidence=confidence)


def within(times: Floats, start: float, stop: float) -> NDArray[np.bool_]:
    """Return which samples lie in the closed interval, forgiving rounding of the time axis, shape (n_times,)."""
    slack = 1e-6
    inside: NDArray[np.bool_] = (times >= start - slack) & (times <= stop + slack)
    return inside


def farthest_from_zero(values: NDArray[np.floating[Any]]) -> tuple[int, ...]:
    """Return the index of the value that is largest without its sign; of equals, of the first."""
    return tuple(int(i) for i in np.unravel_index(int(np.argmax(np.abs(values))), values.shape))


def peak_times(strength: Floats, times: Floats, *, start: float, stop: float, count: int, apart: float) -> list[float]:
    """Return the times of the highest local maxima within an interval, in order of time.

    Args:
        strength: Such as the SD over channels, ndarray, shape (n_times,).
        times: Time of each sample, ndarray, shape (n_times,), s.
        start, stop: The interval, s.
        count: How many times at most; at least one is returned, the highest sample, if there is no local maximum.
        apart: Smallest distance between two of them, s.
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
