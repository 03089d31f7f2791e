import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from hrcneuro.eeg import channels
from hrcneuro.eeg.refusals import NotFiniteError


def test_kurtosis_is_the_moment_ratio(monkeypatch):
    x = np.random.default_rng(0).standard_t(8, 10_000) * 20 + 300
    expected = stats.kurtosis(x, fisher=False)
    assert channels.kurtosis(x) == pytest.approx(expected, rel=1e-12)
    monkeypatch.setattr(channels, "_SLAB", 777)
    assert channels.kurtosis(x) == pytest.approx(expected, rel=1e-12)
    assert math.isnan(channels.kurtosis(np.full(10, 4.0)))


@given(st.lists(st.floats(1, 100), min_size=4, max_size=70))
@settings(deadline=None)
def test_trimmed_z_keeps_eeglabs_ranks(values):
    n = len(values)
    cut = int(n * 0.1 + 0.5)  # MATLAB rounds a half away from zero
    kept = sorted(values)[max(cut, 1) - 1 : n - cut]
    assert len(kept) == n - cut - max(cut, 1) + 1
    z = channels.trimmed_z(np.array(values))
    spread = np.std(kept, ddof=1)
    if spread > 0:
        np.testing.assert_allclose(z, (np.array(values) - np.mean(kept)) / spread, atol=1e-9 * abs(z).max())


def test_trimming_shows_what_one_channel_would_hide():
    values = np.concatenate([np.linspace(3, 3.5, 26), [3.9, 40.0]])
    plain = (values - values.mean()) / values.std(ddof=1)
    assert (np.abs(plain) > 2).sum() == 1
    assert (np.abs(channels.trimmed_z(values)) > 2).tolist() == [False] * 26 + [True, True]


def test_equal_kurtosis_makes_no_channel_bad():
    np.testing.assert_array_equal(channels.trimmed_z(np.full(10, 3.0)), np.zeros(10))


@pytest.fixture
def noise():
    return 10 * np.random.default_rng(5).standard_normal((12, 4000))


def test_bursts_are_found(noise):
    noise[3, 1000:1020] *= 30
    verdict = channels.judge(noise, 6)
    assert np.flatnonzero(verdict.bad).tolist() == [3]
    assert verdict.kurtosis[3] > 10


def test_a_flat_channel_is_bad_without_a_number_and_without_weight(noise):
    rest = channels.judge(np.delete(noise, 4, axis=0), 2)
    noise[4] = 1e-12 * noise[3]
    verdict = channels.judge(noise, 2)
    assert np.flatnonzero(verdict.flat).tolist() == [4]
    assert verdict.bad[4]
    assert math.isnan(verdict.z[4])
    assert math.isnan(verdict.kurtosis[4])
    np.testing.assert_allclose(np.delete(verdict.z, 4), rest.z)


def test_marked_channels_are_bad_and_do_not_count(noise):
    noise[0, :5] = 1e4
    marked = np.arange(12) == 0
    verdict = channels.judge(noise, 100.0, marked=marked)
    assert np.flatnonzero(verdict.bad).tolist() == [0]
    assert math.isnan(verdict.z[0])


def test_three_channels_are_too_few_to_call_one_bad(noise):
    noise[0, :5] = 1e4
    verdict = channels.judge(noise[:3], 0.1)
    assert not verdict.bad.any()
    np.testing.assert_array_equal(verdict.z, 0)


def test_average_reference(noise, monkeypatch):
    expected = noise - noise.mean(axis=0)
    monkeypatch.setattr(channels, "_SLAB", 999)
    assert channels.average_reference(noise) is noise
    np.testing.assert_allclose(noise, expected, atol=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_samples_that_are_no_numbers_are_named(noise, value):
    channels.check_finite(noise, [f"c{i}" for i in range(12)], 100.0)
    noise[5, 250:290] = value
    with pytest.raises(NotFiniteError, match=r"channel c5 .* 1\.00% .* sample 250 \(2\.500 s\)"):
        channels.check_finite(noise, [f"c{i}" for i in range(12)], 100.0)
