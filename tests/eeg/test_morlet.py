import mne
import numpy as np
import pytest

from hrcneuro.eeg.morlet import Wavelets, linear_cycles, magnitudes, mean_magnitudes

FREQUENCIES = tuple(np.arange(2.0, 31.0, 2.0))
PAPER = linear_cycles(FREQUENCIES, first=2, last=10)


def paper(sfreq):
    return Wavelets(FREQUENCIES, PAPER, sfreq)


def test_kernels_are_cohens():
    # Cohen 2014, ch. 12: wavetime = -.5:1/srate:.5; s = n ./ (2*pi*f); exp(2i*pi*f*t) .* exp(-t.^2 ./ (2*s^2))
    wavelets = paper(512.0)
    t = np.linspace(-0.5, 0.5, 513)
    for frequency, cycles, kernel in zip(FREQUENCIES, PAPER, wavelets.kernels, strict=True):
        s = cycles / (2 * np.pi * frequency)
        np.testing.assert_allclose(kernel, np.exp(2j * np.pi * frequency * t) * np.exp(-(t**2) / 2 / s**2), atol=1e-12)
    assert PAPER[0] == 2
    assert PAPER[-1] == 10
    assert np.ptp(np.diff(PAPER)) < 1e-12


@pytest.mark.parametrize("sfreq", [512.0, 500.0, 128.0, 125.0, 100.5])
def test_kernels_are_centred_and_hermitian_at_any_rate(sfreq):
    wavelets = Wavelets((4.0, 10.0), (3.0, 5.0), sfreq)
    kernels = wavelets.kernels
    assert kernels.shape == (2, 2 * wavelets.half + 1)
    np.testing.assert_allclose(kernels[:, wavelets.half], 1)
    np.testing.assert_allclose(kernels, kernels[:, ::-1].conj(), atol=1e-12)


@pytest.mark.parametrize("sfreq", [512.0, 125.0])
def test_magnitudes_equal_convolution_in_time(sfreq):
    wavelets = paper(sfreq)
    x = np.random.default_rng(1).standard_normal((2, round(1.4 * sfreq) + 1))
    found = magnitudes(x, wavelets, step=2)
    for row, of_row in zip(x, found, strict=True):
        for kernel, peak, values in zip(wavelets.kernels, wavelets.peaks(x.shape[1]), of_row, strict=True):
            wave = np.convolve(row, kernel)[wavelets.half : wavelets.half + len(row)]
            np.testing.assert_allclose(values, 2 * np.abs(wave[::2]) / peak, rtol=1e-9, atol=1e-12)


def test_a_sine_gives_its_amplitude():
    wavelets = paper(512.0)
    t = np.arange(2048) / 512
    for i, frequency in enumerate(FREQUENCIES):
        found = magnitudes(3.5 * np.sin(2 * np.pi * frequency * t), wavelets)[i, 1024]
        assert found == pytest.approx(3.5, rel=0.02 if frequency == 2 else 0.005)


def test_agrees_with_mne_once_its_gain_is_corrected():
    # MNE 1.13 refuses the 2 Hz wavelet on short epochs and truncates elsewhere, so padded, without it: 0.5 % (eeg.md).
    x = np.random.default_rng(2).standard_normal((3, 2, 717))
    padded = np.pad(x, ((0, 0), (0, 0), (700, 700)))
    ours = magnitudes(x, paper(512.0))[:, :, 1:]
    frequencies, cycles = np.array(FREQUENCIES[1:]), np.array(PAPER[1:])
    mnes = mne.time_frequency.tfr_array_morlet(
        padded, 512.0, frequencies, n_cycles=cycles, zero_mean=False, output="complex", verbose="error"
    )[..., 700:-700]
    kernels = mne.time_frequency.morlet(512.0, frequencies, cycles, zero_mean=False)
    gains = np.array([np.abs(np.fft.fft(k, 1 << 15)).max() for k in kernels])
    theirs = 2 * np.abs(mnes) / gains[:, None]
    assert np.abs(ours - theirs).max() / theirs.max() < 0.005


def test_concatenated_trials_would_differ():
    # Why each epoch is padded by itself: neighbours leak into its ends.
    x = np.random.default_rng(3).standard_normal((2, 717))
    apart = magnitudes(x, paper(512.0))
    joined = magnitudes(x.ravel(), paper(512.0))
    assert np.abs(joined[:, 700:717] / apart[0, :, 700:717] - 1).max() > 0.2


def test_means_of_overlapping_conditions():
    rng = np.random.default_rng(4)
    x = rng.standard_normal((6, 2, 100))
    masks = np.array([[1, 1, 0, 0, 0, 0], [0, 1, 1, 1, 0, 0]], bool)
    wavelets = Wavelets((5.0, 10.0), (2.0, 3.0), 100.0)
    each = magnitudes(x, wavelets, step=3)
    found = mean_magnitudes(x, masks, wavelets, step=3)
    np.testing.assert_allclose(found, [each[:2].mean(axis=0), each[1:4].mean(axis=0)])
    assert found.shape == (2, 2, 2, 34)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (((40.0,), (3.0,), 64.0), r"40…40 Hz; at 64 Hz they must lie in 0…32"),
        (((0.0,), (3.0,), 64.0), r"0…0 Hz"),
        (((4.0, 8.0), (3.0,), 64.0), "2 frequencies but 1 numbers"),
        (((4.0,), (-1.0,), 64.0), "cycles -1"),
    ],
)
def test_impossible_wavelets_are_refused(arguments, told):
    with pytest.raises(ValueError, match=told):
        Wavelets(*arguments)
