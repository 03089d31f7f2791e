"""A printed effect counts as shown only where, when, as long and with the sign that the paper prints."""

import numpy as np
import pytest

from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.report.effects import Effect, shown
from hrcneuro.report.measured_brain import ALPHA_BEFORE, POSITIVITY, THETA_BEFORE

TIMES = np.arange(-51, 308) / 256
HZ = np.arange(2.0, 31.0, 2.0)
CHANNELS = ["Fz", "FC1", "C3", "Cz", "T7", "O1"]


def magnitudes(*blobs):
    """Return a map with significant differences; each blob is (channel, Hz, from s, to s, difference in µV)."""
    difference = np.zeros((len(CHANNELS), len(HZ), len(TIMES)))
    for channel, hz, start, stop, value in blobs:
        inside = (start - 1e-9 <= TIMES) & (stop - 1e-9 > TIMES)
        difference[CHANNELS.index(channel), hz == HZ, inside] = value
    return SignificanceMap(11, CHANNELS, TIMES, difference, difference != 0, HZ)


def potentials(*blobs):
    whole = magnitudes(*((channel, 2.0, start, stop, value) for channel, start, stop, value in blobs))
    return SignificanceMap(11, CHANNELS, TIMES, whole.difference[:, 0], whole.significant[:, 0], np.zeros(0))


LATE_ALPHA = Effect("motor channels", ("C3", "Cz"), -1, (7.5, 12.5), s=(0.6, 1.2), starts_s=(0.55, 0.85))


@pytest.mark.parametrize(
    ("blobs", "expected"),
    [
        ([("C3", 10.0, 0.7, 1.0, -0.5)], True),
        ([("C3", 10.0, 0.7, 1.0, 0.5)], False),  # alpha grows
        ([("C3", 10.0, 0.7, 0.7 + 3 / 256, -0.5)], False),  # three bins
        ([("C3", 10.0, 0.7, 0.79, -0.5)], False),  # less than one period of 10 Hz
        ([("C3", 8.0, 0.7, 0.81, -0.5)], False),  # of 8 Hz, too
        ([("C3", 10.0, 0.2, 0.5, -0.5)], False),  # over before it should begin
        ([("C3", 10.0, 0.3, 1.0, -0.5)], False),  # begins too early
        ([("C3", 10.0, 0.3, 0.31, -0.5), ("C3", 10.0, 0.7, 1.0, -0.5)], True),  # one bin is no beginning
        ([("O1", 10.0, 0.7, 1.0, -0.5)], False),
        ([("C3", 20.0, 0.7, 1.0, -0.5)], False),
        ([("C3", 10.0, 0.7, 1.0, -0.5), ("Cz", 10.0, 0.7, 1.0, 0.5)], False),  # as much grows
        ([], False),
    ],
)
def test_an_effect_on_alpha_has_sign_place_time_and_length(blobs, expected):
    assert shown(magnitudes(*blobs), LATE_ALPHA).agrees is expected


@pytest.mark.parametrize(
    ("blobs", "expected"),
    [
        ([("Fz", 0.45, 0.55, 2.0)], True),
        ([("Fz", 0.45, 0.55, -2.0)], False),
        ([("Fz", 0.45, 0.46, 2.0)], False),
        ([("Fz", 0.1, 0.3, 2.0)], False),
        ([("O1", 0.45, 0.55, 2.0)], False),
    ],
)
def test_the_positivity_of_figs_2c_and_3b_is_frontal_and_about_500_ms(blobs, expected):
    assert shown(potentials(*blobs), POSITIVITY).agrees is expected


def test_what_is_strongest_elsewhere_is_not_most_pronounced_there():
    blob = ("Fz", 6.0, 0.4, 0.65, 0.5)
    assert shown(magnitudes(blob), THETA_BEFORE).agrees
    assert not shown(magnitudes(blob, ("FC1", 6.0, 0.9, 1.1, 0.8)), THETA_BEFORE).agrees


def test_strength_and_beginning_are_those_of_the_printed_sign():
    seen = shown(magnitudes(("C3", 10.0, 0.7, 1.0, -0.5), ("C3", 12.0, 0.0, 0.2, 3.0)), ALPHA_BEFORE)
    assert seen.strongest == 0.5
    assert seen.starts_s == pytest.approx(0.7, abs=1 / 256)
    nothing = shown(magnitudes(), ALPHA_BEFORE)
    assert nothing.strongest == 0
    assert np.isnan(nothing.starts_s)
    assert "nothing significant" in nothing.text


def test_a_study_without_these_channels_shows_nothing():
    tested = magnitudes(("C3", 10.0, 0.7, 1.0, -0.5)).of_channels(["O1"])
    assert not shown(tested, ALPHA_BEFORE).agrees
