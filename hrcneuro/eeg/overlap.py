"""Averages without neighbours' responses: regression ERPs whose predictors say which condition a trial is of.

Onsets follow each other faster than an epoch is long, so an average holds part of the neighbours' responses, and of
different neighbours in different conditions. The least-squares responses of all classes at once are free of that,
as far as responses add up (Smith & Kutas 2015, doi:10.1111/psyp.12320).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hrcneuro.eeg.regression import OtherOnsets, deconvolved


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
    responses = np.empty((len(masks), *data.shape[1:]))
    for members in _families(masks):
        classes = masks[members].T
        predictors = np.where(classes.any(axis=1, keepdims=True), classes, np.nan)
        responses[members] = deconvolved(data, onsets, predictors, others)
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
