from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.eeg import resample
from hrcneuro.eeg.refusals import RateError


def tones(t):
    return 10 * np.sin(2 * np.pi * 2 * t) + 7 * np.cos(2 * np.pi * 17.3 * t + 1) + 5 * np.sin(2 * np.pi * 39.9 * t)


@pytest.mark.parametrize(
    ("source", "up", "down"), [(1000, 64, 125), (2048, 1, 4), (5000, 64, 625), (1024, 1, 2), (600, 64, 75)]
)
def test_ratios_are_simple_and_exact(source, up, down):
    made = resample.ratio(source, 512)
    assert (made.up, made.down) == (up, down)
    assert made.sfreq == 512


@pytest.mark.parametrize("source", [128, 250, 256, 500, 511.9, 512, 512.03])
def test_a_source_at_or_below_the_target_keeps_its_rate(source):
    made = resample.ratio(source, 512)
    assert (made.up, made.down, made.sfreq) == (1, 1, source)


def test_no_simple_ratio_comes_near():
    made = resample.ratio(1000.1, 512)
    assert made.down <= 1000
    assert made.sfreq == pytest.approx(512, abs=0.01)
    assert resample.ratio(float(np.float32(999.9)), 333.3).down == 3


@given(
    source=st.sampled_from([1000, 2048, 5000, 600, 10_000]), samples=st.lists(st.integers(0, 30_000_000), min_size=1)
)
def test_events_are_right_to_half_a_sample_without_drift(source, samples):
    made = resample.ratio(source, 512)
    for old, new in zip(samples, made.nearest(np.array(samples)).tolist(), strict=True):
        assert abs(Fraction(new) - Fraction(old) * made.up / made.down) <= Fraction(1, 2)
        assert 0 <= Fraction(made.first(old)) - Fraction(old) * made.up / made.down < 1


@pytest.mark.parametrize("source", [1000, 2048, 5000, 600])
@pytest.mark.parametrize("borders", [(), (3001, 3003, 3004, 8000)])
def test_the_new_samples_lie_on_the_signal(source, borders):
    n = 4 * source + 13
    signal = tones(np.arange(n) / source)
    made = resample.ratio(source, 512)
    out = resample.resample(signal[None].copy(), made, pass_freq=40.5, borders=borders)[0]
    assert len(out) == made.length(n)
    expected = tones(np.arange(len(out)) / 512)
    guard = np.ones(len(out), bool)
    for border in (0, *borders, n):
        near = made.first(border)
        guard[max(0, near - 30) : near + 30] = False
    np.testing.assert_allclose(out[guard], expected[guard], rtol=0, atol=1e-3)
    assert guard.sum() > 1000


def test_what_would_fold_onto_the_band_is_gone():
    t = np.arange(8000) / 1000
    made = resample.ratio(1000, 512)
    out = resample.resample(np.sin(2 * np.pi * 490 * t)[None], made, pass_freq=40.5)[0]
    assert np.abs(out[50:-50]).max() < 1e-4


@given(data=st.data(), n=st.integers(1, 600))
@settings(max_examples=40, deadline=None)
def test_stretches_do_not_mix_and_constants_stay(data, n):
    borders = sorted(data.draw(st.sets(st.integers(1, max(1, n - 1)), max_size=4)))
    levels = np.searchsorted(borders, np.arange(n), side="right") * 10.0 + 1
    made = resample.ratio(1000, 512)
    out = resample.resample(levels[None].copy(), made, pass_freq=40.5, borders=borders)[0]
    times = [Fraction(k * made.down, made.up) for k in range(made.length(n))]
    expected = [levels[min(int(t), n - 1)] for t in times]
    np.testing.assert_allclose(out, expected, rtol=1e-3)


def test_one_rate_for_all_means_nothing_to_do():
    x = np.random.default_rng(0).standard_normal((2, 100))
    assert resample.resample(x, resample.ratio(256, 512), pass_freq=40.5) is x


def test_the_result_lies_in_the_sources_memory():
    x = np.zeros((2, 1000))
    out = resample.resample(x, resample.ratio(1000, 512), pass_freq=40.5)
    assert out.shape == (2, 512)
    assert np.shares_memory(out, x)


def test_a_band_above_the_new_nyquist_is_refused():
    with pytest.raises(RateError, match=r"up to 40\.5 Hz .* 80 Hz"):
        resample.resample(np.zeros((1, 1000)), resample.ratio(1000, 80), pass_freq=40.5)


def plainly(stretch, made, taps, new_start, new_stop, start):
    """Resample by the definition: zeros between the samples, one convolution, every ``down``-th of what comes out."""
    half = len(taps) // 2
    pad = -(-half // made.up)
    padded = np.pad(stretch, pad, mode="reflect", reflect_type="odd")
    stuffed = np.zeros((len(padded) - 1) * made.up + 1)
    stuffed[:: made.up] = padded
    smooth = np.convolve(stuffed, taps)
    return smooth[(np.arange(new_start, new_stop) * made.down) - (start - pad) * made.up + half]


@pytest.mark.parametrize("source", [1000, 2048, 5000, 600, 999.9])
@pytest.mark.parametrize("borders", [(), (7, 8, 330, 333, 1500)])
def test_the_products_of_runs_are_the_plain_convolution(source, borders):
    x = np.random.default_rng(4).standard_normal(2003)
    made = resample.ratio(source, 512)
    taps = resample.antialias_taps(made, 40.5)
    edges = [0, *borders, len(x)]
    expected = np.concatenate(
        [plainly(x[a:b], made, taps, made.first(a), made.first(b), a) for a, b in pairwise(edges)]
    )
    out = resample.resample(x[None].copy(), made, pass_freq=40.5, borders=borders)[0]
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("source", [1000, 2048, 999.9])
def test_the_taps_are_scipys(source):
    from scipy.signal import firwin, kaiserord

    made = resample.ratio(source, 512)
    grid = made.source * made.up
    n_taps, beta = kaiserord(120, (made.sfreq - 81) / (grid / 2))
    expected = firwin(n_taps | 1, made.sfreq / 2, window=("kaiser", beta), fs=grid) * made.up
    np.testing.assert_allclose(resample.antialias_taps(made, 40.5), expected, rtol=0, atol=1e-13 * made.up)


def test_a_band_that_leaves_no_room_for_the_low_pass_is_refused_before_hours_are_spent_on_it():
    with pytest.raises(RateError, match=r"0\.5 Hz to fall in, and needs 1$") as caught:
        resample.antialias_taps(resample.ratio(1000, 81.5), pass_freq=40.5)
    assert caught.value.least == 82
    made = resample.ratio(1000, 82)
    assert len(resample.antialias_taps(made, 40.5)) / (made.up * made.source) < 10


def test_equals_the_exact_resampling_of_a_periodic_signal():
    from scipy.signal import resample as by_fft
    from scipy.signal import resample_poly

    spectrum = np.zeros(20_001, complex)
    rng = np.random.default_rng(6)
    spectrum[1 : 40 * 40] = rng.standard_normal(1599) + 1j * rng.standard_normal(1599)
    signal = np.fft.irfft(spectrum, 40_000)
    signal *= 10 / signal.std()
    exact = by_fft(signal, 20_480)[500:-500]
    ours = resample.resample(signal[None].copy(), resample.ratio(1000, 512), pass_freq=40.5)[0, 500:-500]
    theirs = resample_poly(signal, 64, 125)[500:-500]
    assert np.abs(ours - exact).max() < 1e-4 < 1e-2 < np.abs(theirs - exact).max()


@given(st.lists(st.floats(60, 2500), min_size=1, max_size=4))
@settings(max_examples=50, deadline=None)
def test_the_common_rate_is_one_that_all_sources_reach_or_there_is_none(sources):
    rate = resample.common_rate(sources)
    if rate is None:
        for each in range(2, int(min(sources)) + 1):
            made = [resample.ratio(source, each).sfreq for source in sources]
            assert max(made) - min(made) > 1e-5 * each
        return
    made = [resample.ratio(source, rate).sfreq for source in sources]
    assert max(made) - min(made) <= 1e-5 * rate
    assert made == pytest.approx([rate] * len(made), rel=1e-3)


@pytest.mark.parametrize(("sources", "rate"), [([512, 1000], 512), ([511.9, 999.7], 511), ([250], 250), ([1.5], None)])
def test_the_common_rate_is_the_highest(sources, rate):
    assert resample.common_rate(sources) == rate
