"""Features: which samples enter which window, in which order, at any rate and in the right unit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.decoding import features
from hrcneuro.decoding.refusals import (
    EmptyWindowError,
    NoSignalError,
    NotFiniteTrialsError,
    VoltsError,
    WindowOutsideError,
)
from hrcneuro.decoding.scheme import FEATURES_END_S


def times(sfreq: float, *, tmin: float = -0.2, tmax: float = 1.2) -> np.ndarray:
    return np.arange(round(tmin * sfreq), round(tmax * sfreq) + 1) / sfreq


def noise(n_trials: int, n_channels: int, t: np.ndarray, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 10, (n_trials, n_channels, len(t)))


def test_fifteen_windows_tile_the_printed_spans():
    spans_ms = [(round(a * 1000), round(b * 1000)) for a, b in features.WINDOWS_S]
    assert spans_ms[:4] == [(400, 450), (450, 500), (500, 550), (550, 600)]
    assert spans_ms[4:] == [(50 * i, 50 * i + 100) for i in range(11)]
    assert max(end for _, end in features.WINDOWS_S) == FEATURES_END_S
    assert features.window_means(noise(2, 27, times(512)), times(512)).shape == (2, 405)


@pytest.mark.parametrize("sfreq", [1000, 512, 256, 128])
def test_against_a_loop_over_samples(sfreq):
    t = times(sfreq)
    data = noise(3, 2, t)
    found = features.window_means(data, t).reshape(3, 2, 15)
    milli = np.rint(t * 1e6).astype(int)  # microseconds, whole numbers: no rounding at the edges of windows
    for trial, channel, window in np.ndindex(found.shape):
        x = data[trial, channel]
        start, end = (round(edge * 1e6) for edge in features.WINDOWS_S[window])
        inside = [x[i] for i in range(len(t)) if start <= milli[i] < end]
        whole = [x[i] for i in range(len(t)) if 0 <= milli[i] < 800_000]
        assert found[trial, channel, window] == pytest.approx(np.mean(inside) - np.mean(whole), abs=1e-10)


@given(sfreq=st.floats(40, 1100), offset=st.floats(-1e3, 1e3))
@settings(max_examples=40, deadline=None)
def test_a_constant_offset_leaves_no_trace_at_any_rate(sfreq, offset):
    t = np.arange(np.floor(-0.2 * sfreq), np.ceil(1.2 * sfreq) + 1) / sfreq
    data = noise(2, 3, t)
    assert features.window_means(data + offset, t) == pytest.approx(features.window_means(data, t), abs=1e-8)


def test_the_mean_window_is_a_choice():
    t = times(500)
    data = np.where((t >= 0.6) & (t < 0.8), 8.0, 0.0)[None, None]
    assert features.window_means(data, t)[0] == pytest.approx(np.full(15, -2.0))
    assert features.extract("windows_600", data, t)[0] == pytest.approx(np.zeros(15))


def test_a_window_past_the_epoch_names_both():
    t = times(256, tmax=0.7)
    with pytest.raises(WindowOutsideError, match=r"0-0\.8 s reaches past the epoch, -0\.199.*-0\.69"):
        features.window_means(noise(1, 1, t), t)
    assert features.window_means(noise(1, 1, t), t, mean_window_s=(0.0, 0.6)).shape == (1, 15)


def test_a_rate_too_low_for_50_ms_is_refused():
    t = times(15)
    with pytest.raises(EmptyWindowError, match=r"holds no sample at 15 Hz"):
        features.window_means(noise(1, 1, t), t)


def test_volts_are_refused():
    t = times(128)
    with pytest.raises(VoltsError, match="microvolt"):
        features.window_means(noise(4, 3, t) * 1e-6, t)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_samples_that_are_not_finite_are_named(value):
    t = times(128)
    data = noise(5, 3, t)
    data[3, 1, 7] = value
    with pytest.raises(NotFiniteTrialsError, match=r"1 of 5 trials hold .* trial 3, EEG channel 1"):
        features.window_means(data, t)


@pytest.mark.parametrize("value", [0.0, -3.5])
def test_epochs_without_a_signal_are_refused(value):
    t = times(128)
    with pytest.raises(NoSignalError, match=f"no signal: every sample is {value:g}"):
        features.window_means(np.full((4, 1, len(t)), value), t)


def test_flat_channels_hide_neither_a_signal_nor_its_unit():
    t = times(128)
    data = np.concatenate([noise(4, 3, t), np.zeros((4, 5, len(t)))], axis=1)
    assert features.window_means(data, t).shape == (4, 8 * 15)
    with pytest.raises(VoltsError, match="microvolt"):
        features.window_means(1e-6 * data, t)


def test_band_power_finds_the_band_of_a_sine():
    t = times(256)
    data = np.stack([10 * np.sin(2 * np.pi * f * t) for f in (5.5, 10, 20)])[:, None]
    bands = features.band_power(data, t)
    assert bands.argmax(axis=1).tolist() == [0, 1, 2]
    # Four times the amplitude is 12.04 dB.
    assert features.band_power(4 * data, t)[1, 1] - bands[1, 1] == pytest.approx(12.04, abs=0.01)


@pytest.mark.parametrize("kind", ["windows", "windows_600", "steps", "windows_bands", "epochs"])
def test_every_kind_gives_one_finite_row_a_trial(kind):
    from hrcneuro.decoding.recipes import FEATURES

    t = times(128)
    found = features.extract(kind, noise(4, 5, t), t)
    assert kind in FEATURES
    assert len(found) == 4
    assert np.isfinite(found).all()
