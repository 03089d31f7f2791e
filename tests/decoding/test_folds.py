"""Folds: every trial held out once a repeat, no trial on both sides, both classes everywhere, training balanced."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.decoding import crossval, decoders, features, metrics

counts = st.tuples(st.integers(3, 60), st.integers(3, 60))


def labels_of(n1: int, n2: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).permutation(np.arange(n1 + n2) < n2)


@given(counts=counts, seed=st.integers(0, 1000), how=st.sampled_from(["undersample", "oversample", "none"]))
@settings(max_examples=60, deadline=None)
def test_folds_are_a_stratified_partition(counts, seed, how):
    labels = labels_of(*counts, seed)
    n_folds = crossval.feasible_folds(labels, 10)
    splits = crossval.shuffled_splits(labels, n_folds=n_folds, n_repeats=2, how=how, rng=np.random.default_rng(seed))
    for repeat in range(2):
        tests = [s.test for s in splits if s.repeat == repeat]
        assert sorted(np.concatenate(tests)) == list(range(len(labels)))
        assert np.ptp([len(t) for t in tests]) <= 1
        assert np.ptp([labels[t].sum() for t in tests]) <= 1
        assert all(labels[t].any() and not labels[t].all() for t in tests)
    for s in splits:
        assert not set(s.train) & set(s.test)
        second = labels[s.train]
        assert np.array_equal(np.sort(second), second), "class 1 comes first"
        rest = np.setdiff1d(np.arange(len(labels)), s.test)
        sizes = np.bincount(labels[rest].astype(int))
        wanted = {"undersample": [min(sizes)] * 2, "oversample": [max(sizes)] * 2, "none": list(sizes)}[how]
        assert list(np.bincount(second.astype(int))) == wanted
        assert how == "oversample" or len(set(s.train)) == len(s.train)


def test_undersampling_draws_anew_each_time():
    labels = labels_of(40, 10)
    splits = crossval.shuffled_splits(labels, n_folds=5, n_repeats=3, how="undersample", rng=np.random.default_rng(0))
    assert len({tuple(s.train) for s in splits}) == len(splits)


@pytest.mark.parametrize(
    ("n1", "n2", "folds"), [(50, 50, 10), (50, 9, 9), (3, 90, 3), (2, 90, 0), (0, 90, 0), (0, 0, 0)]
)
def test_too_few_trials_give_fewer_folds_or_none(n1, n2, folds):
    assert crossval.feasible_folds(labels_of(n1, n2), 10) == folds


def test_blocks_are_left_out_whole():
    labels = labels_of(60, 30)
    blocks = np.repeat([2, 4, 8], 30)
    splits = crossval.block_splits(labels, blocks, n_repeats=2, how="undersample", rng=np.random.default_rng(0))
    assert len(splits) == 6
    for s in splits:
        assert len(set(blocks[s.test])) == 1
        assert not set(blocks[s.train]) & set(blocks[s.test])


@pytest.mark.parametrize("blocks", [[1] * 20, [1] * 10 + [2] * 10])
def test_blocks_that_leave_a_class_empty_give_no_folds(blocks):
    labels = np.arange(20) < 10
    assert not crossval.block_splits(labels, np.array(blocks), n_repeats=1, how="none", rng=np.random.default_rng(0))


def noise_features(n_trials: int, rng: np.random.Generator) -> np.ndarray:
    """Return the features of 1/f noise, 1-40 Hz, 10 microvolt RMS, correlated between 27 neighbouring channels."""
    freqs = np.fft.rfftfreq(256, 1 / 128)
    shape = np.where((freqs >= 1) & (freqs <= 40), np.maximum(freqs, 1) ** -0.5, 0)
    data = np.fft.irfft(np.fft.rfft(rng.normal(size=(n_trials, 27, 256))) * shape)[:, :, 38:218]
    data = np.exp(-np.abs(np.subtract.outer(np.arange(27), np.arange(27))) / 6) @ data
    data = 10 * data / data.std() + rng.normal(0, 2, data.shape)
    return features.window_means(data - data.mean(axis=1, keepdims=True), np.arange(-26, 154) / 128)


def noise_rates(how: str, subjects: int) -> np.ndarray:
    """Return TNR, TPR, ACC on pure noise at the logs' sC counts of HH against HR, in percent."""
    found = []
    for seed in range(subjects):
        rng = np.random.default_rng([seed, 7])
        rows, labels = noise_features(397, rng), labels_of(335, 62, seed)
        splits = crossval.shuffled_splits(labels, n_folds=10, n_repeats=1, how=how, rng=rng)
        scores = decoders.rlda(rows, shrinkage=0.9)(labels, splits)
        found.append(metrics.fold_rates(labels, splits, scores).values[:, :3].mean(axis=0))
    return 100 * np.mean(found, axis=0)


def test_undersampling_is_unbiased_on_noise():
    # At chance means |mean - 50| <= 2.5 over at least 11 subjects (design/eeg.md).
    tnr, tpr, acc = noise_rates("undersample", 11)
    assert abs(tnr - 50) < 2.5
    assert abs(tpr - 50) < 4
    assert abs(acc - 50) < 2.5


def test_oversampling_looks_good_on_noise():
    # Measured once, independently: TNR 72.8, TPR 30.4, ACC 66.1 % on pure noise.
    tnr, tpr, acc = noise_rates("oversample", 6)
    assert tnr == pytest.approx(72.8, abs=6)
    assert tpr == pytest.approx(30.4, abs=6)
    assert acc == pytest.approx(66.1, abs=6)


@given(onsets=st.lists(st.floats(0, 5), min_size=1, max_size=60))
@settings(max_examples=60, deadline=None)
def test_no_two_trials_are_one_event_and_none_is_left_out_in_vain(onsets):
    onsets = np.array(onsets)
    own = crossval.distinct(onsets)
    kept = np.sort(onsets[own])
    assert (np.diff(kept) >= crossval.ONE_EVENT_S - 1e-6).all()
    for left in onsets[~own]:
        assert (np.abs(kept - left) < crossval.ONE_EVENT_S).any()


def test_ten_events_a_second_are_events_of_their_own():
    assert crossval.distinct(1 + np.arange(100) / 10).all()
