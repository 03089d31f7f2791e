"""The study's classifier in plain numpy: regularised linear discriminant analysis (paper 2.5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


def regularized_covariance(rows: np.ndarray, *, shrinkage: float) -> np.ndarray:
    """Return (1 − λ)·Σ + λ·I of ``rows``: ndarray, shape (n_features, n_features); Σ with n − 1.

    λ·I has a unit: the features must be in microvolt (paper 2.5.4).
    """
    covariance = np.atleast_2d(np.cov(rows, rowvar=False, ddof=1))
    return (1 - shrinkage) * covariance + shrinkage * np.eye(rows.shape[1])


def discriminant(rows: np.ndarray, labels: np.ndarray, *, shrinkage: float) -> tuple[np.ndarray, float]:
    """Return weights w: ndarray, shape (n_features,), and bias b of y = sign(wᵀx + b), positive for class 2 (takeover).

    w = (Σ̃₁ + Σ̃₂)⁻¹(μ₂ − μ₁) and b = −½ wᵀ(μ₁ + μ₂), the midpoint; the paper prints another sign and twice the bias
    (2.5.4).

    Args:
        rows: ndarray, shape (n_trials, n_features): training trials, microvolt; at least two a class.
        labels: ndarray, shape (n_trials,), true for class 2.
        shrinkage: λ.
    """
    first, second = rows[~labels], rows[labels]
    spread = regularized_covariance(first, shrinkage=shrinkage) + regularized_covariance(second, shrinkage=shrinkage)
    return _between(first.mean(axis=0), second.mean(axis=0), spread)


@dataclass(frozen=True)
class Moments:
    """What the trials of a class tell a discriminant, so that more trials can be added without the first ones.

    Attributes:
        n: How many trials.
        mean: ndarray, shape (n_features,).
        scatter: ndarray, shape (n_features, n_features): sum of squares and products about the mean.
    """

    n: int
    mean: np.ndarray
    scatter: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray) -> Moments:
        """Return the moments of trials, ndarray, shape (n_trials, n_features); at least one."""
        mean = rows.mean(axis=0)
        rest = rows - mean
        return cls(len(rows), mean, rest.T @ rest)

    def joined(self, other: Moments) -> Moments:
        """Return the moments of both together (Chan et al. 1983, Am. Stat. 37:242)."""
        n, gap = self.n + other.n, other.mean - self.mean
        between = (self.n * other.n / n) * np.outer(gap, gap)
        return Moments(n, self.mean + gap * (other.n / n), self.scatter + other.scatter + between)


def discriminant_of(first: Moments, second: Moments, *, shrinkage: float) -> tuple[np.ndarray, float]:
    """Return what :func:`discriminant` does, of the classes' moments; at least two trials a class."""
    covariances = first.scatter / (first.n - 1) + second.scatter / (second.n - 1)
    spread = (1 - shrinkage) * covariances
    spread.flat[:: len(spread) + 1] += 2 * shrinkage
    return _between(first.mean, second.mean, spread)


def _between(mean1: np.ndarray, mean2: np.ndarray, spread: np.ndarray) -> tuple[np.ndarray, float]:
    """Return weights and bias of the midpoint between two means, by the sum of both regularised covariances."""
    weights = np.linalg.solve(spread, mean2 - mean1)
    return weights, -0.5 * float(weights @ (mean1 + mean2))
