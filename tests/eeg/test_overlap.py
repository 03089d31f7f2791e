import mne
import numpy as np
import pytest

from hrcneuro.eeg.evoked import averages
from hrcneuro.eeg.overlap import regressed_averages
from hrcneuro.eeg.regression import OtherOnsets

SFREQ, FIRST, LENGTH = 100, -20, 141


def recording(noise, n=400, seed=0):
    """Three classes of responses that overlap by up to half, the second class followed sooner than the others."""
    rng = np.random.default_rng(seed)
    kinds = rng.integers(0, 3, n)
    gaps = np.where(kinds == 1, rng.integers(60, 80, n), rng.integers(90, 121, n))
    onsets = 100 + np.concatenate([[0], np.cumsum(gaps)[:-1]])
    t = np.arange(LENGTH) + FIRST
    responses = np.stack([(k + 1) * np.exp(-(((t - 30 - 10 * k) / 12) ** 2)) for k in range(3)])
    signal = noise * rng.standard_normal((2, onsets[-1] + 300))
    for onset, kind in zip(onsets, kinds, strict=True):
        signal[:, onset + FIRST : onset + FIRST + LENGTH] += responses[kind]
    epochs = np.stack([signal[:, o + FIRST : o + FIRST + LENGTH] for o in onsets])
    return signal, epochs, onsets, kinds, responses


def test_noiseless_responses_are_recovered_where_the_average_is_not():
    _, epochs, onsets, kinds, responses = recording(noise=0)
    masks = np.stack([kinds == k for k in range(3)])
    found = regressed_averages(epochs, onsets, masks)
    np.testing.assert_allclose(found, np.broadcast_to(responses[:, None], found.shape), atol=1e-3)
    assert np.abs(averages(epochs, masks) - responses[:, None]).max() > 0.5


def test_equals_mnes_regression_of_the_recording():
    signal, epochs, onsets, kinds, _ = recording(noise=1.0)
    found = regressed_averages(epochs, onsets, np.stack([kinds == 0, kinds == 1]))
    raw = mne.io.RawArray(signal, mne.create_info(2, SFREQ, "eeg"), verbose="error")
    events = np.column_stack([onsets, np.zeros(len(onsets), int), kinds + 1])
    expected = mne.stats.linear_regression_raw(
        raw, events, {"a": 1, "b": 2, "rest": 3}, tmin=FIRST / SFREQ, tmax=(FIRST + LENGTH - 1) / SFREQ, reject=None
    )
    np.testing.assert_allclose(found[0], expected["a"].data, atol=1e-4)
    np.testing.assert_allclose(found[1], expected["b"].data, atol=1e-4)


def apart(epochs, onsets, kinds, *, every=5, cut=0):
    """Every n-th onset loses its epoch; of its response, only what lies within ``cut`` samples of its ends is held."""
    kept = np.arange(len(onsets)) % every > 0
    spans = np.tile([cut, LENGTH - cut], ((~kept).sum(), 1))
    return epochs[kept], onsets[kept], kinds[kept], OtherOnsets(onsets[~kept], spans)


def test_onsets_without_an_epoch_leave_no_trace_in_the_epochs_they_reach():
    """All onsets have one response, a fifth of them no epoch, as moves of no condition."""
    _, _, onsets, kinds, responses = recording(noise=0)
    signal = np.zeros((2, onsets[-1] + 300))
    for onset in onsets:
        signal[:, onset + FIRST : onset + FIRST + LENGTH] += responses[1]
    epochs = np.stack([signal[:, o + FIRST : o + FIRST + LENGTH] for o in onsets])
    epochs, onsets, kinds, others = apart(epochs, onsets, kinds)
    masks = np.stack([kinds == k for k in range(3)])
    found = regressed_averages(epochs, onsets, masks, others)
    np.testing.assert_allclose(found, np.broadcast_to(responses[1], found.shape), atol=1e-4)
    assert np.abs(regressed_averages(epochs, onsets, masks) - responses[1]).max() > 0.1


@pytest.mark.parametrize("cut", [0, 40])
def test_equals_least_squares_on_the_samples_within_epochs(cut):
    """The plain way: a column a class and sample of its response, a row a sample of the recording."""
    signal, epochs, onsets, kinds, _ = recording(noise=1.0, n=60)
    epochs, onsets, kinds, others = apart(epochs, onsets, kinds, cut=cut)
    masks = np.stack([kinds == 0, kinds == 1])
    design, inside = np.zeros((signal.shape[1], 3 * LENGTH)), np.zeros(signal.shape[1], bool)
    for onset, kind in zip(onsets, kinds, strict=True):
        for i in range(LENGTH):
            design[onset + FIRST + i, kind * LENGTH + i] += 1
            inside[onset + FIRST + i] = True
    for onset, (start, stop) in zip(others.onsets, others.spans, strict=True):
        for i in range(start, stop):
            design[onset + FIRST + i, 2 * LENGTH + i] += 1
    expected = np.linalg.lstsq(design[inside], signal[:, inside].T, rcond=None)[0].T.reshape(2, 3, LENGTH)
    found = regressed_averages(epochs, onsets, masks, others)
    np.testing.assert_allclose(found, expected.transpose(1, 0, 2)[:2], atol=1e-4)


def test_onsets_far_from_every_epoch_change_nothing():
    _, epochs, onsets, kinds, _ = recording(noise=0.5)
    masks = np.stack([kinds == k for k in range(3)])
    far = OtherOnsets(np.array([onsets[-1] + 1000]), np.array([[0, LENGTH]]))
    plain = regressed_averages(epochs, onsets, masks)
    np.testing.assert_allclose(regressed_averages(epochs, onsets, masks, far), plain, rtol=1e-12)


def test_conditions_that_share_trials_are_fitted_apart():
    _, epochs, onsets, kinds, _ = recording(noise=0.5)
    first = regressed_averages(epochs, onsets, np.stack([kinds == 0, kinds == 1]))
    both = regressed_averages(epochs, onsets, np.stack([kinds == 0, kinds <= 1, kinds == 1]))
    np.testing.assert_allclose(both[[0, 2]], first)


def test_without_overlap_it_is_the_average():
    epochs = np.random.default_rng(1).standard_normal((6, 2, 50))
    onsets = 1000 * np.arange(6)
    masks = np.array([[1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 0]], bool)
    np.testing.assert_allclose(regressed_averages(epochs, onsets, masks), averages(epochs, masks), rtol=1e-5)


def test_bad_input_is_refused():
    epochs = np.zeros((2, 1, 10))
    with pytest.raises(ValueError, match="same sample"):
        regressed_averages(epochs, np.array([5, 5]), np.ones((1, 2), bool))
    with pytest.raises(ValueError, match=r"conditions \[0\] have no trial"):
        regressed_averages(epochs, np.array([5, 50]), np.zeros((1, 2), bool))
