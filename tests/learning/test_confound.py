from functools import partial

import numpy as np
import pytest

from hrcneuro.learning.confound import ERROR_RATE, LOGGED_SHARES, error_reader, falling_errors, same_rates
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.rates import PAPER, Rates, case
from hrcneuro.learning.simulations import run_curves
from hrcneuro.learning.task import JointTask, actors, draw, previous_actors


def _scored(decoder, seed=0):
    """Rates that a decoder scores in a large task, in the order of Rates."""
    rng = np.random.default_rng(seed)
    draws = draw(JointTask(episodes=500, carry_over=True), 100, rng)
    acting = actors(draws)
    now = case(previous_actors(acting, carry_over=True), acting)
    right = decoder.answer(draws, rng).predicted == acting
    return [100 * right[now == which].mean() for which in (3, 2, 0, 1)]


def test_an_error_reader_scores_the_published_rates_where_errors_precede_takeovers():
    reader = error_reader(PAPER, as_logged=True)
    assert _scored(reader) == pytest.approx([51.5, 51.4, 57.9, 56.1], abs=0.6)
    # It need not read errors well: two thirds right are enough.
    assert reader.after_error[0] == pytest.approx(0.668, abs=0.002)
    assert reader.after_none[0] == pytest.approx(0.334, abs=0.002)


def test_where_errors_fall_anyhow_its_answers_say_nothing_about_who_is_next():
    hh, hr, rr, rh = _scored(error_reader(PAPER, as_logged=False))
    assert hh + hr == pytest.approx(100, abs=0.8)
    assert rr + rh == pytest.approx(100, abs=0.8)


def test_rates_beyond_an_error_readers_reach_are_approached():
    reader = error_reader(Rates.level(90), as_logged=True)
    assert reader.after_error[0] == 1.0
    assert reader.after_none[0] == 0.0
    rr, rh = LOGGED_SHARES[:2]
    assert _scored(reader)[2:] == pytest.approx([100 * (1 - rr), 100 * rh], abs=0.6)


def test_no_error_follows_an_error():
    error = falling_errors((200, 10, 50), np.random.default_rng(0)).reshape(-1, 50)
    assert not (error[1:] & error[:-1]).any()
    assert error[1:][~error[:-1]].mean() == pytest.approx(ERROR_RATE, abs=0.01)


def test_the_same_rates_teach_or_do_not():
    variants = same_rates(PAPER, JointTask(episodes=100))
    assert [v.name.split(",")[0] for v in variants][:2] == ["anticipation", "errors"]
    curves = run_curves(variants, partial(PaperLearner, alpha=0.05), repetitions=1000, seed=2, tau=0.1)
    final = [float(c.mean[-1]) for c in curves]
    assert final == pytest.approx([0.80, 0.80, 0.65, 0.50], abs=0.03)


def test_it_offers_no_log_odds():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="no log-odds"):
        error_reader(PAPER, as_logged=True).answer(draw(JointTask(episodes=2), 2, rng), rng, evidence=True)
