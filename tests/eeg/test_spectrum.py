"""Power spectra beside SciPy's and MNE's, and where a recording is long or has breaks."""

import mne
import numpy as np
import pytest
from scipy.signal import welch

from hrcneuro.eeg.spectrum import BAND_HZ, MOST, power_spectra

SFREQ = 125.0


@pytest.fixture
def data():
    """Thirty seconds of four channels: noise on an offset, and a rhythm of 10 Hz."""
    t = np.arange(int(30 * SFREQ)) / SFREQ
    noise = np.random.default_rng(1).standard_normal((4, len(t)))
    return 1000 + noise + np.array([[0.0], [1.0], [3.0], [10.0]]) * np.sin(2 * np.pi * 10 * t)


def within(hz):
    return (hz >= BAND_HZ[0]) & (hz <= BAND_HZ[1])


@pytest.mark.parametrize("sfreq", [SFREQ, 100.0, 128.5])
def test_power_is_scipys(data, sfreq):
    hz, power = power_spectra(data, sfreq)
    expected_hz, expected = welch(data, sfreq, nperseg=int(2 * sfreq))
    np.testing.assert_allclose(hz, expected_hz[within(expected_hz)])
    np.testing.assert_allclose(power, expected[:, within(expected_hz)], rtol=1e-9)


def test_power_is_mnes(data):
    hz, power = power_spectra(data, SFREQ)
    size = int(2 * SFREQ)
    expected, expected_hz = mne.time_frequency.psd_array_welch(
        data, SFREQ, *BAND_HZ, n_fft=size, n_overlap=size // 2, window="hann", verbose="error"
    )
    np.testing.assert_allclose(hz, expected_hz)
    np.testing.assert_allclose(power, expected, rtol=1e-9)


def test_the_power_at_a_rhythm_is_its_variance(data):
    hz, power = power_spectra(data, SFREQ)
    assert hz[power[3].argmax()] == 10
    near = np.abs(hz - 10) < 2
    assert power[3, near].sum() * (hz[1] - hz[0]) == pytest.approx(10**2 / 2, rel=0.05)


def test_a_step_at_a_break_has_no_power(data):
    border = int(13.3 * SFREQ)
    stepped = data + np.where(np.arange(data.shape[1]) < border, 0.0, 1e6)
    _, power = power_spectra(stepped, SFREQ, borders=[border])
    _, whole = power_spectra(data, SFREQ)
    np.testing.assert_allclose(np.median(power, axis=1), np.median(whole, axis=1), rtol=0.2)
    _, across = power_spectra(stepped, SFREQ)
    assert across.min() > 100 * power[0].max()


def test_of_a_long_recording_windows_from_end_to_end_count():
    n = int(2 * SFREQ) // 2 * (3 * MOST)
    late = np.zeros((1, n))
    late[:, -int(4 * SFREQ) :] = np.random.default_rng(2).standard_normal(int(4 * SFREQ))
    hz, power = power_spectra(late, SFREQ)
    # Four of 1800 seconds hold the noise, whose density is 2 / sfreq.
    assert power.mean() == pytest.approx(4 / (n / SFREQ) * 2 / SFREQ, rel=0.5)
    steady = np.random.default_rng(3).standard_normal((1, n))
    _, expected = welch(steady, SFREQ, nperseg=int(2 * SFREQ))
    np.testing.assert_allclose(power_spectra(steady, SFREQ)[1], expected[:, within(hz_of(SFREQ))], rtol=0.3)
    assert hz[0] == 0.5


def hz_of(sfreq):
    return np.fft.rfftfreq(int(2 * sfreq), 1 / sfreq)


def test_a_recording_shorter_than_a_window_is_one_window(data):
    short = data[:, :150]
    hz, power = power_spectra(short, SFREQ, borders=[0, 60])
    expected_hz, expected = welch(short[:, 60:], SFREQ, nperseg=90)
    np.testing.assert_allclose(hz, expected_hz[within(expected_hz)])
    np.testing.assert_allclose(power, expected[:, within(expected_hz)], rtol=1e-9)
