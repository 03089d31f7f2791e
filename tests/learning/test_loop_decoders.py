"""Decoders as tables of probabilities: which rates they score, and what their scores claim."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.learning.confound import LOGGED_SHARES
from hrcneuro.learning.evidence import graded_odds
from hrcneuro.learning.loop_decoders import (
    LOGGED_CASES,
    anticipation,
    independent,
    of_errors,
    of_rule,
    of_turns,
    scored,
)
from hrcneuro.learning.rates import Rates


@pytest.mark.parametrize("make", [anticipation, of_errors, of_turns])
def test_each_scores_the_published_rates_on_the_trials_of_the_logs(make):
    found = scored(make(Rates()))
    np.testing.assert_allclose(found.by_case, Rates().by_case, rtol=0, atol=1e-9)


def test_the_cases_of_the_logs_are_those_that_are_told_elsewhere():
    after_error = LOGGED_CASES[..., 1].sum(axis=2) / LOGGED_CASES.sum(axis=(2, 3))
    rr, rh, hr, hh = LOGGED_SHARES
    np.testing.assert_allclose(after_error, [[rr, rh], [hh, hr]], atol=5e-5)


@given(after_human=st.floats(0, 1), after_robot=st.floats(0, 1))
def test_who_knows_nothing_says_the_same_whoever_is_expected(after_human, after_robot):
    decoder = independent(after_human=after_human, after_robot=after_robot)
    assert decoder.says[1] == pytest.approx(after_human)
    assert decoder.says[0] == pytest.approx(after_robot)
    rates = scored(decoder)
    assert rates.tnr_hh + rates.tpr_hr == pytest.approx(100)


def test_without_errors_who_reads_errors_knows_nothing_and_who_reads_turns_knows_turns():
    errors, turns = of_errors(Rates()).says[..., 0], of_turns(Rates()).says[..., 0]
    assert np.ptp(errors[0]) == pytest.approx(0)
    assert np.ptp(errors[1]) == pytest.approx(0)
    assert np.ptp(turns[0, :, 1]) == pytest.approx(0)
    assert turns[0, 0, 1] > turns[0, 0, 0]


@given(uniform=st.floats(0.001, 0.999), by_human=st.booleans())
def test_scores_claim_what_the_simulations_graded_decoder_claims(uniform, by_human):
    rates = Rates(tnr_hh=61, tpr_hr=57, tnr_rr=66, tpr_rh=59)
    decoder = anticipation(rates)
    for takeover in (False, True):
        probability = decoder.says_takeover(by_human, takeover, False, False)
        found = decoder.log_odds(by_human, probability, uniform)
        epsilon = 100.0 * (uniform if takeover else 1.0 - uniform)
        human_next = by_human != takeover
        odds = graded_odds(np.array([by_human]), np.array([human_next]), np.array([epsilon]), rates)[0]
        assert found == pytest.approx(-odds if by_human else odds, abs=2e-5)


@pytest.mark.parametrize(("rule", "rr_rh", "hh_hr"), [("stays", 50, 50), ("prev_error", 71, 38), ("turn", 88.5, 89)])
def test_rules_score_what_is_told_of_them(rule, rr_rh, hh_hr):
    found = scored(of_rule(rule))
    assert (found.tnr_rr + found.tpr_rh) / 2 == pytest.approx(rr_rh, abs=0.5)
    assert (found.tnr_hh + found.tpr_hr) / 2 == pytest.approx(hh_hr, abs=0.5)


def test_there_is_no_other_rule():
    with pytest.raises(KeyError):
        of_rule("luck")
