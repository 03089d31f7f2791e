"""Group statistics: exact sign flips, Holm, and what a study of this size can detect."""

import itertools

import numpy as np
import pytest

from hrcneuro.decoding import group


def test_all_flips_by_hand():
    values = np.array([1.0, -0.5, 2.0, 0.7])
    sums = [np.dot(signs, values) for signs in itertools.product([1, -1], repeat=4)]
    rng = np.random.default_rng(0)
    assert group.sign_flip_p(values, rng) == np.mean(np.array(sums) >= values.sum() - 1e-12)
    two = np.mean(np.abs(sums) >= abs(values.sum()) - 1e-12)
    assert group.sign_flip_p(values, rng, two_sided=True) == two


def test_eleven_subjects_above_chance():
    rng = np.random.default_rng(0)
    assert group.sign_flip_p(np.linspace(1, 6, 11), rng) == 1 / 2048
    assert group.sign_flip_p(np.r_[np.linspace(1, 6, 11), np.nan], rng) == 1 / 2048
    assert np.isnan(group.sign_flip_p(np.array([np.nan]), rng))


def test_many_subjects_are_sampled():
    values = np.random.default_rng(1).normal(0.5, 1, 24)
    from scipy.stats import ttest_1samp

    p = group.sign_flip_p(values, np.random.default_rng(0))
    assert p == pytest.approx(ttest_1samp(values, 0, alternative="greater").pvalue, abs=0.005)


@pytest.mark.parametrize(("two_sided", "attained"), [(False, 25 / 512), (True, 24 / 512)])
def test_the_size_of_the_test(two_sided, attained):
    rng = np.random.default_rng(2)
    p = [group.sign_flip_p(x, rng, two_sided=two_sided) for x in rng.normal(size=(4000, 9))]
    assert np.mean(np.array(p) <= 0.05) == pytest.approx(attained, abs=0.01)


def test_holm_by_hand():
    # Holm 1979: 0.01 x 4, 0.02 x 3, 0.03 x 2, 0.5, made monotone.
    assert group.holm([0.5, 0.01, 0.03, 0.02]) == pytest.approx([0.5, 0.04, 0.06, 0.06])
    assert group.holm([0.9, 0.8]) == pytest.approx([1.0, 1.0])
    assert np.isnan(group.holm([0.01, np.nan])[1])
    assert group.holm([0.01, np.nan])[0] == 0.01
    assert len(group.holm([])) == 0


def test_the_family_wise_error_holds():
    rng = np.random.default_rng(4)
    wrong = [
        (group.holm([group.sign_flip_p(x, rng) for x in study]) <= 0.05).any()
        for study in rng.normal(size=(1000, 4, 8))
    ]
    assert np.mean(wrong) == pytest.approx(0.05, abs=0.02)


def test_the_detectable_effect_is_detected_in_four_of_five_studies():
    from scipy.stats import ttest_1samp

    rng = np.random.default_rng(0)
    effect = group.spread(50 + np.array([-1.0, 0, 1] * 4)[:11]).detectable - 50
    sd = np.array([-1.0, 0, 1] * 4)[:11].std(ddof=1)
    studies = rng.normal(effect, sd, (4000, 11))
    found = ttest_1samp(studies, 0, axis=1, alternative="greater").pvalue < 0.05
    assert found.mean() == pytest.approx(0.8, abs=0.02)


def test_small_groups_have_no_spread_and_no_warning():
    assert group.spread(np.array([])).n == 0
    one = group.spread(np.array([55.0]))
    assert one.mean == 55
    assert np.isnan([one.sd, one.detectable]).all()
    assert np.isfinite(group.spread(np.array([55.0, 50, 52])).detectable)


def test_a_mean_above_100_is_not_called_detectable():
    # Three subjects from 25 to 75 %: the test would need a mean of 107.
    assert np.isnan(group.spread(np.array([25.0, 50, 75])).detectable)
    assert 95 < group.spread(np.array([30.0, 50, 70])).detectable < 100
