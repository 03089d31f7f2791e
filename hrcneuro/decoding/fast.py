"""The study's classifier in the space of trials: all folds of a problem from one Gram matrix.

The summed covariances are αI + XᵀHDHX with α = 2λ: the identity plus a matrix whose rank is the number of training
trials, mostly fewer than the 405 features. With Woodbury's identity the weight vector is a combination w = Xᵀa of the
(class-centred) training trials, where a solves a system of the size of the training set::

    (K + αD⁻¹) a = C e        K = XXᵀ, D = diag(βⱼkᵢ), βⱼ = (1 − λ)/(nⱼ − 1), C the classes' indicators
    Cᵀa = (−1, 1)ᵀ / α        which fixes the two numbers e

kᵢ says how often trial i occurs in the training set, nⱼ how many trials class j has there. So one Cholesky
factorisation with two right-hand sides a fold gives everything, and the held-out trials' scores are products of a with
rows of the same Gram matrix. The labels are those of the plain loop (:func:`.crossval.cross_validate` with
:func:`.lda.discriminant`); the scores agree to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dposv

from hrcneuro.decoding.crossval import Split


def gram(rows: np.ndarray) -> np.ndarray:
    """Return the inner products of all trials: ndarray, shape (n_trials, n_trials), about their mean.

    The mean changes no score (w sees differences only) but would cost digits.
    """
    centred = rows - rows.mean(axis=0)
    return centred @ centred.T


def rlda_scores(
    products: np.ndarray, labels: np.ndarray, splits: Sequence[Split], *, shrinkage: float
) -> list[np.ndarray]:
    """Return the scores of each split's held-out trials under regularised LDA.

    Args:
        products: :func:`gram` of all trials of the problem.
        labels: ndarray, shape (n_trials,), true for class 2.
        splits: The folds; each training set lists class 1 first.
        shrinkage: λ, 0 < λ < 1.

    Raises:
        ValueError: λ is 0 or 1: there the system has another form, use the plain loop.
    """
    if not 0 < shrinkage < 1:
        raise ValueError(f"shrinkage = {shrinkage:g}; the fast path needs 0 < shrinkage < 1")
    return [_held_out(products, labels, s, shrinkage) for s in splits]


def _held_out(products: np.ndarray, labels: np.ndarray, split: Split, shrinkage: float) -> np.ndarray:
    train, times = _distinct(split.train)
    second = labels[train]
    size = np.array([times[~second].sum(), times[second].sum()])
    beta = (1 - shrinkage) / (size - 1)
    alpha = 2 * shrinkage

    system = products.take(train, axis=0).take(train, axis=1)
    system.flat[:: len(train) + 1] += alpha / (beta[second.astype(int)] * times)
    classes = np.column_stack([~second, second]).astype(float)
    # The matrix is symmetric: its transpose is the Fortran order that LAPACK works on in place.
    _, solved, info = dposv(system.T, classes, lower=1, overwrite_a=1)
    if info:
        raise np.linalg.LinAlgError(f"the training set's Gram matrix is not positive definite (LAPACK dposv: {info})")
    levels = np.linalg.solve(classes.T @ solved, np.array([-1.0, 1.0]) / alpha)
    # The class means of the training scores, by the same equations and without another product.
    means = levels + np.array([1.0, -1.0]) / (beta * size)
    return products[split.test].take(train, axis=1) @ (solved @ levels) - 0.5 * means.sum()


def _distinct(train: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    times = np.bincount(train)
    if times.max() == 1:
        return train, np.ones(len(train), dtype=int)
    distinct = np.flatnonzero(times)
    return distinct, times[distinct]
