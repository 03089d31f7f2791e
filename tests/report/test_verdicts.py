"""A verdict claims no more than the data can bear."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.report.verdicts import AGREES, CHOSEN, DIFFERS, MISSING, OPEN, PLANTED, Grounds, Measured, near
from hrcneuro.sources.origin import Origin

GROUNDS = ("eeg", "behaviour", "model", "arithmetic")


def grounds_of(eeg, behaviour, model=Origin.REAL, short=None):
    return Grounds(dict(zip(GROUNDS, (eeg, behaviour, model, Origin.REAL), strict=True)), short or {})


REAL = grounds_of(Origin.REAL, Origin.REAL)
SIMULATED = grounds_of(Origin.SYNTHETIC, Origin.SYNTHETIC)
LOGS = grounds_of(Origin.SYNTHETIC, Origin.REAL)
MIXED = grounds_of(None, Origin.REAL, None)
UNKNOWN = grounds_of(Origin.UNKNOWN, Origin.UNKNOWN)
SHORT = grounds_of(Origin.REAL, Origin.REAL, short={"eeg": "3 subjects of 11"})


@pytest.mark.parametrize(
    ("grounds", "agrees", "rests_on", "planted", "expected"),
    [
        (REAL, True, "eeg", True, AGREES),
        (REAL, False, "eeg", True, DIFFERS),
        (REAL, True, "eeg", False, AGREES),
        (SIMULATED, True, "eeg", True, PLANTED),
        (SIMULATED, False, "eeg", True, DIFFERS),
        (SIMULATED, True, "eeg", False, OPEN),
        (SIMULATED, False, "eeg", False, OPEN),
        (SIMULATED, True, "behaviour", True, PLANTED),
        (SIMULATED, True, "model", True, AGREES),
        (LOGS, True, "behaviour", True, AGREES),
        (LOGS, True, "eeg", True, PLANTED),
        (MIXED, True, "eeg", True, OPEN),
        (SHORT, True, "eeg", True, OPEN),
        (SHORT, False, "eeg", True, OPEN),
        (SHORT, True, "behaviour", True, AGREES),
        (REAL, None, "eeg", True, OPEN),
        (UNKNOWN, True, "eeg", True, OPEN),
        (UNKNOWN, False, "behaviour", True, OPEN),
        (UNKNOWN, True, "model", True, AGREES),
    ],
)
def test_verdict_follows_from_what_is_real_and_large_enough(grounds, agrees, rests_on, planted, expected):
    assert grounds.verdict(Measured("x", agrees, rests_on, "why", planted))[0] == expected


@pytest.mark.parametrize(
    ("grounds", "agrees", "expected"),
    [(REAL, True, CHOSEN), (REAL, False, DIFFERS), (REAL, None, OPEN), (SIMULATED, True, PLANTED)],
)
def test_a_figure_that_its_reading_was_chosen_for_does_not_plainly_agree(grounds, agrees, expected):
    verdict, why = grounds.verdict(Measured("x", agrees, "behaviour", "as printed", reading="what counts as a trial"))
    assert verdict == expected
    assert ("what counts as a trial" in why) == (expected == CHOSEN)


def test_data_of_unknown_origin_are_told_from_others_and_keep_their_figure():
    verdict, why = UNKNOWN.verdict(Measured("x", False, "eeg", "within 2"))
    assert verdict == OPEN
    assert why == "the data are of unknown origin; the figure does not fit: within 2"


def test_what_has_not_run_is_said_to_be_missing():
    assert REAL.verdict(None) == (MISSING, "")


def test_what_a_stage_that_ran_does_not_give_is_not_called_missing():
    verdict, why = REAL.verdict(None, ran=True)
    assert verdict == OPEN
    assert "has run" in why


@given(
    agrees=st.sampled_from([True, False, None]),
    rests_on=st.sampled_from(GROUNDS),
    planted=st.booleans(),
    origin=st.sampled_from([Origin.SYNTHETIC, Origin.UNKNOWN, None]),
)
def test_only_real_data_agree(agrees, rests_on, planted, origin):
    grounds = Grounds(dict.fromkeys(GROUNDS, origin), {})
    assert grounds.verdict(Measured("x", agrees, rests_on, "", planted))[0] != AGREES


@given(st.floats(40, 70), st.floats(0.5, 6), st.integers(2, 40))
def test_the_published_mean_itself_is_near(mean, sd, n):
    assert near(np.full(n, mean), mean, sd)[0]


def test_noisy_subjects_agree_no_more_easily():
    quiet, noisy = np.full(11, 62.0), 62.0 + 20 * np.resize([-1, 1], 11)
    assert not near(quiet, 57.1, 3.7)[0]
    assert not near(noisy + 62.0 - noisy.mean(), 57.1, 3.7)[0]


def test_more_subjects_make_the_comparison_sharper():
    assert near(np.full(11, 60.0), 57.1, 3.7)[0]
    assert not near(np.full(1000, 60.0), 57.1, 3.7)[0]
