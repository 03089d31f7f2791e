"""Where a voltage rises that is either low or high, such as a photodiode's: whatever its baseline and its noise do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_BASE_S = 10.0  # the baseline is looked at so often; a light that stays on for as long becomes part of it
_BASE, _HIGH = 5.0, 99.9  # percentiles: what is low most of the time, and high now and then
_UP, _DOWN = 0.5, 0.25  # shares of the range: it has risen at the one, and may rise again once it was below the other
_OUT_OF_NOISE = 6.0  # so many SD of the noise a range has, else there is nothing but noise
_MAD = 1.4826  # median absolute deviation -> SD, of a normal distribution


def rising(values: np.ndarray, sfreq: float, starts: Sequence[int] = ()) -> np.ndarray:
    """Return the samples at which a channel has risen to half its range, shape (n_edges,), int.

    The baseline, which may drift, is taken off; a peak of a single sample is none, and noise about the threshold makes
    one edge, not many. What is high where a segment begins has risen before it, and is no edge.

    Args:
        values: ndarray, shape (n_times,), of any unit.
        sfreq: Sampling rate, Hz.
        starts: First samples of segments before which others are missing.
    """
    known = np.isfinite(values)
    if len(values) < 3 or not known.any():
        return np.zeros(0, int)
    level = _without_peaks(np.where(known, values, np.median(values[known])))
    level = level - _baseline(level, max(3, round(_BASE_S * sfreq)))
    high = float(np.percentile(level, _HIGH))
    steps = np.diff(values[known])
    noise = _MAD * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2)
    if high <= _OUT_OF_NOISE * noise:
        return np.zeros(0, int)
    # 1 where it is high, -1 where it is low, 0 between: there it is what it was last.
    state = np.where(level > _UP * high, 1, np.where(level < _DOWN * high, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), 0))
    up = state[last] > 0
    edges = np.flatnonzero(up[1:] & ~up[:-1]) + 1
    return np.asarray(edges[~np.isin(edges, np.asarray([0, *starts], int))])


def _without_peaks(values: np.ndarray) -> np.ndarray:
    """Return the median of each sample and its two neighbours: an edge stays where it is, a peak of one sample goes."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 3), axis=-1))


def _baseline(values: np.ndarray, length: int) -> np.ndarray:
    """Return what is low about each sample: of each stretch the low percentile, with straight lines between."""
    pieces = np.array_split(np.arange(len(values)), max(1, len(values) // length))
    centres = [float(piece.mean()) for piece in pieces]
    lows = [float(np.percentile(values[piece], _BASE)) for piece in pieces]
    return np.interp(np.arange(len(values)), centres, lows)
