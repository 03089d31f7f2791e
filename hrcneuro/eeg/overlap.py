"""Responses of neighbouring onsets taken apart by regression: each onset adds its class's response to the recording.

Onsets follow each other faster than an epoch is long, so an average holds part of the neighbours' responses, and of
different neighbours in different conditions. The least-squares responses of all classes at once are free of that,
as far as responses add up (Smith & Kutas 2015, doi:10.1111/psyp.12320).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Keeps the system solvable where onsets are too regular to tell two lags apart; far below the noise.
RIDGE = 1e-6


def regressed_averages(
    data: NDArray[np.float64], onsets: NDArray[np.integer], masks: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return each condition's response without its neighbours', shape (conditions, channels, samples).

    Conditions are fitted together with all others that share no trial with them, plus one class of all other trials.
    The samples fitted are those within any epoch, so onsets without an epoch are not accounted for.

    Args:
        data: Epochs without baseline correction, shape (trials, channels, samples).
        onsets: The sample of each onset in the recording, shape (trials,).
        masks: Which trials belong to which condition, shape (conditions, trials).

    Raises:
        ValueError: A condition has no trial, or two trials share an onset.
    """
    if not masks.any(axis=1).all():
        raise ValueError(f"conditions {np.flatnonzero(~masks.any(axis=1)).tolist()} have no trial")
    if len(np.unique(onsets)) < len(onsets):
        raise ValueError("two trials have their onset at the same sample: their responses cannot be told apart")
    responses = np.empty((len(masks), *data.shape[1:]))
    for members in _families(masks):
        classes = masks[members]
        rest = ~classes.any(axis=0)
        if rest.any():
            classes = np.vstack([classes, rest])
        responses[members] = _solve(data, onsets, classes)[: len(members)]
    return responses


def _families(masks: NDArray[np.bool_]) -> list[list[int]]:
    """Return groups of conditions of which no two share a trial, each taken by the first group it fits."""
    groups: list[list[int]] = []
    for i, mask in enumerate(masks):
        home = next((g for g in groups if not (masks[g] & mask).any()), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return groups


def _solve(data: NDArray[np.float64], onsets: NDArray[np.integer], classes: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the least-squares responses of classes that share no trial, shape (classes, channels, samples).

    The right-hand side of the normal equations is the sum of each class's epochs. The matrix counts, for every two
    classes, how often their onsets lie a given lag apart: one Toeplitz block a pair.
    """
    from scipy import linalg

    n_classes, n_times = len(classes), data.shape[-1]
    lags = _lag_counts(onsets, classes, n_times)
    matrix = np.empty((n_classes, n_times, n_classes, n_times))
    for a in range(n_classes):
        for b in range(n_classes):
            # Sample l of an onset of class a is sample l - lag of the onset of class b that comes lag later.
            matrix[a, :, b, :] = linalg.toeplitz(lags[a, b, n_times - 1 :], lags[a, b, n_times - 1 :: -1])
    normal = matrix.reshape(n_classes * n_times, -1)
    normal[np.diag_indices_from(normal)] *= 1 + RIDGE
    sums = (classes.astype(float) @ data.reshape(len(data), -1)).reshape(n_classes, data.shape[1], n_times)
    solved = linalg.solve(normal, sums.transpose(0, 2, 1).reshape(n_classes * n_times, -1), assume_a="pos")
    responses: NDArray[np.float64] = solved.reshape(n_classes, n_times, -1).transpose(0, 2, 1)
    return responses


def _lag_counts(onsets: NDArray[np.integer], classes: NDArray[np.bool_], n_times: int) -> NDArray[np.float64]:
    """Return how many pairs of onsets (class a, class b) lie b - a = lag apart, shape (a, b, lags), lag 0 mid-way."""
    counts = np.zeros((len(classes), len(classes), 2 * n_times - 1))
    order = np.argsort(onsets)
    sample, member = onsets[order], classes.argmax(axis=0)[order]
    for shift in range(len(sample)):
        lag = sample[shift:] - sample[: len(sample) - shift]
        near = lag < n_times
        if not near.any():
            break
        a, b, lag = member[: len(sample) - shift][near], member[shift:][near], lag[near]
        np.add.at(counts, (a, b, n_times - 1 + lag), 1)
        if shift:
            np.add.at(counts, (b, a, n_times - 1 - lag), 1)
    return counts
