"""ERP images: which trials a line holds, and in which order."""

import numpy as np
import pytest

from hrcneuro.eeg.trial_image import MOST_LINES, trial_image

NONE = np.full(7, np.nan)


def test_few_trials_are_a_line_each_in_the_order_of_the_gaps_unknown_ones_last():
    waves = np.arange(12.0).reshape(4, 3)
    image = trial_image(waves, np.array([0.9, np.nan, 0.6, 0.7]))
    np.testing.assert_array_equal(image.lines, waves[[2, 3, 0, 1]])
    np.testing.assert_array_equal(image.gaps_s, [0.6, 0.7, 0.9, np.nan])
    assert image.trials == 1
    assert image.by_gap


def test_without_gaps_trials_stand_as_they_came():
    waves = np.random.default_rng(0).normal(size=(7, 5))
    image = trial_image(waves, NONE)
    np.testing.assert_array_equal(image.lines, waves)
    assert not image.by_gap


@pytest.mark.parametrize("n", [1, 29, 30, 60, 61, 500])
def test_lines_go_from_the_first_trial_to_the_last_and_each_is_the_mean_of_as_many(n):
    rng = np.random.default_rng(n)
    waves, gaps = rng.normal(size=(n, 4)), rng.uniform(0.5, 1.5, n)
    image = trial_image(waves, gaps)
    order = np.argsort(gaps)
    assert len(image.lines) == len(image.ranks) <= MOST_LINES
    assert image.trials == max(1, round(n / 20))
    np.testing.assert_allclose(image.lines[0], waves[order[: image.trials]].mean(axis=0))
    np.testing.assert_allclose(image.lines[-1], waves[order[-image.trials :]].mean(axis=0))
    assert image.ranks[0] + image.ranks[-1] == n - 1
    assert (np.diff(image.gaps_s) > 0).all()
