import mne
import numpy as np
import pytest

from hrcneuro.eeg import ocular


@pytest.fixture
def signals():
    rng = np.random.default_rng(7)
    eog = rng.standard_normal((3, 5000)).cumsum(axis=1)
    eog[2] += 0.5 * eog[0]
    mixing = rng.uniform(-1, 1, (6, 3))
    brain = 10 * rng.standard_normal((6, 5000)) + np.arange(6)[:, None] * 20
    return brain, brain + mixing @ eog, eog, mixing


def test_weights_and_signal_equal_mne(signals):
    _, eeg, eog, _ = signals
    info = mne.create_info(9, 100.0, ["eeg"] * 6 + ["eog"] * 3)
    raw = mne.io.RawArray(np.vstack([eeg, eog]), info, verbose="error")
    raw.set_eeg_reference([], verbose="error")
    model = mne.preprocessing.EOGRegression().fit(raw)
    weights, singular = ocular.regression_weights(eeg, eog)
    assert not singular
    np.testing.assert_allclose(weights, model.coef_, rtol=0, atol=1e-12)
    ours = ocular.remove(eeg.copy(), eog, weights, offset=False)
    np.testing.assert_allclose(ours, model.apply(raw).get_data(picks="eeg"), rtol=0, atol=1e-9)


def test_the_offset_form_differs_by_each_channels_mean(signals):
    _, eeg, eog, _ = signals
    weights, _ = ocular.regression_weights(eeg, eog)
    plain = ocular.remove(eeg.copy(), eog, weights, offset=False)
    shifted = ocular.remove(eeg.copy(), eog, weights, offset=True)
    np.testing.assert_allclose(plain - shifted, np.broadcast_to(eeg.mean(1, keepdims=True), eeg.shape), atol=1e-9)
    # BIOSIG's formula with an offset: regress on [1, EOG].
    design = np.vstack([np.ones(5000), eog])
    np.testing.assert_allclose(shifted, eeg - np.linalg.lstsq(design.T, eeg.T)[0].T @ design, atol=1e-9)


def test_known_mixing_is_undone(signals):
    brain, eeg, eog, mixing = signals
    weights, _ = ocular.regression_weights(eeg, eog)
    np.testing.assert_allclose(weights, mixing, atol=0.05)
    left = ocular.remove(eeg.copy(), eog, weights, offset=True)
    assert np.std(left - (brain - brain.mean(1, keepdims=True))) < 0.05 * np.std(eeg - brain)
    noise = eog - eog.mean(1, keepdims=True)
    np.testing.assert_allclose(left @ noise.T, 0, atol=1e-5)


@pytest.mark.parametrize("defect", ["flat", "copy"])
def test_singular_eog_is_said_and_still_removed(signals, defect):
    _, eeg, eog, _ = signals
    eog[1] = 0 if defect == "flat" else eog[0]
    weights, singular = ocular.regression_weights(eeg, eog)
    assert singular
    assert np.isfinite(weights).all()
    left = ocular.remove(eeg.copy(), eog, weights, offset=True)
    best = np.linalg.lstsq((eog - eog.mean(1, keepdims=True)).T, (eeg - eeg.mean(1, keepdims=True)).T)[0]
    np.testing.assert_allclose(weights, best.T, atol=1e-7)
    assert left.std() < eeg.std()
