import numpy as np
import pytest
from scipy import stats

from hrcneuro.eeg.contrasts import effect_sizes, summarise
from hrcneuro.eeg.permutation import sign_flip_test


@pytest.mark.parametrize("points", [6, 3000])
@pytest.mark.parametrize("n", [2, 5, 11, 40])
def test_interval_inverts_the_noncentral_t(n, points):
    t = np.array([-4.0, -1.2, 0.0, 0.3, 2.2, 6.5])
    dz, low, high = (found[:6] for found in effect_sizes(np.resize(t, points), n))
    np.testing.assert_allclose(dz, t / np.sqrt(n))
    for value, a, b in zip(t, low, high, strict=True):
        for end, tail in ((a, 0.975), (b, 0.025)):
            assert stats.nct.cdf(value, n - 1, end * np.sqrt(n)) == pytest.approx(tail, abs=5e-4)


def test_interval_covers_the_true_effect_as_often_as_it_says():
    x = np.random.default_rng(0).standard_normal((11, 20_000)) + 0.6
    t = stats.ttest_1samp(x, 0).statistic
    for confidence in (0.9, 0.95):
        _, low, high = effect_sizes(t, 11, confidence=confidence)
        assert ((low <= 0.6) & (high >= 0.6)).mean() == pytest.approx(confidence, abs=0.006)


def test_infinite_t_stays_finite():
    dz, low, high = effect_sizes(np.array([np.inf, -np.inf, 0.0]), 5)
    assert np.isfinite([dz, low, high]).all()
    assert dz[0] > low[0] > 0 > high[1] > dz[1]


def test_summary_of_a_contrast():
    x = np.random.default_rng(1).standard_normal((8, 3, 5)) + 1
    test = sign_flip_test(x, np.random.default_rng(2))
    found = summarise(x, test)
    np.testing.assert_allclose(found.difference, x.mean(axis=0))
    np.testing.assert_allclose(found.sd, x.std(axis=0, ddof=1))
    np.testing.assert_allclose(found.dz, found.difference / found.sd)
    assert (found.dz_low < found.dz).all()
    assert (found.dz < found.dz_high).all()


def test_one_subject_is_described_not_tested():
    found = summarise(np.ones((1, 2, 3)), None)
    assert found.n == 1
    assert (found.difference == 1).all()
    assert np.isnan([found.sd, found.dz, found.dz_low, found.dz_high]).all()
