"""Parts of a map of differences, and what is said of it."""

import numpy as np

from hrcneuro.eeg.significance import SignificanceMap

RNG = np.random.default_rng(3)
TIMES = np.arange(0, 1, 0.1)


def rhythms(*significant):
    """Return a map of which these (channel, frequency, time) points are significant."""
    mask = np.zeros((3, 4, 10), bool)
    for point in significant:
        mask[point] = True
    hz = np.array([4.0, 8.0, 12.0, 16.0])
    return SignificanceMap(5, ["Fz", "Cz", "Pz"], TIMES, RNG.standard_normal(mask.shape), mask, hz)


def test_a_part_holds_channels_frequencies_and_times_with_their_edges():
    whole = rhythms((1, 2, 4))
    part = whole.within(("Pz", "Cz"), hz=(8, 12), s=(0.2, 0.41))
    assert part.channels == ["Cz", "Pz"]
    np.testing.assert_array_equal(part.difference, whole.difference[1:, 1:3, 2:5])
    np.testing.assert_array_equal(part.significant, whole.significant[1:, 1:3, 2:5])
    assert (list(part.frequencies), part.first_s) == ([8, 12], TIMES[4])
    assert not whole.within(("Fz",)).any


def test_channels_come_in_the_order_that_is_asked_for():
    whole = rhythms()
    part = whole.of_channels(["Pz", "Fz"])
    assert part.channels == ["Pz", "Fz"]
    np.testing.assert_array_equal(part.difference, whole.difference[[2, 0]])


def test_a_map_says_where_and_when_it_is_significant():
    assert rhythms().describe() == "nothing significant (n = 5)"
    assert np.isnan(rhythms().first_s)
    assert rhythms((1, 2, 4)).describe() == "Cz, 400 ms, 12 Hz"
    assert rhythms((0, 0, 2), (1, 1, 6)).describe() == "Fz, Cz, 200 to 600 ms, 4 to 8 Hz"
