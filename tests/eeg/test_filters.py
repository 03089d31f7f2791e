import math
from itertools import pairwise

import mne
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import firwin, freqz

from hrcneuro.eeg import filters
from hrcneuro.eeg.refusals import BandError

RATES = (1000.0, 512.0, 256.0, 250.0, 128.0, 100.0)


def firfilt_recipe(order, low, high, sfreq):
    """The band-pass by spectral inversion, step by step as Widmann's firws builds it, in plain Python."""

    def kernel(cutoff):
        f = cutoff / sfreq
        values = []
        for m in range(-order // 2, order // 2 + 1):
            sinc = 2 * math.pi * f if m == 0 else math.sin(2 * math.pi * f * m) / m
            values.append(sinc * (0.54 - 0.46 * math.cos(2 * math.pi * (m + order // 2) / order)))
        total = math.fsum(values)
        return [v / total for v in values]

    def inverted(b):
        out = [-v for v in b]
        out[order // 2] += 1
        return out

    stop = [a + b for a, b in zip(kernel(low), inverted(kernel(high)), strict=True)]
    return np.array(inverted(stop))


def plain_filter(x, taps, borders=()):
    """The definition: every stretch padded with its edge values, convolved, delay cut off."""
    half = len(taps) // 2
    edges = [0, *borders, len(x)]
    parts = [np.convolve(np.pad(x[a:b], half, mode="edge"), taps, mode="valid") for a, b in pairwise(edges)]
    return np.concatenate(parts)


@pytest.mark.parametrize("sfreq", RATES)
def test_taps_are_firfilts(sfreq):
    made = filters.design(sfreq, 1, 40)
    recipe = firfilt_recipe(made.order, made.low, made.high, sfreq)
    np.testing.assert_allclose(filters.bandpass_taps(sfreq, 1, 40), recipe, rtol=0, atol=1e-12)


def test_design_gives_eeglabs_numbers():
    at_1000, at_128 = filters.design(1000, 1, 40), filters.design(128, 1, 40)
    assert (at_1000.order, at_1000.transition, at_1000.low, at_1000.high) == (3300, 1.0, 0.5, 40.5)
    assert at_128.order == 424
    assert at_128.transition == pytest.approx(0.996226, abs=5e-7)


def test_original_taps_at_the_rates_of_recordings():
    # First, quarter and middle tap from firfilt's own design in GNU Octave: with the order found, and with it given.
    original = {
        (1000, "requested"): [6.603327003804498e-08, -5.2275812398936e-07, 0.08000065789757926],
        (1000, "achieved"): [6.603327003804498e-08, -5.2275812398936e-07, 0.08000065789757926],
        (256, "requested"): [2.465926809034205e-05, -0.0006138951786401613, 0.3125213049456794],
        (256, "achieved"): [2.405714728803704e-05, -0.0006083652508473595, 0.31251077909927494],
        (100, "requested"): [6.650224976756597e-07, -0.0024095048819383572, 0.8000785364596931],
    }
    for (sfreq, transition), values in original.items():
        taps = filters.bandpass_taps(sfreq, 1, 40, transition=transition)
        np.testing.assert_allclose(taps[[0, len(taps) // 4, len(taps) // 2]], values, rtol=0, atol=1e-14)
    assert filters.design(128, 1, 40, transition="requested").transition == 1.0
    with pytest.raises(ValueError, match="allowed: achieved, requested"):
        filters.design(128, 1, 40, transition="wide")


def test_transition_band_is_as_wide_as_there_is_room_for():
    # 0.5 Hz to the lower edge; 2 Hz where the lower edge leaves them; a quarter of a high edge; up to Nyquist.
    wide = {(250, 0.5, 40): 0.5, (250, 4, 40): 2.0, (1000, 20, 100): 5.0, (100, 10, 49): 1.0}
    for arguments, width in wide.items():
        made = filters.design(*arguments)
        assert made.order % 2 == 0
        assert 0.98 * width < made.transition <= width


def test_taps_and_signal_equal_mne_with_the_same_band_and_edges():
    made = filters.design(1000, 1, 40)
    same = {"l_trans_bandwidth": 1, "h_trans_bandwidth": 1, "filter_length": made.order + 1, "verbose": "error"}
    np.testing.assert_allclose(
        filters.bandpass_taps(1000, 1, 40), mne.filter.create_filter(None, 1000, 1, 40, **same), rtol=0, atol=1e-15
    )
    data = 40 * np.random.default_rng(0).standard_normal((2, 20_000)) + 100
    expected = mne.filter.filter_data(data, 1000, 1, 40, pad="edge", **same)
    np.testing.assert_allclose(filters.zero_phase(data, filters.bandpass_taps(1000, 1, 40)), expected, atol=1e-11)


def test_one_window_over_both_sincs_is_another_filter():
    made = filters.design(128, 1, 40)
    taps = filters.bandpass_taps(128, 1, 40)
    other = firwin(made.order + 1, [made.low, made.high], fs=128, pass_zero=False)
    assert np.sqrt(np.mean((other - taps) ** 2) / np.mean(taps**2)) == pytest.approx(4e-4, rel=0.05)
    assert abs(taps.sum()) < 1e-15 < abs(other.sum())


def test_gain_is_one_in_the_band_and_half_at_the_edges():
    frequencies = [0, 0.5, 2, 10, 39, 40.5, 45, 50]
    _, gain = freqz(filters.bandpass_taps(1000, 1, 40), worN=frequencies, fs=1000)
    np.testing.assert_allclose(np.abs(gain), [0, 0.5, 1, 1, 1, 0.5, 0, 0], atol=5e-3)


@given(
    length=st.integers(1, 3000),
    borders=st.sets(st.integers(1, 2999), max_size=4),
    half=st.integers(0, 200),
    seed=st.integers(0, 99),
)
@settings(max_examples=60, deadline=None)
def test_zero_phase_is_the_plain_convolution(length, borders, half, seed):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((2, length)) * 50 + 1000
    taps = rng.standard_normal(half)
    taps = np.concatenate([taps, [1.0], taps[::-1]])
    inner = sorted(b for b in borders if b < length)
    expected = np.stack([plain_filter(channel, taps, inner) for channel in x])
    np.testing.assert_allclose(filters.zero_phase(x, taps, borders=sorted(borders)), expected, rtol=0, atol=1e-8)


def test_long_recordings_run_block_by_block_to_the_same_result():
    x = np.random.default_rng(3).standard_normal((1, 120_000)) + 5
    taps = filters.bandpass_taps(1000, 1, 40)
    expected = plain_filter(x[0], taps, [70_001])
    np.testing.assert_allclose(filters.zero_phase(x, taps, borders=[70_001])[0], expected, rtol=0, atol=1e-12)


def test_zero_phase_works_in_place_and_stretches_do_not_see_each_other():
    x = np.zeros((1, 2000))
    x[0, 1000:] = 100.0
    out = filters.zero_phase(x, filters.bandpass_taps(128, 1, 40), borders=[1000])
    assert out is x
    np.testing.assert_allclose(out, 0, atol=1e-12)


@pytest.mark.parametrize("taps", [np.ones(4), np.array([1.0, 2.0, 3.0])])
def test_zero_phase_refuses_taps_without_a_centre(taps):
    with pytest.raises(ValueError, match="odd number of symmetric"):
        filters.zero_phase(np.zeros((1, 10)), taps)


@pytest.mark.parametrize(("l_freq", "h_freq"), [(1, 64), (1, 80), (0, 40), (40, 1), (-1, 40)])
def test_a_band_beyond_nyquist_or_upside_down_is_refused(l_freq, h_freq):
    with pytest.raises(BandError, match=r"128 Hz.* 64 Hz"):
        filters.design(128, l_freq, h_freq)
    with pytest.raises(BandError, match="Nyquist"):
        filters.CausalFilter(128, l_freq, h_freq)


@given(cuts=st.lists(st.integers(0, 900), max_size=12), seed=st.integers(0, 99))
@settings(max_examples=40, deadline=None)
def test_causal_chain_is_the_same_whatever_the_chunks(cuts, seed):
    x = np.random.default_rng(seed).standard_normal((3, 900)) * 30 + 5000
    whole = filters.CausalFilter(500, 0.1, 40).apply(x)
    chain = filters.CausalFilter(500, 0.1, 40)
    parts = [chain.apply(chunk) for chunk in np.split(x, sorted(cuts), axis=1)]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)
    np.testing.assert_array_equal(filters.causal(x.copy(), 500, 0.1, 40), whole)


def test_causal_chain_does_not_look_ahead_and_an_offset_does_not_ring():
    x = np.full((1, 4000), 3e4)
    x[0, 2000:] += 50 * np.random.default_rng(0).standard_normal(2000)
    out = filters.CausalFilter(1000, 0.1, 40).apply(x)
    assert np.abs(out[0, :2000]).max() < 1e-6
    assert np.abs(out[0, 2000:]).max() > 10


def test_causal_chain_keeps_a_slow_component_with_little_delay():
    t = np.arange(-2, 3, 1e-3)
    component = np.exp(-0.5 * ((t - 0.5) / 0.1) ** 2)[None]
    out = filters.CausalFilter(1000, 0.1, 40).apply(component)[0]
    assert 0.88 < out.max() < 0.97
    assert 0.004 < t[out.argmax()] - 0.5 < 0.014


def test_causal_chain_starts_anew_after_a_border():
    x = np.random.default_rng(1).standard_normal((2, 1000))
    out = filters.causal(x.copy(), 250, 0.1, 40, borders=[400])
    np.testing.assert_array_equal(out[:, 400:], filters.causal(x[:, 400:].copy(), 250, 0.1, 40))
