"""Eye movements out of the EEG by regression (Schlögl et al. 2007, doi:10.1016/j.clinph.2006.09.003)."""

from __future__ import annotations

import numpy as np

# Above this condition number of the EOG's covariance a direct solution is noise: channels are flat or copies.
_SINGULAR = 1e12


def regression_weights(eeg: np.ndarray, eog: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return how strongly each EOG channel shows in each EEG channel: b = C_NN⁻¹ C_NS of the demeaned signals.

    Args:
        eeg: ndarray, shape (n_eeg, n_times), µV.
        eog: ndarray, shape (n_eog, n_times), µV, filtered like the EEG.

    Returns:
        The weights, ndarray, shape (n_eeg, n_eog), µV per µV, and whether the EOG is singular (a flat channel, or one
        that others make up); the weights are then those of least norm.
    """
    noise = eog - eog.mean(axis=1, keepdims=True)
    own = noise @ noise.T
    # Demeaning one factor suffices: the noise sums to zero, whatever the signal's mean.
    shared = np.stack([noise @ channel for channel in eeg], axis=1) if len(eeg) else np.zeros((len(eog), 0))
    scale = np.sqrt(np.diag(own))
    scale[scale == 0] = 1.0
    singular = bool(np.linalg.cond(own / np.outer(scale, scale)) > _SINGULAR)
    if singular:
        return (np.linalg.pinv(own, rcond=1e-10, hermitian=True) @ shared).T, True
    return np.linalg.solve(own, shared).T, False


def remove(eeg: np.ndarray, eog: np.ndarray, weights: np.ndarray, *, offset: bool) -> np.ndarray:
    """Subtract the demeaned EOG, weighted, from the EEG in place.

    Args:
        eeg: ndarray, shape (n_eeg, n_times), µV.
        eog: ndarray, shape (n_eog, n_times), µV.
        weights: ndarray, shape (n_eeg, n_eog), see :func:`regression_weights`.
        offset: Also subtract each EEG channel's own mean, as the corrected signal that BIOSIG's ``regress_eog`` returns
            has it; without it the result is that of MNE's ``EOGRegression``. A band-passed signal's mean is some
            hundredths of a microvolt.

    Returns:
        ``eeg``.
    """
    noise = eog - eog.mean(axis=1, keepdims=True)
    for channel, weight in zip(eeg, weights, strict=True):
        channel -= weight @ noise
        if offset:
            channel -= channel.mean()
    return eeg
