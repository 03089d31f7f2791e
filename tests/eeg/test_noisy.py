"""Channels that are noisy all the time: PREP's deviation and correlation, held against pyprep where it is installed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.eeg import noisy

LIMITS = {"deviation": 5.0, "correlation": 0.4, "share": 0.01}
SFREQ = 100.0


@pytest.fixture
def recording():
    """Return twelve channels that share three sources, with a little noise of their own, shape (12, 6000), µV."""
    rng = np.random.default_rng(11)
    shared = rng.uniform(0.5, 1.5, (12, 3)) @ rng.standard_normal((3, 6000))
    return 6.0 * shared + 2.0 * rng.standard_normal((12, 6000))


def judged(data, **changes):
    used = changes.pop("used", np.ones(len(data), bool))
    return noisy.judge(data, SFREQ, used=used, **(LIMITS | changes))


def test_a_sound_recording_has_none(recording):
    assert judged(recording).reason == [""] * 12


def test_what_kurtosis_cannot_see_is_found(recording):
    from hrcneuro.eeg import channels

    recording[4] += 60 * np.random.default_rng(2).standard_normal(6000)  # large, and like no other channel
    recording[7] = 10 * np.random.default_rng(3).standard_normal(6000)  # of usual size, yet like no other
    recording[9] *= 8  # large, and like the others
    assert not channels.judge(recording, 5.0).bad.any()
    found = judged(recording)
    assert found.reason[4] == "deviation, correlation"
    assert (found.reason[7], found.reason[9]) == ("correlation", "deviation")
    assert found.noisy.sum() == 3
    assert found.alone[7] > 0.9


def test_a_contact_that_is_lost_for_some_seconds_is_found_by_the_share_of_its_windows(recording):
    recording[3, 1000:1300] = np.random.default_rng(4).standard_normal(300)
    assert judged(recording).alone[3] == pytest.approx(3 / 60)
    assert judged(recording).reason[3] == "correlation"
    assert judged(recording, share=0.05).reason[3] == ""


def test_where_many_channels_go_with_no_other_that_is_no_noise(recording):
    own = np.random.default_rng(5).standard_normal((4, 6000))
    recording[:3] = 10 * own[:3]
    assert judged(recording).reason == [*["correlation"] * 3, *[""] * 9]
    recording[3] = 10 * own[3]
    found = judged(recording)
    assert found.reason == [""] * 12
    assert found.n_alone == 4
    assert (found.alone[:4] > 0.9).all()


def test_channels_left_out_have_no_numbers_and_change_none(recording):
    rest = judged(np.delete(recording, 5, axis=0))
    recording[5] = 1e4
    found = judged(recording, used=np.arange(12) != 5)
    assert np.isnan([found.deviation[5], found.alone[5]]).all()
    np.testing.assert_array_equal(np.delete(found.deviation, 5), rest.deviation)
    np.testing.assert_array_equal(np.delete(found.alone, 5), rest.alone)


def test_three_channels_and_a_recording_below_a_second_are_too_few(recording):
    assert judged(recording[:3]).reason == [""] * 3
    short = judged(recording[:, :60])
    assert np.isnan(short.alone).all()
    assert np.isfinite(short.deviation).all()


def test_no_window_crosses_a_break(recording):
    whole = noisy.nearest_correlations(recording, SFREQ)
    parts = [noisy.nearest_correlations(part, SFREQ) for part in np.split(recording, [250, 700], axis=1)]
    found = noisy.nearest_correlations(recording, SFREQ, borders=[250, 700])
    np.testing.assert_allclose(found, np.hstack(parts), atol=1e-12)
    assert whole.shape == (12, 60)
    assert found.shape == (12, 2 + 4 + 53)


@given(scale=st.floats(0.01, 100), seed=st.integers(0, 50))
@settings(deadline=None, max_examples=20)
def test_neither_unit_nor_sign_matters(scale, seed):
    rng = np.random.default_rng(seed)
    data = rng.standard_normal((6, 500)) * rng.uniform(1, 5, (6, 1)) + rng.standard_normal(500)
    one, other = judged(data), judged(-scale * data)
    np.testing.assert_allclose(one.deviation, other.deviation, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        noisy.nearest_correlations(data, SFREQ), noisy.nearest_correlations(-scale * data, SFREQ), atol=1e-9
    )


def test_equal_channels_are_no_outliers():
    np.testing.assert_array_equal(noisy.robust_z(np.array([3.0] * 8 + [9.0])), [0] * 8 + [np.inf])


def test_the_robust_deviation_of_normal_noise_is_its_deviation():
    assert noisy.robust_sd(3 * np.random.default_rng(0).standard_normal(200_000)) == pytest.approx(3, rel=0.01)


def test_pyprep_says_the_same(recording):
    pyprep = pytest.importorskip("pyprep", reason="pyprep is not installed")
    import mne

    recording[4] += 60 * np.random.default_rng(2).standard_normal(6000)
    recording[3, 1000:1300] = np.random.default_rng(4).standard_normal(300)
    recording[7] = 10 * np.random.default_rng(3).standard_normal(6000)
    names = [f"c{i:02d}" for i in range(12)]
    raw = mne.io.RawArray(1e-6 * recording, mne.create_info(names, SFREQ, "eeg"), verbose="error")
    theirs = pyprep.NoisyChannels(raw, do_detrend=False, random_state=1)
    theirs.find_bad_by_deviation()
    theirs.find_bad_by_correlation()
    ours = judged(recording)
    z = theirs._extra_info["bad_by_deviation"]["robust_channel_deviations"]
    np.testing.assert_allclose(ours.deviation, z, rtol=1e-6)
    # pyprep leaves the last window out.
    nearest = theirs._extra_info["bad_by_correlation"]["max_correlations"]
    np.testing.assert_allclose(noisy.nearest_correlations(recording, SFREQ)[:, :-1], nearest, atol=1e-9)
    flagged = {names[i] for i in np.flatnonzero(ours.noisy)}
    assert flagged == {*theirs.bad_by_deviation, *theirs.bad_by_correlation} == {"c03", "c04", "c07"}
