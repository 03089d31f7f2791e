"""Recipes made to work: features of the trials of a problem, and a scorer for any labelling and folds."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hrcneuro.decoding import crossval, fast, features
from hrcneuro.decoding.crossval import Split
from hrcneuro.decoding.lda import discriminant
from hrcneuro.decoding.left_out import LeftOut
from hrcneuro.decoding.problem import Decode
from hrcneuro.decoding.recipes import Recipe
from hrcneuro.decoding.refusals import EstimatorError
from hrcneuro.decoding.scheme import PAPER, Scheme


class Decoders:
    """The decoders of a run, in their order, each with its features of the epochs.

    Args:
        recipes: Name -> recipe.
        epochs_uv: Rows of the epochs -> ndarray, shape (n_trials, n_channels, n_times), µV.
        times_s: ndarray, shape (n_times,), s from the onset of the movement.
        foreign: Name of a recipe -> what makes its estimator, of those that are named by an import path.
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
        foreign: Mapping[str, Callable[[], object]] | None = None,
    ) -> None:
        self.recipes = recipes
        self.epochs_uv = epochs_uv
        self.times_s = times_s
        start, end = scheme.mean_window_s
        self.mean_window_s: features.Span = (start, end)
        self.shrinkage = scheme.shrinkage
        self.foreign = foreign or {}
        for name, recipe in recipes.items():
            if recipe.estimator != "rlda":
                # A wrong parameter or a missing library stops the run before the first fold.
                self.estimator(name)

    def of(self, seen: Mapping[Any, np.ndarray]) -> Iterator[tuple[str, Decode, Decode | None]]:
        """Yield name, scorer, and what decides alike and is quick enough for permutations, for :meth:`features_of`."""
        for name, recipe in self.recipes.items():
            yield name, *self._scorer(name, seen[recipe.sees])

    def features_of(self, rows: np.ndarray) -> dict[Any, np.ndarray]:
        """Return what recipes see (``Recipe.sees``) -> the features of the trials ``rows`` of a problem.

        Raises:
            ValueError: They cannot be computed, as :func:`.features.extract` says.
        """
        epochs_uv = self.epochs_uv(rows)
        return {
            (kind, windows): features.extract(
                kind,
                epochs_uv,
                self.times_s,
                mean_window_s=self.mean_window_s,
                windows_s=[(start, end) for start, end in windows],
            )
            for kind, windows in sorted({recipe.sees for recipe in self.recipes.values()})
        }

    def estimator(self, name: str) -> Any:
        """Return a new estimator of a recipe.

        Raises:
            EstimatorError, MissingLibraryError: It cannot be made.
        """
        # scikit-learn takes long to import, and the study's own decoder does not need it.
        from hrcneuro.decoding.classifiers import make

        recipe = self.recipes[name]
        return self.foreign[name]() if recipe.foreign else make(recipe.estimator, recipe.params)

    def shrinkage_of(self, recipe: Recipe) -> float:
        """Return λ of a recipe of regularised LDA: its own, or else the scheme's."""
        return float(recipe.params.get("shrinkage", self.shrinkage))

    def _scorer(self, name: str, data: np.ndarray) -> tuple[Decode, Decode | None]:
        recipe = self.recipes[name]
        if recipe.estimator == "rlda":
            shrinkage = self.shrinkage_of(recipe)
            return rlda(data, shrinkage=shrinkage), permuted_rlda(data, shrinkage=shrinkage)
        return looped(data, lambda: self.estimator(name), of=recipe.estimator if recipe.foreign else ""), None


def rlda(data: np.ndarray, *, shrinkage: float) -> Decode:
    """Return the study's decoder for features of shape (n_trials, n_features), on the fast path where there is one."""
    if shrinkage == 1:
        return plain_rlda(data, shrinkage=shrinkage)
    products = fast.gram(data)
    return lambda labels, splits: fast.rlda_scores(products, labels, splits, shrinkage=shrinkage)


def permuted_rlda(data: np.ndarray, *, shrinkage: float) -> Decode:
    """Return what decides as :func:`rlda` does, sooner where many labellings follow each other."""
    return plain_rlda(data, shrinkage=shrinkage) if shrinkage == 1 else LeftOut(fast.gram(data), shrinkage=shrinkage)


def plain_rlda(data: np.ndarray, *, shrinkage: float) -> Decode:
    """Return the study's decoder as the plain loop: the reference of the fast path."""

    def train(rows: np.ndarray, labels: np.ndarray) -> crossval.Scorer:
        weights, bias = discriminant(rows, labels, shrinkage=shrinkage)
        return lambda held_out: held_out @ weights + bias

    return lambda labels, splits: crossval.cross_validate(data, labels, splits, train)


def looped(data: np.ndarray, estimator: Callable[[], Any], *, of: str = "") -> Decode:
    """Return a decoder that fits a fresh scikit-learn estimator in every fold.

    Its score is ``decision_function``, or else the probability of class 2 above one half.

    Args:
        data: Features, one row a trial.
        estimator: Makes one.
        of: Import path of an estimator that is not of this program: whatever it raises is an EstimatorError.
    """

    def train(rows: np.ndarray, labels: np.ndarray) -> crossval.Scorer:
        with _told_of(of, rows):
            fitted = estimator().fit(rows, labels.astype(int))

        def score(held_out: np.ndarray) -> np.ndarray:
            with _told_of(of, held_out):
                if hasattr(fitted, "decision_function"):
                    return np.asarray(fitted.decision_function(held_out), dtype=float)
                return np.asarray(fitted.predict_proba(held_out), dtype=float)[:, 1] - 0.5

        return score

    def decode(labels: np.ndarray, splits: Sequence[Split]) -> list[np.ndarray]:
        return crossval.cross_validate(data, labels, splits, train)

    return decode


@contextlib.contextmanager
def _told_of(estimator: str, rows: np.ndarray) -> Iterator[None]:
    """Name a foreign estimator, and what it was given, in whatever it raises; others' errors pass as they are."""
    try:
        yield
    except Exception as error:
        if not estimator:
            raise
        shape = " × ".join(map(str, rows.shape))
        raise EstimatorError(f"{estimator} failed on {shape} features: {type(error).__name__}: {error}") from error
