"""Regression ERPs: held against plain least squares and MNE, and against responses that were planted."""

import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.eeg.evoked import averages
from hrcneuro.eeg.regression import APART, OtherOnsets, RegularOnsetsError, deconvolved, of_epochs

SFREQ, FIRST, LENGTH = 50, -10, 40
T = np.arange(LENGTH) + FIRST
RESPONSES = np.stack([np.exp(-(((T - c) / w) ** 2)) for c, w in ((5, 6), (12, 4), (18, 5))])


def study(noise, n=150, seed=0):
    """A recording in which the second predictor follows the third one, and soon onsets the second."""
    rng = np.random.default_rng(seed)
    flag = rng.random(n) < 0.4
    size = rng.standard_normal(n) + flag
    predictors = np.column_stack([np.ones(n), flag, size])
    gaps = np.where(flag, rng.integers(18, 26, n), rng.integers(24, 45, n))
    onsets = 60 + np.concatenate([[0], np.cumsum(gaps)[:-1]])
    signal = noise * rng.standard_normal((2, onsets[-1] + 2 * LENGTH))
    for onset, row in zip(onsets, predictors, strict=True):
        signal[:, onset + FIRST : onset + FIRST + LENGTH] += row @ RESPONSES * np.array([[1.0], [-2.0]])
    epochs = np.stack([signal[:, o + FIRST : o + FIRST + LENGTH] for o in onsets])
    return signal, epochs, onsets, predictors


def test_planted_responses_are_recovered_where_overlap_and_confounds_mix_averages():
    _, epochs, onsets, predictors = study(noise=0)
    found = deconvolved(epochs, onsets, predictors)
    planted = RESPONSES[:, None] * np.array([[1.0], [-2.0]])
    np.testing.assert_allclose(found, planted, atol=1e-4)
    flag = predictors[:, 1] > 0
    plain = averages(epochs, np.stack([flag, ~flag]))
    assert np.abs(plain[0] - plain[1] - planted[1]).max() > 0.5
    assert np.abs(of_epochs(epochs, predictors) - planted).max() > 0.3


@pytest.mark.parametrize("cut", [0, 12])
def test_equals_least_squares_on_the_samples_within_epochs(cut):
    """Some onsets have no epoch, some predictors are unknown: the plain way, a column a predictor and sample."""
    signal, epochs, onsets, predictors = study(noise=1.0)
    rows = predictors.copy()
    rows[::7, 2] = np.nan
    rows[::11] = np.nan
    apart = np.arange(len(onsets)) % 5 == 3
    spans = np.tile([cut, LENGTH - cut], (int(apart.sum()), 1))
    found = deconvolved(epochs[~apart], onsets[~apart], rows[~apart], OtherOnsets(onsets[apart], spans, rows[apart]))

    columns = np.column_stack([np.nan_to_num(rows), np.isnan(rows).any(axis=1)])
    design, inside = np.zeros((signal.shape[1], columns.shape[1] * LENGTH)), np.zeros(signal.shape[1], bool)
    for onset, values, alone in zip(onsets, columns, apart, strict=True):
        start, stop = (cut, LENGTH - cut) if alone else (0, LENGTH)
        for i in range(start, stop):
            design[onset + FIRST + i, i::LENGTH] += values
        if not alone:
            inside[onset + FIRST : onset + FIRST + LENGTH] = True
    expected = np.linalg.lstsq(design[inside], signal[:, inside].T, rcond=None)[0].T.reshape(2, -1, LENGTH)
    np.testing.assert_allclose(found, expected.transpose(1, 0, 2)[:3], atol=1e-4)


def test_equals_mnes_regression_of_the_recording_with_a_covariate():
    signal, epochs, onsets, predictors = study(noise=1.0)
    found = deconvolved(epochs, onsets, predictors)
    raw = mne.io.RawArray(signal, mne.create_info(2, SFREQ, "eeg"), verbose="error")
    # Event codes are bits: every trial has the intercept, some the flag.
    codes = 1 + 2 * predictors[:, 1].astype(int)
    events = np.column_stack([onsets, np.zeros(len(onsets), int), codes])
    expected = mne.stats.linear_regression_raw(
        raw,
        events,
        {"plain": 1, "flagged": 3},
        tmin=FIRST / SFREQ,
        tmax=(FIRST + LENGTH - 1) / SFREQ,
        covariates={"size": predictors[:, 2]},
        reject=None,
    )
    np.testing.assert_allclose(found[0], expected["plain"].data, atol=1e-4)
    np.testing.assert_allclose(found[1], expected["flagged"].data - expected["plain"].data, atol=1e-4)
    np.testing.assert_allclose(found[2], expected["size"].data, atol=1e-4)


def test_equals_mnes_regression_of_epochs():
    _, data, onsets, predictors = study(noise=1.0)
    info = mne.create_info(2, SFREQ, "eeg")
    events = np.column_stack([onsets, np.zeros(len(onsets), int), np.ones(len(onsets), int)])
    epochs = mne.EpochsArray(data, info, events, tmin=FIRST / SFREQ, verbose="error")
    names = ["intercept", "flag", "size"]
    expected = mne.stats.linear_regression(epochs, predictors, names)
    found = of_epochs(data, predictors)
    for name, one in zip(names, found, strict=True):
        np.testing.assert_allclose(one, expected[name].beta.data, rtol=1e-9, atol=1e-12)


def test_epochs_with_an_unknown_value_are_left_out_where_overlap_is_kept():
    _, data, _, predictors = study(noise=1.0)
    lacking = predictors.copy()
    lacking[:30, 2] = np.nan
    np.testing.assert_allclose(of_epochs(data, lacking), of_epochs(data[30:], predictors[30:]), rtol=1e-10)


@pytest.mark.parametrize("method", [lambda d, o, x: deconvolved(d, o, x), lambda d, o, x: of_epochs(d, x)])
def test_a_predictor_in_other_units_has_its_coefficient_in_them_and_changes_no_other(method):
    _, data, onsets, predictors = study(noise=1.0)
    found, scaled = method(data, onsets, predictors), method(data, onsets, predictors * [1, 1, 100])
    np.testing.assert_allclose(scaled, found / np.array([1, 1, 100])[:, None, None], rtol=1e-6, atol=1e-9)


def test_trials_out_of_order_change_nothing():
    _, data, onsets, predictors = study(noise=1.0)
    mixed = np.random.default_rng(1).permutation(len(onsets))
    np.testing.assert_allclose(
        deconvolved(data[mixed], onsets[mixed], predictors[mixed]), deconvolved(data, onsets, predictors), atol=1e-10
    )


def test_onsets_at_one_sample_are_refused():
    with pytest.raises(ValueError, match="same sample"):
        deconvolved(np.zeros((2, 1, 10)), np.array([5, 5]), np.ones((2, 1)))


def test_regular_onsets_are_refused_and_irregular_ones_are_not():
    _, data, onsets, predictors = study(noise=1.0)
    assert np.isfinite(deconvolved(data, onsets, predictors, apart=APART)).all()
    regular = 60 + 20 * np.arange(len(onsets))
    with pytest.raises(RegularOnsetsError) as caught:
        deconvolved(data, regular, predictors[:, :1], apart=APART)
    # From here on the next onset adds what this one added 20 samples before.
    assert caught.value.column == 0
    assert caught.value.sample >= 20


def test_a_table_of_a_formula_gives_the_same_as_the_averages_difference_where_nothing_overlaps():
    from hrcneuro.eeg.formula import predictors

    rng = np.random.default_rng(2)
    data, kinds = rng.standard_normal((40, 2, LENGTH)), rng.permutation(["a", "b"] * 20)
    made = predictors("kind", pd.DataFrame({"kind": kinds}))
    means = averages(data, np.stack([kinds == "a", kinds == "b"]))
    found = deconvolved(data, 1000 * np.arange(40), made.values)
    np.testing.assert_allclose(found, [means[0], means[1] - means[0]], rtol=1e-5, atol=1e-5)
