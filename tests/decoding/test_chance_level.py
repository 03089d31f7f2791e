"""Rates and chance: against scikit-learn and SciPy, the paper's 54.3 %, and a permutation test that holds its size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.decoding import chance, crossval, decoders, metrics


@given(seed=st.integers(0, 10_000), n=st.integers(4, 60), digits=st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_rates_as_scikit_learn_has_them(seed, n, digits):
    from sklearn.metrics import accuracy_score, balanced_accuracy_score, recall_score, roc_auc_score

    rng = np.random.default_rng(seed)
    labels = rng.permutation(np.arange(n) < rng.integers(1, n))
    scores = rng.normal(size=n).round(digits)  # coarse digits make ties
    tnr, tpr, acc, bacc, area = metrics.rates(labels, scores)
    decided = scores > 0
    assert tpr == pytest.approx(recall_score(labels, decided))
    assert tnr == pytest.approx(recall_score(labels, decided, pos_label=False))
    assert acc == pytest.approx(accuracy_score(labels, decided))
    assert bacc == pytest.approx(balanced_accuracy_score(labels, decided))
    assert area == pytest.approx(roc_auc_score(labels, scores))


def test_a_missing_class_gives_nan_and_no_warning():
    tnr, tpr, acc, bacc, area = metrics.rates(np.array([True, True]), np.array([1.0, -1.0]))
    assert (tpr, acc) == (0.5, 0.5)
    assert np.isnan([tnr, bacc, area]).all()


def test_chance_level_of_one_problem():
    # Of 389 guesses 211 or more are right in just over 5 % of cases, 210 is the 95 % quantile.
    from scipy.stats import binom

    level = chance.chance_level(389)
    assert binom.cdf(round(level * 389), 389, 0.5) >= 0.95 > binom.cdf(round(level * 389) - 1, 389, 0.5)
    for n in range(1, 900):
        assert chance.chance_level(n) == binom.ppf(0.95, n, 0.5) / n


def test_permutation_within_blocks_keeps_each_blocks_labels():
    rng = np.random.default_rng(0)
    blocks = rng.integers(0, 4, 200)
    labels = rng.random(200) < 0.3
    shuffled = chance.permute_within(labels, blocks, rng)
    assert not np.array_equal(shuffled, labels)
    for block in range(4):
        assert shuffled[blocks == block].sum() == labels[blocks == block].sum()


def test_a_block_effect_alone_is_not_significant():
    # All of the signal is which block a trial is from: exchanging labels within blocks must not call it decoding.
    blocks = np.repeat([0, 1], 60)
    labels = np.r_[np.arange(60) < 50, np.arange(60) < 10]
    rows = blocks[:, None] * 5.0 + np.random.default_rng(1).normal(size=(120, 3))
    p = p_value(rows, labels, blocks)
    assert p > 0.2
    assert p_value(rows, labels, np.zeros(120, dtype=int)) == pytest.approx(1 / 40)


def test_a_clear_effect_has_the_smallest_p():
    labels = np.arange(60) % 2 == 0
    rows = labels[:, None] * 4.0 + np.random.default_rng(0).normal(size=(60, 5))
    assert p_value(rows, labels, np.zeros(60, dtype=int)) == pytest.approx(1 / 40)


def test_the_permutation_test_holds_its_size():
    rng = np.random.default_rng(3)
    p = []
    for _ in range(1000):
        rows, labels = rng.normal(size=(24, 3)), rng.permutation(24) < 10
        p.append(p_value(rows, labels, np.zeros(24, dtype=int), n=19, folds=3))
    # Under no effect p <= 0.05 in at most 5 % of studies; equal accuracies make it a little fewer.
    assert 0.035 <= np.mean(np.array(p) <= 0.05) <= 0.065
    assert 0.5 <= np.mean(p) <= 0.56


def p_value(rows, labels, blocks, *, n=39, folds=5):
    decoder = decoders.rlda(rows, shrinkage=0.5)

    rng, found = np.random.default_rng(0), []
    for shuffled in chance.labellings(labels, blocks, n_permutations=n, rng=rng):
        splits = crossval.shuffled_splits(shuffled, n_folds=folds, n_repeats=1, how="undersample", rng=rng)
        found.append(metrics.pooled_bacc(shuffled, crossval.by_repeat(splits, decoder(shuffled, splits), len(rows))))
    return chance.permutation_test(found).p
