"""Blinks of a recording that are known."""

import numpy as np
import pytest

from hrcneuro.eeg.blinks import blink_peaks, mean_blink

SFREQ = 250.0
PEAKS_S = np.array([2.0, 4.5, 6.2, 9.0, 12.4, 15.0])


@pytest.fixture
def eog():
    """Three channels: a blink shows as 200 µV in the last one, upside down, and as a tenth of it in the others."""
    rng = np.random.default_rng(3)
    t = np.arange(int(18 * SFREQ)) / SFREQ
    blinks = sum(np.exp(-0.5 * ((t - peak) / 0.06) ** 2) for peak in PEAKS_S)
    return 5 * rng.standard_normal((3, len(t))) + np.array([[20.0], [20.0], [-200.0]]) * blinks


def test_blinks_are_found_where_they_peak_whichever_way_they_point(eog):
    np.testing.assert_allclose(blink_peaks(eog, SFREQ), PEAKS_S, atol=0.03)
    np.testing.assert_allclose(blink_peaks(-eog, SFREQ), PEAKS_S, atol=0.03)


def test_noise_has_no_blink():
    assert not len(blink_peaks(5 * np.random.default_rng(0).standard_normal((2, 5000)), SFREQ))


def test_the_mean_blink_is_as_high_as_the_blinks_and_starts_from_zero(eog):
    blink = mean_blink(eog[2:], SFREQ, PEAKS_S)
    assert len(blink) == int(SFREQ)
    assert blink[len(blink) // 2] == pytest.approx(-200, abs=15)
    assert abs(blink[: len(blink) // 8].mean()) < 1e-9


def test_a_blink_too_near_an_end_is_left_out(eog):
    np.testing.assert_array_equal(mean_blink(eog, SFREQ, np.array([0.1, 17.9])), [0, 0])
    np.testing.assert_array_equal(mean_blink(eog, SFREQ, np.array([0.1, 4.5])), mean_blink(eog, SFREQ, np.array([4.5])))
