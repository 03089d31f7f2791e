"""What a linear decoder listens to: patterns beside weights (Haufe et al. 2014, doi:10.1016/j.neuroimage.2013.10.067).

A weight says how a feature enters the score; it can be large where there is noise to cancel and no signal. The pattern
says how the feature changes with the score, a = cov(x, wᵀx) / var(wᵀx): that is what may be drawn on a scalp. Here it
is a times the score's standard deviation, so that its unit is the feature's: µV that go with one SD of the score.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrcneuro.decoding import features
from hrcneuro.decoding.decoders import Decoders
from hrcneuro.decoding.lda import discriminant


@dataclass(frozen=True)
class DecoderPatterns:
    """The patterns of one decoder, fitted to all trials of a problem.

    Attributes:
        decoder: Its recipe's name.
        layout: What the features are, channel by channel in each block.
        weights, patterns: ndarray, shape (n_features,); None for a decoder whose score is no weighted sum of features.
    """

    decoder: str
    layout: list[list[features.Feature]]
    weights: np.ndarray | None
    patterns: np.ndarray | None


def pattern(rows: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return cov(x, s) / SD(s) of the scores s = wᵀx: ndarray, shape (n_features,), NaN where all scores are equal.

    Args:
        rows: ndarray, shape (n_trials, n_features).
        weights: w, ndarray, shape (n_features,).
    """
    centred = rows - rows.mean(axis=0)
    scores = centred @ weights
    spread = float(scores.std(ddof=1))
    if not spread > 0:
        return np.full(rows.shape[1], np.nan)
    return centred.T @ scores / ((len(rows) - 1) * spread)


def of_problem(decoders: Decoders, seen: Mapping[Any, np.ndarray], labels: np.ndarray) -> Iterator[DecoderPatterns]:
    """Yield the patterns of each decoder on the trials of a problem, all of them used to fit.

    Args:
        decoders: The decoders of the run.
        seen: The trials' features, as ``decoders.features_of`` returns them.
        labels: ndarray, shape (n_trials,), true for class 2.
    """
    for name, recipe in decoders.recipes.items():
        data = seen[recipe.sees]
        # What sees channels and steps apart weighs no feature by itself.
        weights = None if recipe.features == "epochs" else _weights(decoders, name, data, labels)
        found = None if weights is None else pattern(data, weights)
        windows_s = [(start, end) for start, end in recipe.windows_s]
        yield DecoderPatterns(name, features.layout(recipe.features, windows_s), weights, found)


def _weights(decoders: Decoders, name: str, data: np.ndarray, labels: np.ndarray) -> np.ndarray | None:
    """Return the weights of a recipe fitted to these features; None where its estimator has no weight a feature."""
    recipe = decoders.recipes[name]
    if recipe.estimator == "rlda":
        return discriminant(data, labels, shrinkage=decoders.shrinkage_of(recipe))[0]
    fitted = decoders.estimator(name).fit(data, labels.astype(int))
    weights = np.ravel(getattr(fitted, "coef_", np.empty(0)))
    return weights if weights.shape == data.shape[1:] else None
