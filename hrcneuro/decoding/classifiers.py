"""Classifiers as scikit-learn estimators: the study's, and others to compare it with on the same folds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.covariance import ledoit_wolf
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

from hrcneuro.decoding.lda import discriminant
from hrcneuro.decoding.refusals import EstimatorError, MissingLibraryError
from hrcneuro.decoding.scheme import SHRINKAGE

# The share of the variance below which a direction of the channels is empty. The common average and each interpolated
# channel empty one; single precision, in which epochs are stored, leaves 1e-16 of the variance there. What is measured
# holds far more: 2e-4 in the weakest direction of EEGLAB's sample recording; noise of 0.1 µV beside 100 µV has 1e-6.
_EMPTY = 1e-10


class _TwoClassLinear(ClassifierMixin, BaseEstimator, ABC):
    """y = sign(wᵀx + b) for two classes; subclasses say how w and b are found."""

    def fit(self, X: np.ndarray, y: np.ndarray) -> _TwoClassLinear:
        """Fit weights and bias.

        Args:
            X: ndarray, shape (n_trials, n_features).
            y: ndarray, shape (n_trials,): the trials' classes.

        Raises:
            ValueError: There are not two classes, or one has fewer than two trials.
        """
        X, y = validate_data(self, X, y, dtype=float)
        check_classification_targets(y)
        self.classes_, codes, counts = np.unique(y, return_inverse=True, return_counts=True)
        if len(self.classes_) != 2:
            raise ValueError(
                f"Only binary classification is supported. {type(self).__name__} needs two classes; "
                f"got {len(self.classes_)} class"
            )
        if counts.min() < 2:
            raise ValueError(f"each class needs at least two trials; the smaller one has n_samples=1 ({counts.min()})")
        self.coef_, self.intercept_ = self._solve(X, codes == 1)
        return self

    def decision_function(self, X: np.ndarray) -> np.ndarray:
        """Return the scores wᵀx + b: ndarray, shape (n_trials,); positive: the second class."""
        check_is_fitted(self)
        return validate_data(self, X, dtype=float, reset=False) @ self.coef_ + self.intercept_

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return the decided class of each trial: ndarray, shape (n_trials,)."""
        check_is_fitted(self)
        return self.classes_[(self.decision_function(X) > 0).astype(int)]

    @abstractmethod
    def _solve(self, rows: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, float]:
        """Return weights, ndarray, shape (n_features,), and bias; ``labels`` are True where the second class is."""

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.classifier_tags.multi_class = False
        return tags


class RegularizedLDA(_TwoClassLinear):
    """The study's classifier (paper 2.5.4): Σ̃ = (1 − λ)Σ + λI a class, summed; features in microvolt.

    Args:
        shrinkage: λ in 0 … 1.
    """

    def __init__(self, shrinkage: float = SHRINKAGE) -> None:
        self.shrinkage = shrinkage

    def _solve(self, rows: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, float]:
        return discriminant(rows, labels, shrinkage=self.shrinkage)


class ToeplitzLDA(_TwoClassLinear):
    """LDA whose covariance does not depend on when, only on how far apart two time steps lie.

    The pooled within-class covariance is shrunk after Ledoit and Wolf; then its blocks (channels × channels) of equal
    time lag are replaced by their mean, and lags fade linearly to zero at ``n_times``, which keeps the matrix positive
    definite. (Sosulski & Tangermann 2022, J. Neural Eng. 19:066001, doi:10.1088/1741-2552/ac9c98)

    Args:
        n_times: Time steps a channel; features are ordered channel by channel, all steps of the first one first.
    """

    def __init__(self, n_times: int = 1) -> None:
        self.n_times = n_times

    def _solve(self, rows: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, float]:
        n_times = int(self.n_times)
        n_channels, rest = divmod(rows.shape[1], n_times)
        if rest:
            raise ValueError(f"{rows.shape[1]} features are no multiple of n_times = {n_times}")
        mean1, mean2 = rows[~labels].mean(axis=0), rows[labels].mean(axis=0)
        centred = rows - np.where(labels[:, None], mean2, mean1)
        shrunk, _ = ledoit_wolf(centred, assume_centered=True)
        covariance = block_toeplitz(shrunk, n_channels=n_channels, n_times=n_times)
        # Features without any spread leave a singular matrix; the ridge is far below what data can show.
        ridge = 1e-10 * max(float(np.trace(covariance)) / len(covariance), 1e-6)
        weights = np.linalg.solve(covariance + ridge * np.eye(len(covariance)), mean2 - mean1)
        return weights, -0.5 * float(weights @ (mean1 + mean2))


def block_toeplitz(covariance: np.ndarray, *, n_channels: int, n_times: int) -> np.ndarray:
    """Return the covariance with blocks of equal lag averaged and faded, same shape and order.

    Args:
        covariance: ndarray, shape (n_channels × n_times, n_channels × n_times), channel by channel.
        n_channels, n_times: What its sides are made of.
    """
    blocks = covariance.reshape(n_channels, n_times, n_channels, n_times).transpose(1, 3, 0, 2)
    out = np.empty_like(blocks)
    for lag in range(n_times):
        mean = blocks[np.arange(n_times - lag), np.arange(lag, n_times)].mean(axis=0) * (1 - lag / n_times)
        for start in range(n_times - lag):
            out[start, start + lag], out[start + lag, start] = mean, mean.T
    return out.transpose(2, 0, 3, 1).reshape(covariance.shape)


def make(estimator: str, params: Mapping[str, float]) -> Any:
    """Return an unfitted estimator of a recipe.

    Raises:
        EstimatorError: The name or a parameter is unknown.
        MissingLibraryError: Its library is not installed.
    """
    makers = {
        "rlda": RegularizedLDA,
        "shrinkage_lda": lambda: LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"),
        "toeplitz_lda": ToeplitzLDA,
        "xdawn_tangent": _xdawn_tangent,
    }
    if estimator not in makers:
        raise EstimatorError(f"estimator {estimator!r} is not known; allowed: {', '.join(makers)}")
    try:
        return makers[estimator](**params)
    except TypeError as error:
        raise EstimatorError(f"the parameters {dict(params)} do not fit the estimator {estimator}: {error}") from error


def _xdawn_tangent(n_filters: float = 3) -> Any:
    """Return xDAWN covariances, projected to the tangent space, with shrinkage LDA; input (trials, channels, steps).

    xDAWN's filters are the directions where a class's average stands out most against all samples, a ratio that
    rounding decides where both are empty. So the channels are first projected on the principal axes of the training
    trials that hold all but ``_EMPTY`` of the variance: as many as the data have rank. And the covariances that make
    the filters are not shrunk: shrinkage adds far more to the average's, of few samples, than to the other, which draws
    the filters to the weakest directions. What follows is unmoved by turns and reflections of the axes.
    """
    try:
        from pyriemann.estimation import XdawnCovariances
        from pyriemann.tangentspace import TangentSpace
    except ImportError as error:
        raise MissingLibraryError(
            f"the decoder xdawn_tangent needs the library pyriemann, which cannot be imported: {error}"
        ) from error
    from mne.decoding import UnsupervisedSpatialFilter
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline

    return make_pipeline(
        UnsupervisedSpatialFilter(PCA(n_components=1 - _EMPTY, svd_solver="covariance_eigh")),
        XdawnCovariances(nfilter=int(n_filters), estimator="lwf", xdawn_estimator="scm"),
        TangentSpace(metric="riemann"),
        LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"),
    )
