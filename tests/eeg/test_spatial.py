"""One matrix does what the chain does across channels, but for constants."""

from dataclasses import replace

import mne
import numpy as np
import pytest

from hrcneuro.eeg import cleaning, filters
from hrcneuro.eeg.interpolation import sphere_centre
from hrcneuro.eeg.params import CleaningParams
from hrcneuro.eeg.refusals import LoneChannelError, NoPositionError
from hrcneuro.eeg.spatial import Channels, cleaning_matrix

EEG = ["Fp1", "F3", "Fz", "F4", "C3", "Cz", "C4", "P3", "Pz", "P4"]
PARAMS = CleaningParams(filter="causal", sfreq=250.0, bad_channels="none", noisy="flag")


def recording(seed=0, n=5000):
    """Return data (EEG first), positions: noise in which the eyes show everywhere."""
    rng = np.random.default_rng(seed)
    eyes = rng.normal(0, 50, (2, n)).cumsum(axis=1) * 0.05
    eeg = rng.normal(0, 10, (len(EEG), n)) + rng.uniform(0, 0.5, (len(EEG), 2)) @ eyes
    places = mne.channels.make_standard_montage("biosemi64").get_positions()["ch_pos"]
    at = np.array([places[name] for name in EEG])
    return np.vstack([eeg, eyes + rng.normal(0, 1, (2, n))]), at - sphere_centre(at)


def cleaned(params, marked=()):
    data, at = recording()
    signals = cleaning.Signals(data.copy(), 250.0, EEG, ["EOG1", "EOG2"], at, marked=frozenset(marked))
    return data, at, cleaning.clean(signals, params)


def channels(at, result, order):
    """Return the recording's channels with its rows in another order."""
    rows = [order.index(i) for i in range(len(order))]
    bad = np.array([bool(why) for why in result.reason])
    names = [[*EEG, "EOG1", "EOG2"][i] for i in order]
    return Channels(
        names, rows[: len(EEG)], rows[len(EEG) :], at, result.weights, bad, result.interpolated, result.dropped
    )


@pytest.mark.parametrize("splines", ["eeglab", "perrin"])
@pytest.mark.parametrize("reference", ["average", "none"])
def test_the_matrix_does_what_the_chain_does_but_for_constants(splines, reference):
    data, at, result = cleaned(replace(PARAMS, interpolation=splines, reference=reference), marked=("Cz", "P3"))
    order = [11, 3, 0, 1, 2, 10, 4, 5, 6, 7, 8, 9]
    known = channels(at, result, order)
    matrix = cleaning_matrix(known, splines=splines, average=reference == "average")
    assert known.kept == tuple(EEG)
    filtered = filters.causal(data[order].copy(), 250.0, PARAMS.causal_l_freq, PARAMS.h_freq)
    difference = matrix @ filtered - result.eeg
    np.testing.assert_allclose(difference - difference.mean(axis=1, keepdims=True), 0, atol=1e-9)


def test_a_bad_channel_and_a_dropped_one_are_not_read():
    _, at, result = cleaned(PARAMS, marked=("Cz",))
    known = channels(at, result, list(range(12)))
    matrix = cleaning_matrix(known, splines="eeglab", average=True)
    assert not matrix[:, EEG.index("Cz")].any()
    left = replace(known, bad=np.zeros(10, bool), interpolated=np.zeros(10, bool), dropped=np.arange(10) == 2)
    matrix = cleaning_matrix(left, splines="eeglab", average=True)
    assert matrix.shape == (9, 12)
    assert "Fz" not in left.kept
    assert not matrix[:, EEG.index("Fz")].any()
    np.testing.assert_allclose(matrix.sum(axis=0)[:10], 0, atol=1e-12)


def test_what_cannot_be_made_is_refused():
    _, at, result = cleaned(PARAMS, marked=("Cz",))
    known = channels(at, result, list(range(12)))
    lost = at.copy()
    lost[EEG.index("Cz")] = np.nan
    with pytest.raises(NoPositionError, match="Cz"):
        cleaning_matrix(replace(known, positions=lost), splines="eeglab", average=True)
    alone = replace(known, interpolated=np.zeros(10, bool), dropped=np.arange(10) > 0)
    with pytest.raises(LoneChannelError, match="over 1 EEG channel"):
        cleaning_matrix(alone, splines="eeglab", average=True)
    assert cleaning_matrix(alone, splines="eeglab", average=False).shape == (1, 12)
