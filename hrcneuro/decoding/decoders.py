"""Recipes made to work: features of the trials of a problem, and a scorer for any labelling and folds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from hrcneuro.decoding import crossval, fast, features
from hrcneuro.decoding.crossval import Split
from hrcneuro.decoding.lda import discriminant
from hrcneuro.decoding.problem import Decode
from hrcneuro.decoding.recipes import Recipe
from hrcneuro.decoding.scheme import PAPER, Scheme


class Decoders:
    """The decoders of a run, in their order, each with its features of the epochs.

    Args:
        recipes: Name -> recipe.
        epochs_uv: Rows of the epochs -> ndarray, shape (n_trials, n_channels, n_times), µV.
        times_s: ndarray, shape (n_times,), s from the onset of the movement.
        scheme: The window whose mean the features remove, and λ of regularised LDA where a recipe names none.

    Raises:
        EstimatorError, MissingLibraryError: A recipe's estimator cannot be made.
    """

    def __init__(
        self,
        recipes: Mapping[str, Recipe],
        *,
        epochs_uv: Callable[[np.ndarray], np.ndarray],
        times_s: np.ndarray,
        scheme: Scheme = PAPER,
    ) -> None:
        self.recipes = recipes
        self.epochs_uv = epochs_uv
        self.times_s = times_s
        start, end = scheme.mean_window_s
        self.mean_window_s: features.Span = (start, end)
        self.shrinkage = scheme.shrinkage
        for recipe in recipes.values():
            if recipe.estimator != "rlda":
                # A wrong parameter or a missing library stops the run before the first fold.
                _estimator(recipe)

    def of(self, rows: np.ndarray) -> Iterator[tuple[str, Decode, bool]]:
        """Yield name, scorer and whether it is quick enough for permutations, for the trials ``rows`` of a problem.

        Raises:
            ValueError: The features cannot be computed, as :func:`.features.extract` says.
        """
        epochs_uv = self.epochs_uv(rows)
        extracted: dict[str, np.ndarray] = {}
        for name, recipe in self.recipes.items():
            if recipe.features not in extracted:
                extracted[recipe.features] = features.extract(
                    recipe.features, epochs_uv, self.times_s, mean_window_s=self.mean_window_s
                )
            yield name, *self._scorer(recipe, extracted[recipe.features])

    def _scorer(self, recipe: Recipe, data: np.ndarray) -> tuple[Decode, bool]:
        if recipe.estimator == "rlda":
            return rlda(data, shrinkage=recipe.params.get("shrinkage", self.shrinkage)), True
        return looped(data, lambda: _estimator(recipe)), False


def _estimator(recipe: Recipe) -> object:
    # scikit-learn takes long to import, and the study's own decoder does not need it.
    from hrcneuro.decoding.classifiers import make

    return make(recipe.estimator, recipe.params)


def rlda(data: np.ndarray, *, shrinkage: float) -> Decode:
    """Return the study's decoder for features of shape (n_trials, n_features), on the fast path where there is one."""
    if shrinkage == 1:
        return plain_rlda(data, shrinkage=shrinkage)
    products = fast.gram(data)
    return lambda labels, splits: fast.rlda_scores(products, labels, splits, shrinkage=shrinkage)


def plain_rlda(data: np.ndarray, *, shrinkage: float) -> Decode:
    """Return the study's decoder as the plain loop: the reference of the fast path."""

    def train(rows: np.ndarray, labels: np.ndarray) -> crossval.Scorer:
        weights, bias = discriminant(rows, labels, shrinkage=shrinkage)
        return lambda held_out: held_out @ weights + bias

    return lambda labels, splits: crossval.cross_validate(data, labels, splits, train)


def looped(data: np.ndarray, estimator: Callable[[], object]) -> Decode:
    """Return a decoder that fits a fresh scikit-learn estimator in every fold."""

    def train(rows: np.ndarray, labels: np.ndarray) -> crossval.Scorer:
        fitted = estimator().fit(rows, labels.astype(int))  # type: ignore[attr-defined]
        return lambda held_out: np.asarray(fitted.decision_function(held_out), dtype=float)

    def decode(labels: np.ndarray, splits: Sequence[Split]) -> list[np.ndarray]:
        return crossval.cross_validate(data, labels, splits, train)

    return decode
