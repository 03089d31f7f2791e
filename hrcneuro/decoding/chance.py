"""Chance: the sample-size adjusted level of the paper, and a permutation p value that knows the blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PermutationTest:
    """The true labelling's statistic, and the share of labellings whose statistic reaches it."""

    statistic: float
    p: float


def chance_level(n_trials: int, *, quantile: float = 0.95) -> float:
    """Return the accuracy that guessing exceeds with probability 1 − ``quantile``: binom.ppf(q, n, ½) / n.

    ``n_trials`` is both classes of one problem in one scenario: over the study's logs the mean is 54.27 %, printed as
    54.3 % (paper 2.6.2).
    """
    # scipy.stats.binom, which says the same, takes longer to import than all decoding takes to run.
    from scipy.special import bdtr

    return float(np.searchsorted(bdtr(np.arange(n_trials + 1), n_trials, 0.5), quantile)) / n_trials


def permutation_test(statistics: Sequence[float]) -> PermutationTest:
    """Return the true statistic, and the share of labellings that reach it.

    The true labelling counts as one of them, so p ≥ 1 / number of labellings.

    Args:
        statistics: The decoder's result for each of :func:`labellings`; larger is better.
    """
    true = statistics[0]
    return PermutationTest(true, sum(value >= true for value in statistics) / len(statistics))


def labellings(
    labels: np.ndarray, blocks: np.ndarray, *, n_permutations: int, rng: np.random.Generator
) -> Iterator[np.ndarray]:
    """Yield the true labels, then ``n_permutations`` times the labels permuted within block.

    Within blocks, since the conditions' shares and the signal both drift from block to block. Whoever draws folds from
    the same ``rng`` in between treats a permuted labelling as the true one.

    Args:
        labels: ndarray, shape (n_trials,), true for class 2.
        blocks: ndarray, shape (n_trials,): labels are exchanged between trials of equal value only.
        n_permutations: How many.
        rng: Generator.
    """
    yield labels
    for _ in range(n_permutations):
        yield permute_within(labels, blocks, rng)


def permute_within(labels: np.ndarray, blocks: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the labels shuffled within each block."""
    order = np.lexsort((rng.random(len(labels)), blocks))
    home = np.argsort(blocks, kind="stable")
    shuffled = np.empty_like(labels)
    shuffled[home] = labels[order]
    return shuffled
