"""Scores of closed loops: means and intervals over sessions, accuracy of the person's and the robot's rows."""

import numpy as np
import pytest
from scipy import stats

from hrcneuro.learning import loop_scores as scores
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop import LoopModel, LoopSessions, simulate_loop
from hrcneuro.learning.loop_decoders import anticipation, independent
from hrcneuro.learning.rates import Rates
from hrcneuro.paradigm.params import ClosedParams

PAPER = kinds(alpha=0.05, ddof=0, horizon=40.0)["paper"]


_COUNTS = np.arange(1, 30)
TRUE = (_COUNTS * np.where(_COUNTS < 10, 0.2, 0.7)).sum() / _COUNTS.sum()


@pytest.fixture(scope="module")
def sessions():
    model = LoopModel(PAPER, tau=0.1, closed=ClosedParams(blocks=2, episodes_per_block=5))
    return simulate_loop(model, anticipation(Rates.level(70)), sessions=8, seed=1)


def made(policies, owners, updates=None):
    policies, owners = np.array(policies, float), np.array(owners, bool)
    count = policies.shape[:2]
    updates = np.arange(1, count[1] + 1)[None].repeat(count[0], 0) * 6 if updates is None else np.array(updates)
    return LoopSessions(policies, owners, updates, np.zeros((*count, 5), int), np.zeros((count[0], 4, 2), int))


def test_the_interval_is_students():
    values = np.random.default_rng(0).normal(0.6, 0.1, (9, 3))
    found = scores.mean_over_sessions(values)
    low, high = stats.t.interval(0.95, 8, values.mean(axis=0), stats.sem(values, axis=0))
    np.testing.assert_allclose([found.low, found.high], [low, high])


def test_sessions_without_a_value_do_not_count_and_one_has_no_interval():
    found = scores.mean_over_sessions(np.array([[0.4, 0.4, np.nan], [0.8, np.nan, np.nan]]))
    np.testing.assert_allclose(found.mean, [0.6, 0.4, np.nan])
    assert found.n.tolist() == [2, 1, 0]
    assert np.isnan(found.half_width[1:]).all()
    assert np.isfinite(found.half_width[0])


def test_a_ratio_is_that_of_the_sums_and_its_interval_holds_it():
    """Drawn often, 95 of 100 intervals hold the true share, though few cases go with untypical answers."""
    rng = np.random.default_rng(1)
    held = []
    for _ in range(400):
        whole = rng.integers(1, 30, 40)
        part = rng.binomial(whole, np.where(whole < 10, 0.2, 0.7))
        found = scores.ratio_over_sessions(part, whole)
        assert found.mean == pytest.approx(part.sum() / whole.sum())
        held.append(found.low < TRUE < found.high)
    assert 0.92 < np.mean(held) < 0.98


def test_in_the_loop_the_shares_of_a_coin_are_one_half():
    model = LoopModel(PAPER, tau=0.1, closed=ClosedParams(blocks=2))
    coin = independent(after_human=0.5, after_robot=0.5)
    found = scores.continuing(simulate_loop(model, coin, sessions=60, seed=2))
    assert (np.abs(found.mean - 0.5) < 1.5 * found.half_width).all()


def test_where_a_further_mean_is_expected_is_wider_than_where_the_mean_is():
    values = np.random.default_rng(0).normal(0.6, 0.1, (400, 2))
    own = scores.mean_over_sessions(values)
    for n in (1, 10):
        expected = scores.expected_mean(values, n)
        np.testing.assert_allclose(expected.mean, own.mean)
        np.testing.assert_allclose(
            expected.half_width, 1.966 * values.std(axis=0, ddof=1) * (1 / n + 1 / 400) ** 0.5, rtol=1e-3
        )


def test_accuracy_is_the_probability_of_the_owners_action():
    one = made([[[0.9, 0.8, 0.3, 0.1]]], [[[1, 0, 1, 0]]])
    assert scores.accuracy(one)[0, 0] == pytest.approx((0.9 + 0.2 + 0.3 + 0.9) / 4)
    assert scores.accuracy(one, "human")[0, 0] == pytest.approx(0.6)
    assert scores.accuracy(one, "robot")[0, 0] == pytest.approx(0.55)


def test_a_session_that_ended_early_has_no_value_after_that():
    short = made([[[0.9] * 4, [np.nan] * 4]], [[[1, 1, 0, 0]] * 2])
    assert np.isnan(scores.accuracy(short)).tolist() == [[False, True]]


def test_against_updates_it_goes_through_what_is_known_at_episodes_ends(sessions):
    for k in range(len(sessions.updates)):
        taken = sessions.updates[k]
        found = scores.against_updates(sessions, "all", np.array([0, *taken, taken[-1] + 1]))[k]
        assert found[0] == 0.5
        np.testing.assert_allclose(found[1:-1], scores.accuracy(sessions)[k])
        assert np.isnan(found[-1])


def test_where_owners_change_updates_tell_nothing():
    changed = made([[[0.9] * 4, [0.9] * 4]], [[[1, 1, 0, 0], [1, 0, 1, 0]]])
    assert np.isnan(scores.against_updates(changed, "all", np.array([3.0]))).all()


def test_shares_of_steps_add_up(sessions):
    assert scores.shares(sessions).mean.sum() == pytest.approx(1)
    taken = scores.step_share(sessions, "taken", ("human", "taken"))
    assert 0 < taken.mean < 1


def test_decisions_are_scored_by_whom_the_person_expects():
    said = np.array([[[3, 1], [2, 6], [1, 4], [5, 5]]])  # RR, RH, HR, HH: said "stays", "takeover"
    one = LoopSessions(np.zeros((1, 1, 4)), np.zeros((1, 1, 4), bool), np.zeros((1, 1), int), np.zeros((1, 1, 5)), said)
    np.testing.assert_allclose(scores.rates_by_case(one).mean, [0.75, 0.75, 0.8, 0.5])
    np.testing.assert_allclose(scores.continuing(one).mean, [5 / 12, 6 / 15])
    np.testing.assert_allclose(scores.staying(one).mean, [4 / 12, 10 / 15])
    assert scores.pooled_takeovers(one) == (pytest.approx(9 / 15), pytest.approx(7 / 12))
    assert scores.pooled_rates(one) == Rates(tnr_hh=50, tpr_hr=80, tnr_rr=75, tpr_rh=75)
    np.testing.assert_allclose(scores.level_rates(one).by_case, 100 * 18 / 27)


def test_rates_of_cases_that_never_came_are_not_known():
    none = made([[[0.5] * 4]], [[[1, 1, 0, 0]]])
    assert scores.pooled_rates(none) is None
    never = np.array([[[3, 1], [0, 0], [0, 0], [5, 5]]])  # RH and HR
    seen = LoopSessions(*(getattr(none, name) for name in ("policies", "owners", "updates", "steps")), never)
    assert scores.pooled_rates(seen) == Rates(tnr_rr=75, tpr_rh=25, tnr_hh=50, tpr_hr=50)
    assert np.isnan(scores.pooled_takeovers(none)).all()


def test_sim1_is_the_papers_curve():
    curve = scores.sim1(Rates(), PAPER, episodes=100, repetitions=2000, seed=1, tau=0.1)
    assert curve.mean[34] == pytest.approx(0.70, abs=0.02)
    assert curve.mean[99] == pytest.approx(0.80, abs=0.02)
    assert scores.sim1_updates(3).tolist() == [9, 18, 27]
