import mne
import numpy as np
import pytest

from hrcneuro.eeg.evoked import (
    averages,
    difference_interval,
    half_interval,
    peak_times,
    standard_error,
    standard_errors,
    subtract_baseline,
    within,
)

TIMES = np.arange(-102, 615) / 512


def test_baseline_is_mnes():
    data = np.random.default_rng(0).standard_normal((4, 3, 717))
    epochs = mne.EpochsArray(data, mne.create_info(3, 512.0, "eeg"), tmin=TIMES[0], verbose="error")
    expected = epochs.apply_baseline((-0.2, 0.0), verbose="error").get_data(copy=False)
    np.testing.assert_allclose(subtract_baseline(data, TIMES, (-0.2, 0.0)), expected, atol=1e-12)


def test_baseline_leaves_no_offset_and_its_input_alone():
    data = np.random.default_rng(1).standard_normal((4, 3, 717)) + 7
    before = data.copy()
    found = subtract_baseline(data, TIMES, (-0.2, 0.0))
    np.testing.assert_allclose(found[..., within(TIMES, -0.2, 0.0)].mean(axis=-1), 0, atol=1e-12)
    np.testing.assert_array_equal(data, before)
    np.testing.assert_allclose(subtract_baseline(data + 100, TIMES, (-0.2, 0.0)), found, atol=1e-10)


def test_baseline_outside_the_epoch_is_refused():
    with pytest.raises(ValueError, match=r"-0\.5…-0\.3 s holds no sample of epochs -0\.199"):
        subtract_baseline(np.zeros((1, 1, 717)), TIMES, (-0.5, -0.3))


def test_averages_of_overlapping_conditions():
    data = np.random.default_rng(2).standard_normal((5, 2, 7))
    masks = np.array([[1, 1, 0, 0, 0], [0, 1, 1, 1, 1]], bool)
    np.testing.assert_allclose(averages(data, masks), [data[:2].mean(axis=0), data[1:].mean(axis=0)])
    with pytest.raises(ValueError, match=r"conditions \[0\] have no trial"):
        averages(data, np.zeros((1, 5), bool))


def test_standard_error():
    data = np.random.default_rng(3).standard_normal((9, 4))
    np.testing.assert_allclose(standard_error(data), data.std(axis=0, ddof=1) / 3)
    assert np.isnan(standard_error(data[:1])).all()


def test_standard_errors_of_overlapping_conditions_far_from_zero():
    data = np.random.default_rng(4).standard_normal((7, 3, 11)) * 5 + 1e4
    masks = np.array([[1, 1, 1, 0, 0, 1, 0], [0, 1, 1, 1, 1, 0, 1], [0, 0, 0, 0, 0, 0, 1]], bool)
    errors = standard_errors(data, masks, averages(data, masks))
    for mask, error in zip(masks[:2], errors, strict=False):
        np.testing.assert_allclose(error, standard_error(data[mask]), rtol=1e-9)
    assert np.isnan(errors[2]).all()


def test_half_intervals_are_those_of_the_t_tests():
    from scipy.stats import ttest_1samp, ttest_ind

    rng = np.random.default_rng(5)
    first, second = rng.standard_normal((9, 4)), 3 * rng.standard_normal((23, 4))
    welch = ttest_ind(first, second, equal_var=False).confidence_interval(0.9)
    errors, counts = (standard_error(first), standard_error(second)), (len(first), len(second))
    half = difference_interval(errors, counts, confidence=0.9)
    np.testing.assert_allclose(half, (welch.high - welch.low) / 2)
    one = ttest_1samp(first, 0).confidence_interval(0.95)
    np.testing.assert_allclose(half_interval(standard_error(first), 8, confidence=0.95), (one.high - one.low) / 2)
    assert np.isnan(difference_interval(errors, (1, len(second)), confidence=0.95)).all()
    np.testing.assert_array_equal(difference_interval((np.zeros(4), np.zeros(4)), counts, confidence=0.95), np.zeros(4))


def test_peak_times_are_apart_inside_and_the_highest():
    times = np.arange(0, 1, 0.01)
    strength = sum(
        h * np.exp(-(((times - t) / 0.02) ** 2)) for t, h in ((0.1, 1), (0.16, 3), (0.4, 2), (0.7, 5), (0.9, 9))
    )
    found = peak_times(strength, times, start=0, stop=0.8, count=3, apart=0.08)
    assert found == pytest.approx([0.16, 0.4, 0.7])
    assert peak_times(strength, times, start=0, stop=1, count=1, apart=0.08) == pytest.approx([0.9])


def test_peak_times_without_a_peak():
    times = np.arange(0, 1, 0.1)
    assert peak_times(times, times, start=0.2, stop=0.5, count=3, apart=0.1) == pytest.approx([0.5])
    assert peak_times(times, times, start=2, stop=3, count=3, apart=0.1) == pytest.approx([0.9])
