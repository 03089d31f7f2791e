import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.eeg import morlet, morlet_means
from hrcneuro.eeg.morlet import Wavelets, linear_cycles

FREQUENCIES = tuple(np.arange(2.0, 31.0, 2.0))


def paper(sfreq, frequencies=FREQUENCIES):
    return Wavelets(frequencies, linear_cycles(frequencies, first=2, last=10), sfreq)


def worst(data, masks, wavelets, step):
    plain = morlet.mean_magnitudes(data, masks, wavelets, step=step)
    fast = morlet_means.mean_magnitudes(data, masks, wavelets, step=step)
    assert fast.shape == plain.shape
    return (np.abs(fast - plain) / plain).max()


@pytest.mark.parametrize(
    ("sfreq", "n_times", "step"),
    [
        (512.0, 717, 2),
        (512.0, 718, 2),
        (500.0, 701, 3),
        (128.0, 180, 2),
        (125.0, 176, 1),
        (61.0, 90, 2),
        (1000.0, 900, 4),
    ],
)
def test_equals_the_plain_means_at_any_rate(sfreq, n_times, step):
    rng = np.random.default_rng(5)
    data = rng.standard_normal((20, 3, n_times))
    masks = rng.random((4, 20)) < 0.4
    assert worst(data, masks, paper(sfreq), step) < 1e-5


@settings(max_examples=30, deadline=None)
@given(
    sfreq=st.floats(40, 300),
    n_times=st.integers(2, 200),
    step=st.integers(1, 5),
    low=st.floats(0.5, 8),
    high=st.floats(9, 19.9),
    cycles=st.floats(1.5, 12),
    length=st.floats(0.2, 2),
)
def test_equals_the_plain_means_for_any_wavelets(sfreq, n_times, step, low, high, cycles, length):
    wavelets = Wavelets((low, high), (2.0, cycles), sfreq, length)
    data = np.random.default_rng(6).standard_normal((4, 2, n_times))
    masks = np.array([[1, 1, 1, 0], [0, 0, 1, 1]], bool)
    plain = morlet.mean_magnitudes(data, masks, wavelets, step=step)
    fast = morlet_means.mean_magnitudes(data, masks, wavelets, step=step)
    assert np.abs(fast - plain).max() < 1e-5 * plain.max()


def test_offsets_drifts_and_strong_slow_waves_do_not_hurt():
    rng = np.random.default_rng(7)
    t = np.arange(717) / 512
    data = (
        rng.standard_normal((24, 4, 717)) + 30 * np.sin(2 * np.pi * 10 * t) + rng.uniform(-50, 50, (24, 4, 1)) * (1 + t)
    )
    assert worst(data, np.ones((1, 24), bool), paper(512.0), 2) < 1e-4


def test_memberships_decide_and_order_does_not():
    rng = np.random.default_rng(8)
    data = rng.standard_normal((40, 2, 120))
    masks = rng.random((6, 40)) < 0.3
    wavelets = paper(100.0, (4.0, 8.0, 16.0))
    found = morlet_means.mean_magnitudes(data, masks, wavelets, step=2)
    order = rng.permutation(40)
    shuffled = morlet_means.mean_magnitudes(data[order], masks[:, order], wavelets, step=2)
    np.testing.assert_allclose(found, shuffled, rtol=1e-5)
    data[~masks.any(axis=0)] = np.nan  # trials of no condition are never looked at
    np.testing.assert_array_equal(found, morlet_means.mean_magnitudes(data, masks, wavelets, step=2))


def test_more_sets_of_memberships_than_are_held_at_a_time():
    rng = np.random.default_rng(10)
    masks = rng.random((9, 200)) < 0.5
    assert len(np.unique(masks, axis=1).T) > 2 * morlet_means.PATTERNS
    assert worst(rng.standard_normal((200, 2, 60)), masks, paper(64.0, (4.0, 9.0)), 2) < 1e-5


def test_memory_stays_far_below_the_single_trial_maps():
    data = np.random.default_rng(9).standard_normal((160, 27, 717))
    masks = np.ones((2, 160), bool)
    tracemalloc.start()
    morlet_means.mean_magnitudes(data, masks, paper(512.0), step=2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6  # the maps of these 160 trials would take 93 MB, those of a study 0.9 GB


@pytest.mark.parametrize("means", [morlet.mean_magnitudes, morlet_means.mean_magnitudes])
def test_a_condition_without_trials_is_refused(means):
    masks = np.array([[1, 1], [0, 0]], bool)
    with pytest.raises(ValueError, match=r"conditions \[1\] have no trial"):
        means(np.zeros((2, 1, 50)), masks, Wavelets((5.0,), (2.0,), 50.0))
    with pytest.raises(ValueError, match=r"masks \(1, 3\)"):
        means(np.zeros((2, 1, 50)), np.ones((1, 3), bool), Wavelets((5.0,), (2.0,), 50.0))
