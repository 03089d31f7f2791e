"""The study's classifier from the trials that are left out: for permutations, where one labelling follows the other.

With a balanced training set T in which no trial recurs, the system of :mod:`.fast` is (K + cI) of T, c = α/β, and c
depends on nothing but how large T is. So the inverse G of (K + cI) of *all* trials serves every labelling, and only
what is left out, U, needs a factorisation of its own. With E the classes' indicators in T::

    x = G(E − z on U) vanishes on U and solves the system on T, where   G_UU z = (GE)_U
    Cᵀx = EᵀGE − (GE)_Uᵀ z
    Kx = −z at the held-out trials, which all lie in U

Scores agree with :mod:`.fast` to rounding, which suffices where they are only told from zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dposv

from hrcneuro.decoding import fast
from hrcneuro.decoding.crossval import Split


class LeftOut:
    """Scores held-out trials as :func:`.fast.rlda_scores` does, to rounding, whatever the labels are.

    Args:
        products: :func:`.fast.gram` of all trials of the problem.
        shrinkage: λ, 0 < λ < 1.
    """

    def __init__(self, products: np.ndarray, *, shrinkage: float) -> None:
        self._products, self._shrinkage = products, shrinkage
        self._inverses: dict[int, np.ndarray] = {}

    def __call__(self, labels: np.ndarray, splits: Sequence[Split]) -> list[np.ndarray]:
        """Return the scores of each split's held-out trials.

        Args:
            labels: ndarray, shape (n_trials,), true for class 2.
            splits: The folds; no held-out trial is in their training set.
        """
        return [
            self._scores(labels, split) if self._is_cheaper(labels, split.train) else self._plain(labels, split)
            for split in splits
        ]

    def _is_cheaper(self, labels: np.ndarray, train: np.ndarray) -> bool:
        # Balanced, without a trial that recurs, and more than half of all.
        n = len(labels)
        return (
            2 * len(train) > n
            and 2 * np.count_nonzero(labels[train]) == len(train)
            and np.bincount(train, minlength=n).max() == 1
        )

    def _plain(self, labels: np.ndarray, split: Split) -> np.ndarray:
        return fast.rlda_scores(self._products, labels, [split], shrinkage=self._shrinkage)[0]

    def _scores(self, labels: np.ndarray, split: Split) -> np.ndarray:
        size = len(split.train) // 2
        alpha, beta = 2 * self._shrinkage, (1 - self._shrinkage) / (size - 1)
        inverse = self._inverse(size, alpha / beta)
        classes = np.zeros((len(labels), 2))
        classes[split.train, labels[split.train].astype(int)] = 1.0
        seen = inverse @ classes
        left = np.flatnonzero(classes.sum(axis=1) == 0)
        _, solved, info = dposv(inverse.take(left, axis=0).take(left, axis=1).T, seen[left], lower=1, overwrite_a=1)
        if info:
            raise np.linalg.LinAlgError(f"the left-out trials' matrix is not positive definite (LAPACK dposv: {info})")
        levels = np.linalg.solve(classes.T @ seen - seen[left].T @ solved, np.array([-1.0, 1.0]) / alpha)
        means = levels + np.array([1.0, -1.0]) / (beta * size)
        return -solved[np.searchsorted(left, split.test)] @ levels - 0.5 * means.sum()

    def _inverse(self, size: int, ridge: float) -> np.ndarray:
        # Folds differ in size by one trial: two or three inverses a problem.
        if size not in self._inverses:
            self._inverses[size] = np.linalg.inv(self._products + ridge * np.eye(len(self._products)))
        return self._inverses[size]
