"""The study's classifier: its formula, its unit, and the fast path that must decide alike on every trial."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.decoding import crossval, decoders, fast, features, lda

# Trials a class and subject as the logs' means have them: sC and iC, HH/HR and RR/RH.
STUDY = ((335, 62), (295, 59), (276, 87), (236, 153))


def problem(n1: int, n2: int, seed: int, *, n_features: int = 405, effect: float = 0.0):
    """Return correlated features in microvolt with an offset, and shuffled labels."""
    rng = np.random.default_rng(seed)
    mixing = rng.standard_normal((n_features, n_features)) / np.sqrt(n_features)
    rows = rng.standard_normal((n1 + n2, n_features)) * np.linspace(12, 0.3, n_features) @ mixing + 3.0
    labels = rng.permutation(np.arange(n1 + n2) < n2)
    rows[labels] += effect
    return rows, labels


def splits_of(labels, seed, *, how="undersample", n_folds=10, n_repeats=2):
    rng = np.random.default_rng(seed)
    return crossval.shuffled_splits(labels, n_folds=n_folds, n_repeats=n_repeats, how=how, rng=rng)


def test_two_features_by_hand():
    rows = np.array([[0.0, 0], [2, 0], [1, 1], [5, 4], [7, 4], [6, 7]])
    labels = np.array([False] * 3 + [True] * 3)
    # Class covariances (n - 1): [[1, 0], [0, 1/3]] and [[1, 0], [0, 3]]; means (1, 1/3) and (6, 5).
    spread = 0.5 * np.array([[2, 0], [0, 10 / 3]]) + 2 * 0.5 * np.eye(2)
    expected = np.array([5, 14 / 3]) / np.diag(spread)
    weights, bias = lda.discriminant(rows, labels, shrinkage=0.5)
    assert weights == pytest.approx(expected)
    assert bias == pytest.approx(-0.5 * expected @ [7, 16 / 3])


def test_the_threshold_is_the_midpoint_of_the_means():
    rows, labels = problem(30, 30, 1, n_features=20, effect=2.0)
    weights, bias = lda.discriminant(rows, labels, shrinkage=0.9)
    scores = rows @ weights + bias
    assert scores[labels].mean() == pytest.approx(-scores[~labels].mean())
    assert scores[labels].mean() > 0


def test_the_identity_has_a_unit():
    # In volts the identity swamps the covariances: the weights become the difference of the means.
    rows, labels = problem(40, 40, 2, n_features=30, effect=1.0)
    difference = rows[labels].mean(axis=0) - rows[~labels].mean(axis=0)
    volts, _ = lda.discriminant(rows * 1e-6, labels, shrinkage=0.9)
    micro, _ = lda.discriminant(rows, labels, shrinkage=0.9)
    assert np.corrcoef(volts, difference)[0, 1] == pytest.approx(1)
    assert np.corrcoef(micro, difference)[0, 1] < 0.95


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("how", ["undersample", "oversample", "none"])
def test_the_fast_path_decides_as_the_plain_loop(seed, how):
    rows, labels = problem(90, 31, seed, effect=0.2)
    splits = splits_of(labels, seed, how=how)
    plain = np.concatenate(decoders.plain_rlda(rows, shrinkage=0.9)(labels, splits))
    quick = np.concatenate(decoders.rlda(rows, shrinkage=0.9)(labels, splits))
    assert np.array_equal(plain > 0, quick > 0)
    assert quick == pytest.approx(plain, abs=1e-9 * np.abs(plain).max())


@pytest.mark.parametrize("seed", range(3))
def test_the_same_labels_on_every_trial_at_the_study_size(seed):
    differing = 0
    for n1, n2 in STUDY:
        rows, labels = problem(n1, n2, seed)
        splits = splits_of(labels, seed, n_repeats=1)
        plain = np.concatenate(decoders.plain_rlda(rows, shrinkage=0.9)(labels, splits))
        quick = np.concatenate(decoders.rlda(rows, shrinkage=0.9)(labels, splits))
        differing += int(np.count_nonzero((plain > 0) != (quick > 0)))
    assert differing == 0


@given(
    n1=st.integers(4, 25),
    n2=st.integers(4, 25),
    n_features=st.integers(1, 40),
    shrinkage=st.floats(0.05, 0.99),
    how=st.sampled_from(["undersample", "oversample", "none"]),
    seed=st.integers(0, 2**32),
)
@settings(max_examples=60, deadline=None)
def test_fast_equals_plain_for_any_shape(n1, n2, n_features, shrinkage, how, seed):
    rows, labels = problem(n1, n2, seed, n_features=n_features)
    splits = splits_of(labels, seed, how=how, n_folds=3, n_repeats=1)
    # Drawn with replacement, a class may consist of one trial alone: the identity still keeps the system solvable.
    plain = np.concatenate(decoders.plain_rlda(rows, shrinkage=shrinkage)(labels, splits))
    quick = np.concatenate(decoders.rlda(rows, shrinkage=shrinkage)(labels, splits))
    assert quick == pytest.approx(plain, abs=1e-7 * max(1.0, np.abs(plain).max()))


def test_full_shrinkage_takes_the_plain_path():
    rows, labels = problem(12, 12, 0, n_features=8)
    splits = splits_of(labels, 0, n_folds=3)
    with pytest.raises(ValueError, match="shrinkage = 1"):
        fast.rlda_scores(fast.gram(rows), labels, splits, shrinkage=1.0)
    assert len(decoders.rlda(rows, shrinkage=1.0)(labels, splits)) == len(splits)


@pytest.mark.parametrize("how", ["undersample", "oversample", "none"])
@pytest.mark.parametrize("counts", [STUDY[0], STUDY[-1], (30, 30)])
def test_permutations_decide_as_the_fast_path(counts, how):
    """From the trials that are left out or from those that train, whichever are fewer; one inverse for all labels."""
    rows, labels = problem(*counts, 3, n_features=60)
    permuted = decoders.permuted_rlda(rows, shrinkage=0.9)
    for seed in range(2):
        labels = np.random.default_rng(seed).permutation(labels)
        splits = splits_of(labels, seed, how=how)
        expected = decoders.rlda(rows, shrinkage=0.9)(labels, splits)
        for found, right in zip(permuted(labels, splits), expected, strict=True):
            assert found == pytest.approx(right, abs=1e-10 * np.abs(right).max())
            assert ((found > 0) == (right > 0)).all()


def test_permutations_without_covariances_take_the_plain_loop():
    rows, labels = problem(12, 12, 0, n_features=8)
    splits = splits_of(labels, 0, n_folds=3)
    found = decoders.permuted_rlda(rows, shrinkage=1.0)(labels, splits)
    plain = decoders.plain_rlda(rows, shrinkage=1.0)(labels, splits)
    assert all(np.array_equal(a, b) for a, b in zip(found, plain, strict=True))


def test_noise_of_eeg_size_stays_at_chance():
    rng = np.random.default_rng(5)
    t = np.arange(-26, 154) / 128
    found = []
    for seed in range(6):
        data = rng.normal(0, 10, (160, 27, len(t)))
        labels = rng.permutation(160) < 60
        rows = features.window_means(data, t)
        table = crossval.by_repeat(
            splits := splits_of(labels, seed), decoders.rlda(rows, shrinkage=0.9)(labels, splits), len(labels)
        )
        found.append(((table > 0) == labels).mean())
    assert abs(np.mean(found) - 0.5) < 0.03
