from functools import partial

import numpy as np
import pytest

from hrcneuro.learning.analytic import answer_probabilities, expected_curve, one_update
from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.rates import PAPER, Rates
from hrcneuro.learning.simulations import Variant, run_curves
from hrcneuro.learning.task import JointTask, actors, draw


def test_answer_probabilities_are_the_simulated_shares():
    rng = np.random.default_rng(0)
    task = JointTask(5, 2, episodes=800, carry_over=True)
    draws = draw(task, 100, rng)
    rates = Rates(60, 70, 65, 80)
    robot = ~CoinFlips(rates).answer(draws, rng).predicted
    # Relabel subtasks so that the human's come first in every repetition.
    rank = np.argsort(np.argsort(~draws.human[0], axis=0, kind="stable"), axis=0)
    subtask = np.take_along_axis(rank[None], draws.subtask.astype(int), axis=1)
    assert (actors(draws) == (subtask < 2)).all()
    share = np.bincount((subtask + 5 * robot).ravel(), minlength=10) / subtask.size
    p = answer_probabilities(np.arange(5) < 2, rates)
    assert p.sum() == pytest.approx(1)
    np.testing.assert_allclose(share, p, atol=0.002)


@pytest.mark.parametrize("ddof", [0, 1])
def test_drift_and_variance_of_one_update(ddof):
    rng = np.random.default_rng(1)
    q = rng.normal(size=8)
    q = (q - q.mean()) / q.std(ddof=ddof)
    p = answer_probabilities(np.arange(4) < 2, Rates(60, 70, 65, 80))
    n = 400_000
    learner = PaperLearner(4, n, alpha=0.3, ddof=ddof)
    learner.q[:] = q[:, None]
    learner.update(rng.choice(8, n, p=p) * n + np.arange(n))
    change = learner.q - q[:, None]
    step = one_update(q, p, alpha=0.3, ddof=ddof)
    error = change.std(axis=1) / np.sqrt(n)
    assert (np.abs(change.mean(axis=1) - step.drift) < 5 * error).all()
    np.testing.assert_allclose(np.cov(change), step.covariance, atol=3e-4)


@pytest.mark.parametrize(
    ("n", "m", "rates"),
    [
        (4, 2, PAPER),
        (4, 2, Rates.level(60)),
        (4, 2, Rates.level(80)),
        (10, 2, PAPER),
        (10, 8, PAPER),
        (4, 2, Rates.level(50)),
    ],
)
def test_expectation_is_the_monte_carlo_mean(n, m, rates):
    task = JointTask(n, m)
    variant = Variant("T", "x", task, CoinFlips(rates))
    curve = run_curves([variant], partial(PaperLearner, alpha=0.05), repetitions=1500, seed=8, tau=0.1)[0]
    expected = expected_curve(task, rates, alpha=0.05, tau=0.1)
    assert np.abs(curve.mean - expected).max() < 0.02
    assert np.sqrt(np.mean((curve.mean - expected) ** 2)) < 0.01


def test_expectation_gives_the_printed_milestones_without_a_draw():
    expected = expected_curve(JointTask(episodes=100), PAPER, alpha=0.05, tau=0.1)
    assert expected[[34, 99]] == pytest.approx([0.70, 0.80], abs=0.008)


def test_without_information_the_expectation_stays():
    for task in (JointTask(), JointTask(7, 2), JointTask(episodes=1, events=1)):
        np.testing.assert_allclose(expected_curve(task, Rates.level(50), alpha=0.05, tau=0.1), 0.5, atol=1e-12)
