import itertools

import mne
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from hrcneuro.eeg import permutation
from hrcneuro.eeg.permutation import cluster_test, extremes, extremes_plain, sign_flip_test, sign_patterns, smallest_p


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("n", [2, 3, 7, 11])
def test_exact_patterns_and_their_opposites_are_all_there_are(n):
    signs, exact = sign_patterns(n, rng(), exact_to=16, count=10)
    assert exact
    assert (signs[0] == 1).all()
    found = {tuple(s) for s in np.concatenate([signs, -signs])}
    assert found == set(itertools.product([-1.0, 1.0], repeat=n))
    assert len(signs) == 2 ** (n - 1)


def test_random_patterns_are_seeded_and_keep_the_identity():
    signs, exact = sign_patterns(20, rng(1), exact_to=16, count=1000)
    again, _ = sign_patterns(20, rng(1), exact_to=16, count=1000)
    assert not exact
    assert signs.shape == (500, 20)
    assert (signs[0] == 1).all()
    np.testing.assert_array_equal(signs, again)
    assert abs(signs[1:].mean()) < 0.05


@pytest.mark.parametrize("shape", [(5, 3), (8, 4, 30), (11, 3, 5, 40), (9, 1300)])
def test_fast_extremes_equal_the_plain_ones(shape):
    x = rng(2).standard_normal(shape)
    signs, _ = sign_patterns(shape[0], rng(), exact_to=16, count=10)
    for fast, plain in zip(extremes(x, signs), extremes_plain(x, signs), strict=True):
        np.testing.assert_allclose(fast, plain, rtol=1e-10)


def test_extremes_that_single_precision_cannot_tell_apart_are_exact():
    one = rng(6).standard_normal((9, 4)).repeat(2000, axis=1)  # each column, in several blocks of the product
    x = one * (1 + 1e-9 * rng(7).standard_normal(one.shape))
    assert len({*map(bytes, x.astype(np.float32).T)}) < x.shape[1] / 10
    signs, _ = sign_patterns(9, rng(), exact_to=16, count=10)
    for fast, plain in zip(extremes(x, signs), extremes_plain(x, signs), strict=True):
        np.testing.assert_allclose(fast, plain, rtol=1e-11)


def test_thresholds_and_p_follow_from_all_flips_by_definition():
    x = rng(3).standard_normal((7, 12)) + np.linspace(0, 1.5, 12)
    found = sign_flip_test(x, rng())
    every = np.array(list(itertools.product([-1.0, 1.0], repeat=7)))
    lows, highs = extremes_plain(x, every)
    t = stats.ttest_1samp(x, 0).statistic
    np.testing.assert_allclose(found.t, t, rtol=1e-10)
    slack = 1e-9
    upper = np.array([(highs >= v - slack).mean() for v in t])
    lower = np.array([(lows <= v + slack).mean() for v in t])
    np.testing.assert_allclose(found.p, np.minimum(2 * np.minimum(upper, lower), 1), rtol=1e-12)
    # 2.5 % of 128 flips: at most 3 may reach a significant t.
    assert found.high == pytest.approx(np.sort(highs)[-4])
    assert found.low == pytest.approx(np.sort(lows)[3])
    np.testing.assert_array_equal(found.significant, (t > found.high + slack) | (t < found.low - slack))
    np.testing.assert_array_equal(found.significant, found.p <= 0.05)
    assert found.flips == 128


def test_thresholds_lie_at_the_percentiles_of_the_paper():
    x = rng(4).standard_normal((11, 20, 30))
    found = sign_flip_test(x, rng())
    signs, _ = sign_patterns(11, rng(), exact_to=16, count=10)
    lows, highs = extremes_plain(x, np.concatenate([signs, -signs]))
    assert found.high == pytest.approx(np.percentile(highs, 97.5), rel=0.01)
    assert found.low == pytest.approx(np.percentile(lows, 2.5), rel=0.01)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**16), scale=st.floats(1e-6, 1e6), n=st.integers(6, 9))
def test_symmetries(seed, scale, n):
    x = rng(seed).standard_normal((n, 3, 8)) + 0.5
    found = sign_flip_test(x, rng())
    turned = sign_flip_test(-scale * x, rng())
    shuffled = sign_flip_test(x[rng(seed).permutation(n)], rng())
    np.testing.assert_allclose(turned.t, -found.t, rtol=1e-7)
    np.testing.assert_allclose(turned.p, found.p)
    np.testing.assert_allclose(shuffled.p, found.p)
    assert turned.high == pytest.approx(found.high)


def test_more_points_never_make_a_point_more_significant():
    x = rng(5).standard_normal((8, 40))
    x[:, 0] += 1.5
    few, many = sign_flip_test(x[:, :10], rng()), sign_flip_test(x, rng())
    assert (many.p[:10] >= few.p).all()


def test_family_wise_error_is_five_percent():
    random = rng(6)
    hits = []
    for _ in range(1500):
        smooth = np.cumsum(random.standard_normal((9, 4, 15)), axis=-1) * 0.3 + random.standard_normal((9, 4, 15))
        hits.append(sign_flip_test(smooth, random).significant.any())
    assert 0.035 <= np.mean(hits) <= 0.065


def test_family_wise_error_of_random_flips():
    random = rng(7)
    hits = [sign_flip_test(random.standard_normal((20, 10)), random, count=400).significant.any() for _ in range(1500)]
    assert 0.035 <= np.mean(hits) <= 0.065


def test_an_effect_is_found_where_it_is():
    x = rng(8).standard_normal((11, 6, 50))
    x[:, 2, 20:24] += 4
    found = sign_flip_test(x, rng())
    assert found.significant[2, 20:24].all()
    assert found.significant.sum() == 4


@pytest.mark.parametrize("n", [2, 3, 5])
def test_few_subjects_can_never_be_significant(n):
    x = 100 + rng(9).standard_normal((n, 4))
    found = sign_flip_test(x, rng())
    assert not found.significant.any()
    assert found.high == np.inf
    assert found.p.min() == pytest.approx(smallest_p(n))
    assert smallest_p(n) > 0.05


def test_constant_points_give_no_nan():
    x = rng(10).standard_normal((8, 4))
    x[:, 0] = 0
    x[:, 1] = 3
    found = sign_flip_test(x, rng())
    assert found.t[0] == 0
    assert found.p[0] == 1
    assert found.t[1] > 1e6
    assert found.significant[1]
    assert not np.isnan(found.p).any()


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="at least 2 subjects, got 1"):
        sign_flip_test(np.zeros((1, 3)), rng())
    with pytest.raises(ValueError, match="NaN or infinity"):
        sign_flip_test(np.array([[1.0], [np.nan]]), rng())
    with pytest.raises(ValueError, match="NaN or infinity"):
        cluster_test(np.array([[1.0], [np.inf]]), None)


def test_cluster_test_is_mnes():
    x = rng(11).standard_normal((8, 4, 15))
    x[:, 1:3, 5:9] += 1.2
    adjacency = mne.stats.combine_adjacency(4, 15)
    found = cluster_test(x, adjacency)
    threshold = stats.t.ppf(0.975, 7)
    t, clusters, p, _ = mne.stats.permutation_cluster_1samp_test(
        x.reshape(8, -1), threshold=threshold, n_permutations=2**7, adjacency=adjacency, verbose="error"
    )
    np.testing.assert_allclose(found.t.ravel(), t, rtol=1e-10)
    for (members, *_), value in zip(clusters, p, strict=True):
        np.testing.assert_allclose(found.p.ravel()[members], value)
    assert found.significant[1:3, 6:8].all()
    assert (found.p.ravel()[np.abs(t) <= threshold] == 1).all()
    assert found.high == pytest.approx(threshold)


def test_exact_cluster_test_does_not_draw():
    x = rng(15).standard_normal((7, 3, 10))
    adjacency = mne.stats.combine_adjacency(3, 10)
    one, two = (cluster_test(x, adjacency, seed=seed) for seed in (1, 2))
    np.testing.assert_array_equal(one.p, two.p)
    assert one.exact


def test_cluster_test_with_random_flips_is_seeded():
    x = rng(12).standard_normal((20, 12)) + 0.3
    adjacency = mne.stats.combine_adjacency(12)
    one, two = (cluster_test(x, adjacency, exact_to=8, count=100, seed=5) for _ in range(2))
    np.testing.assert_array_equal(one.p, two.p)
    assert not one.exact


def test_cluster_test_without_any_cluster():
    found = cluster_test(np.tile([[1.0], [-1.0]], (4, 6)), mne.stats.combine_adjacency(6))
    assert (found.p == 1).all()


def test_family_wise_error_of_clusters():
    # 3 of 64 flips: 4.7 %.
    random, adjacency = rng(13), mne.stats.combine_adjacency(2, 6)
    hits = [cluster_test(random.standard_normal((7, 2, 6)), adjacency).significant.any() for _ in range(1000)]
    assert 0.035 <= np.mean(hits) <= 0.065


def test_the_scaled_sum_is_students_t():
    x = rng(14).standard_normal((6, 5))
    np.testing.assert_allclose(permutation.t_values(x), stats.ttest_1samp(x, 0).statistic, rtol=1e-12)
