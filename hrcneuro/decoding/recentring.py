"""Subjects brought onto a common centre, so that a decoder of some of them serves another.

Each subject's trials lose their mean, and the covariance of their channels becomes that of all others: means in the
space of vectors, covariances on the manifold of positive definite matrices, both by pyRiemann's ``TLCenter`` (Zanini et
al. 2018, IEEE TBME 65:1107, doi:10.1109/TBME.2017.2742541). The centre of covariances is their plain mean, as in the
Euclidean alignment of He & Wu (2020, IEEE TBME 67:399, doi:10.1109/TBME.2019.2913914): that of a single trial in 15
windows has no full rank, without which the Riemannian mean is one of what was added to it. No label is looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrcneuro.decoding.refusals import MissingLibraryError

_WHO = "subject"
# The share of a trial's covariance that is made alike in all directions: the average reference and each interpolated
# channel empty one, and whitening would blow up what rounding leaves there.
_SHRUNK = 0.1


@dataclass(frozen=True)
class Centre:
    """What the trials of a subject, or of several, have in common.

    Attributes:
        mean: ndarray, shape (n_channels, n_windows), µV.
        covariance: ndarray, shape (n_channels, n_channels), µV²: mean over the trials, about ``mean``.
        whitening: ndarray, shape (n_channels, n_channels), 1/µV: its inverse square root.
    """

    mean: np.ndarray
    covariance: np.ndarray
    whitening: np.ndarray

    @property
    def size_uv(self) -> float:
        """Root of the mean variance over channels, µV."""
        return float(np.sqrt(np.trace(self.covariance) / len(self.covariance)))


def tools() -> Any:
    """Return pyRiemann's module of transfer learning.

    Raises:
        MissingLibraryError: It is not installed.
    """
    try:
        import pyriemann.transfer
    except ImportError as error:
        raise MissingLibraryError(
            f"recentring needs the library pyriemann, which cannot be imported: {error}"
        ) from error
    return pyriemann.transfer


def centre(features: np.ndarray, prior: Centre | None = None, *, weight: float = 0.0) -> Centre:
    """Return the centre of trials, with a prior one counted as so many more trials.

    Args:
        features: ndarray, shape (n_trials, n_channels, n_windows), µV; none are enough where there is a prior.
        prior: What is taken to be the centre before a trial is seen.
        weight: How many trials it counts as, more than 0 where there is one.

    Raises:
        ValueError: There is neither a trial nor a prior.
        MissingLibraryError: pyRiemann is not installed.
    """
    if not len(features) and prior is None:
        raise ValueError("a centre of 0 trials; allowed: at least 1, or a prior")
    weights = np.ones(len(features))
    if prior is None:
        mean = _fitted(features.reshape(len(features), -1), weights).reshape(features.shape[1:])
        return _whitened(mean, covariances(features, mean), weights)
    weights = np.append(weights, weight)
    every = np.concatenate([features, prior.mean[None]])
    mean = _fitted(every.reshape(len(every), -1), weights).reshape(prior.mean.shape)
    return _whitened(mean, np.concatenate([covariances(features, mean), prior.covariance[None]]), weights)


def common(centres: Sequence[Centre]) -> Centre:
    """Return the centre in the middle of several, each counted alike."""
    mean = np.mean([one.mean for one in centres], axis=0)
    return _whitened(mean, np.stack([one.covariance for one in centres]), np.ones(len(centres)))


def recentred(features: np.ndarray, centre: Centre, *, size_uv: float) -> np.ndarray:
    """Return trials about a common centre: ndarray, shape (n_trials, n_channels × n_windows), in units of ``size_uv``.

    Args:
        features: ndarray, shape (n_trials, n_channels, n_windows), µV.
        centre: The subject's.
        size_uv: What a channel's standard deviation becomes, µV; regularised LDA needs one that is like EEG's.
    """
    moved = size_uv * (centre.whitening @ (features - centre.mean))
    return np.asarray(moved.reshape(len(features), -1))


def covariances(features: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Return each trial's covariance of channels over its windows, a tenth of it made alike in all directions.

    Args:
        features: ndarray, shape (n_trials, n_channels, n_windows), µV.
        mean: ndarray, shape (n_channels, n_windows), µV, subtracted first.

    Returns:
        ndarray, shape (n_trials, n_channels, n_channels), µV².
    """
    rest = features - mean
    plain = rest @ rest.transpose(0, 2, 1) / rest.shape[2]
    n_channels = plain.shape[1]
    level = np.trace(plain, axis1=1, axis2=2) / n_channels
    return np.asarray((1 - _SHRUNK) * plain + _SHRUNK * level[:, None, None] * np.eye(n_channels))


def _whitened(mean: np.ndarray, matrices: np.ndarray, weights: np.ndarray) -> Centre:
    fitted = _fitted(matrices, weights)
    return Centre(mean, fitted.inv_filters_ @ fitted.inv_filters_, fitted.filters_)


def _fitted(data: np.ndarray, weights: np.ndarray) -> Any:
    """Return what ``TLCenter`` finds to be the centre of vectors, or what whitens matrices."""
    center = tools().TLCenter(target_domain=_WHO, metric="euclid")
    return center.fit(data, np.full(len(data), f"{_WHO}/0"), sample_weight=weights).centers_[_WHO]
