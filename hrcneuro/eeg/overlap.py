"""Responses of neighbouring onsets taken apart by regression: each onset adds its class's response to the recording.

Onsets follow each other faster than an epoch is long, so an average holds part of the neighbours' responses, and of
different neighbours in different conditions. The least-squares responses of all classes at once are free of that,
as far as responses add up (Smith & Kutas 2015, doi:10.1111/psyp.12320).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Keeps the system solvable where onsets are too regular to tell two lags apart; far below the noise.
RIDGE = 1e-6


@dataclass(frozen=True)
class OtherOnsets:
    """Onsets without an epoch, whose responses reach into the epochs of others all the same.

    Attributes:
        onsets: Sample of each in the recording, ndarray, shape (n_onsets,).
        spans: Which part of an epoch around it would lie in the same stretch of the recording, as (first sample, first
            sample after), ndarray, shape (n_onsets, 2): no response goes on behind a discontinuity.
    """

    onsets: NDArray[np.integer]
    spans: NDArray[np.integer]


def regressed_averages(
    data: NDArray[np.float64],
    onsets: NDArray[np.integer],
    masks: NDArray[np.bool_],
    others: OtherOnsets | None = None,
) -> NDArray[np.float64]:
    """Return each condition's response without its neighbours'.

    Conditions are fitted together with all others that share no trial with them, plus one class of all other onsets:
    those of the other trials and those without an epoch. The samples fitted are those within any epoch.

    Args:
        data: Epochs without baseline correction, ndarray, shape (n_epochs, n_channels, n_times), µV.
        onsets: The sample of each trial's onset in the recording, ndarray, shape (n_epochs,).
        masks: Which trials belong to which condition, ndarray, shape (n_conditions, n_epochs).
        others: The recording's other onsets.

    Returns:
        ndarray, shape (n_conditions, n_channels, n_times), µV.

    Raises:
        ValueError: A condition has no trial, or two trials share an onset.
    """
    if not masks.any(axis=1).all():
        raise ValueError(f"conditions {np.flatnonzero(~masks.any(axis=1)).tolist()} have no trial")
    if len(np.unique(onsets)) < len(onsets):
        raise ValueError("two trials have their onset at the same sample: their responses cannot be told apart")
    fit = _Fit(data, onsets, others)
    responses = np.empty((len(masks), *data.shape[1:]))
    for members in _families(masks):
        responses[members] = fit.responses(masks[members])
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


class _Fit:
    """The samples within any epoch, and which sample of which onset's response each of them holds."""

    def __init__(self, data: NDArray[np.float64], onsets: NDArray[np.integer], others: OtherOnsets | None) -> None:
        n_times = data.shape[-1]
        reach = np.arange(n_times)
        samples = np.unique(onsets[:, None] + reach)
        self.signal = np.empty((len(samples), data.shape[1]))
        starts = np.searchsorted(samples, onsets)
        for start, epoch in zip(starts, data, strict=True):
            self.signal[start : start + n_times] = epoch.T
        self.n_times, self.n_trials = n_times, len(data)
        # One entry a sample of a response: its row (the sample of the recording), its onset, its place in the response.
        self.row = (starts[:, None] + reach).ravel()
        self.onset, self.lag = np.divmod(np.arange(len(self.row)), n_times)
        if others is not None and len(others.onsets):
            sample = others.onsets[:, None] + reach
            row = np.minimum(np.searchsorted(samples, sample), len(samples) - 1)
            inside = (samples[row] == sample) & (reach >= others.spans[:, :1]) & (reach < others.spans[:, 1:])
            onset, lag = np.nonzero(inside)
            self.row = np.concatenate([self.row, row[inside]])
            self.onset = np.concatenate([self.onset, self.n_trials + onset])
            self.lag = np.concatenate([self.lag, lag])

    def responses(self, classes: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the least-squares responses of classes that share no trial, shape (n_classes, n_channels, n_times)."""
        from scipy import linalg, sparse

        rest = len(classes)
        member = np.full(max(self.n_trials, self.onset.max() + 1), rest)
        member[: self.n_trials] = np.where(classes.any(axis=0), classes.argmax(axis=0), rest)
        column = member[self.onset] * self.n_times + self.lag
        shape = (len(self.signal), (member.max() + 1) * self.n_times)
        design = sparse.csr_array((np.ones(len(column)), (self.row, column)), shape=shape)
        normal = (design.T @ design).toarray()
        diagonal = np.diag_indices_from(normal)
        # What no fitted sample holds, as parts of the response of onsets far from all epochs, is set to zero.
        normal[diagonal] = np.where(normal[diagonal] > 0, normal[diagonal] * (1 + RIDGE), 1.0)
        solved = linalg.solve(normal, design.T @ self.signal, assume_a="pos", overwrite_a=True, overwrite_b=True)
        fitted: NDArray[np.float64] = solved.reshape(-1, self.n_times, solved.shape[1])[:rest].transpose(0, 2, 1)
        return fitted
