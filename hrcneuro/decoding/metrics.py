"""How well held-out trials were decoded: TNR, TPR, ACC, balanced accuracy, AUC."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.decoding.crossval import Split

RATES = ("tnr", "tpr", "acc", "bacc", "auc")
FALSE_POSITIVES = np.linspace(0.0, 1.0, 101)
"""Shares of class 1 taken for class 2, at which ROC curves are read."""


@dataclass(frozen=True)
class FoldRates:
    """The rates of each fold, shape (n_splits, 5), fractions in the order of ``RATES``; NaN where a class is absent."""

    values: np.ndarray

    def mean(self) -> dict[str, float]:
        """Return the mean of each rate over times and folds, as the paper reports it."""
        return dict(zip(RATES, self.values.mean(axis=0).tolist(), strict=True))


def rates(labels: np.ndarray, scores: np.ndarray) -> tuple[float, float, float, float, float]:
    """Return TNR, TPR, ACC, balanced accuracy and AUC as fractions; class 2 is decided where the score is positive.

    NaN stands for a rate whose class has no trial. ACC alone cannot be trusted where the classes differ in size.

    Args:
        labels: ndarray, shape (n_trials,), true for class 2.
        scores: ndarray, shape (n_trials,).
    """
    right = (scores > 0) == labels
    n_second = int(np.count_nonzero(labels))
    n_first = len(labels) - n_second
    right_second = int(np.count_nonzero(right & labels))
    right_first = int(np.count_nonzero(right)) - right_second
    tnr = right_first / n_first if n_first else np.nan
    tpr = right_second / n_second if n_second else np.nan
    acc = (right_first + right_second) / len(labels) if len(labels) else np.nan
    return tnr, tpr, acc, (tnr + tpr) / 2, auc(labels, scores)


def bacc_standard_error(tnr: float, tpr: float, n1: int, n2: int) -> float:
    """Return the standard error of balanced accuracy from two binomial rates, in percent like them.

    Args:
        tnr, tpr: The rates, in percent.
        n1, n2: Trials of class 1 and of class 2; more than none.
    """
    return math.sqrt(tnr * (100 - tnr) / n1 + tpr * (100 - tpr) / n2) / 2


def auc(labels: np.ndarray, scores: np.ndarray) -> float:
    """Return the share of pairs in which class 2 scores above class 1 (ties count half); NaN without both classes."""
    first, second = np.sort(scores[~labels]), scores[labels]
    if not len(first) or not len(second):
        return float("nan")
    below = np.searchsorted(first, second, "left") + np.searchsorted(first, second, "right")
    return float(below.sum()) / (2 * len(first) * len(second))


def mean_roc(labels: np.ndarray, splits: Sequence[Split], scores: Sequence[np.ndarray]) -> np.ndarray:
    """Return the mean over the folds of the share of class 2 that is found at each of :data:`FALSE_POSITIVES`.

    Each fold has a curve of its own, since scores of different decoders have no common scale; the mean of the curves
    encloses the mean of the folds' AUC. Where a curve rises straight up, the middle of the rise counts. Folds that lack
    a class are left out.

    Args:
        labels: ndarray, shape (n_trials,), true for class 2.
        splits: The folds.
        scores: Of each fold's held-out trials.

    Returns:
        ndarray, shape (101,), shares; NaN where no fold has both classes.
    """
    found = (_roc(labels[s.test], v) for s, v in zip(splits, scores, strict=True))
    curves = [curve for curve in found if curve is not None]
    return np.mean(curves, axis=0) if curves else np.full(len(FALSE_POSITIVES), np.nan)


def _roc(labels: np.ndarray, scores: np.ndarray) -> np.ndarray | None:
    """Return one fold's curve at FALSE_POSITIVES; None where it lacks a class."""
    n_second = int(np.count_nonzero(labels))
    n_first = len(labels) - n_second
    if not n_first or not n_second:
        return None
    order = np.argsort(-scores, kind="stable")
    # Trials with equal scores are found together.
    last = np.r_[np.flatnonzero(np.diff(scores[order])), len(order) - 1]
    found = np.cumsum(labels[order])[last]
    false, true = np.r_[0, last + 1 - found] / n_first, np.r_[0, found] / n_second
    # At a rise interpolation takes its end; seen from behind, its start.
    upper = np.interp(FALSE_POSITIVES, false, true)
    lower = 1 - np.interp(1 - FALSE_POSITIVES, 1 - false[::-1], 1 - true[::-1])
    return (upper + lower) / 2


def fold_rates(labels: np.ndarray, splits: Sequence[Split], scores: Sequence[np.ndarray]) -> FoldRates:
    """Return the rates of each split's held-out trials."""
    return FoldRates(np.array([rates(labels[s.test], v) for s, v in zip(splits, scores, strict=True)]))


def pooled_bacc(labels: np.ndarray, score_table: np.ndarray, among: np.ndarray | None = None) -> float:
    """Return the balanced accuracy over all repeats together, as a fraction; NaN where a class is absent.

    Args:
        labels: ndarray, shape (n_trials,), true for class 2.
        score_table: ndarray, shape (n_repeats, n_trials), from :func:`.crossval.by_repeat`.
        among: ndarray, shape (n_trials,): count these trials only (a stratum).
    """
    chosen = np.ones(len(labels), dtype=bool) if among is None else among
    if not (chosen & labels).any() or not (chosen & ~labels).any():
        return float("nan")
    second = score_table > 0
    tpr = second[:, chosen & labels].mean()
    tnr = 1 - second[:, chosen & ~labels].mean()
    return float(tnr + tpr) / 2
