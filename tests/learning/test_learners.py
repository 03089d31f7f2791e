import numpy as np
import pytest
from scipy.special import expit, logit

from hrcneuro.learning.compare import compare, paired
from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.evidence import decision_odds, graded_odds
from hrcneuro.learning.learner import learn
from hrcneuro.learning.learners import AdaptiveLearner, BayesLearner, ForgettingLearner, VotesLearner, kinds
from hrcneuro.learning.rates import PAPER, Rates
from hrcneuro.learning.simulations import Variant
from hrcneuro.learning.task import JointTask, actors, draw, previous_actors

KINDS = kinds(alpha=0.05, ddof=0, horizon=40)


@pytest.fixture(scope="module")
def answers():
    rng = np.random.default_rng(0)
    draws = draw(JointTask(episodes=40), 60, rng)
    return draws, CoinFlips(PAPER).answer(draws, rng, evidence=True)


@pytest.mark.parametrize("name", list(KINDS))
def test_every_learner_keeps_the_contract(name, answers):
    draws, answers = answers
    kind = KINDS[name]
    soft, hard = learn(kind.make, [draws], [answers.predicted], tau=0.1, evidence=[answers.log_odds(kind.evidence)])
    assert soft.shape == hard.shape == (40, 60)
    assert ((soft >= 0) & (soft <= 1)).all()
    assert soft[-1].mean() > 0.6
    first = draws.first(7)
    some = [answers.first(7).log_odds(kind.evidence)]
    alone, _ = learn(kind.make, [first], [answers.predicted[..., :7]], tau=0.1, evidence=some)
    np.testing.assert_allclose(alone, soft[:, :7], rtol=1e-9)  # columns do not see each other


@pytest.mark.parametrize("name", ["confidence", "bayes", "forgetting", "adaptive"])
def test_evidence_is_asked_for(name, answers):
    draws, answers = answers
    with pytest.raises(ValueError, match="log-odds"):
        learn(KINDS[name].make, [draws], [answers.predicted], tau=0.1)


def test_log_odds_are_what_bayes_says():
    rng = np.random.default_rng(1)
    draws = draw(JointTask(6, 2, episodes=300, carry_over=True), 100, rng)
    rates = Rates(60, 70, 65, 80)
    answers = CoinFlips(rates).answer(draws, rng, evidence=True)
    acting = actors(draws)
    before = previous_actors(acting, carry_over=True)
    for was in (False, True):
        for said in (False, True):
            chosen = (before == was) & (answers.predicted == said)
            chosen[0, 0] = False
            told = answers.decision[chosen]
            assert np.ptp(told) == 0
            here = (before == was) & ~np.isin(np.arange(300), [0])[:, None, None]
            counted = np.log((chosen & acting).sum() / (here & acting).sum()) - np.log(
                (chosen & ~acting).sum() / (here & ~acting).sum()
            )
            assert told[0] == pytest.approx(counted, abs=0.05)


def test_graded_log_odds_agree_with_decisions_and_are_calibrated():
    rng = np.random.default_rng(2)
    n = 400_000
    before, acting = rng.random(n) < 0.5, rng.random(n) < 0.5
    epsilon, rates = rng.random(n) * 100, Rates(62, 62, 70, 70)  # equal rates: the threshold is the even point
    odds = graded_odds(before, acting, epsilon, rates)
    right = np.where(before, epsilon <= 62, epsilon <= 70)
    assert ((odds > 0) == (right == acting)).mean() > 0.9999
    p = expit(odds)
    for low in (0.1, 0.3, 0.5, 0.7):
        some = (p > low) & (p <= low + 0.2)
        assert acting[some].mean() == pytest.approx(p[some].mean(), abs=0.01)


def test_certain_rates_claim_finite_evidence():
    before, said = np.array([True, False]), np.array([True, True])
    assert np.isfinite(decision_odds(before, said, Rates.level(100))).all()
    assert np.isfinite(graded_odds(before, said, np.array([0.0, 99.999999999]), Rates.level(100))).all()


def test_bayes_multiplies_likelihoods():
    learner = BayesLearner(3, 2)
    for entry, odds in (([0, 3], [0.5, -1.0]), ([6, 3], [-0.2, -1.0])):  # subtask 0 or 1; column 0 and 1
        learner.update(np.array(entry), np.array(odds))
    np.testing.assert_allclose(learner.margin(), [[0.3, 0.0], [0.0, -2.0], [0.0, 0.0]])


def test_votes_are_counted():
    learner = VotesLearner(2, 2)
    for entry in ([0, 5], [0, 5], [4, 1]):  # human of subtask 0 twice, then robot; robot of subtask 0 twice, human once
        learner.update(np.array(entry))
    assert learner.margin().tolist() == [[1, -1], [0, 0]]


def test_forgetting_is_the_exact_filter():
    learner = ForgettingLearner(1, 2, horizon=10.0)
    learner.update(np.array([0, 1]), np.array([2.0, -1.0]))
    believed = expit(learner.margin()[0])
    learner.end_episode()
    np.testing.assert_allclose(expit(learner.margin()[0]), believed * 0.95 + (1 - believed) * 0.05, rtol=1e-12)


def test_adaptive_averages_models_by_their_likelihood():
    horizons, rng = (2.0, 50.0), np.random.default_rng(3)
    learner = AdaptiveLearner(1, 2, horizons=horizons)
    p, likelihood = np.full((2, 2), 0.5), np.ones((2, 2))  # member, column
    for _ in range(6):
        for _ in range(3):
            odds = rng.normal(size=2)
            learner.update(np.array([0, 1]), odds)
            both = p * np.exp(odds) + (1 - p)
            likelihood *= both
            p = p * np.exp(odds) / both
        learner.end_episode()
        change = 0.5 / np.array(horizons)[:, None]
        p = p * (1 - change) + (1 - p) * change
    mean = (likelihood * p).sum(axis=0) / likelihood.sum(axis=0)
    np.testing.assert_allclose(learner.margin()[0], logit(mean), rtol=1e-9)


def test_comparison_is_paired_and_names_a_winner():
    variants = [
        Variant("SIM1", "emp", JointTask(episodes=60), CoinFlips(PAPER)),
        Variant("SIM3", "80", JointTask(episodes=60, reassign="every", period=20), CoinFlips(Rates.level(80))),
    ]
    found = compare(variants, KINDS, repetitions=220, seed=4, tau=0.1, episodes=(35, 100))
    assert found.measures == ("mean", "episode 35")
    assert found.values.shape == (2, len(KINDS), 2, 220)
    difference, half = paired(found.values)
    assert (difference[:, 0] == 0).all()
    assert (half[:, 0] == 0).all()
    at = list(KINDS).index
    # Graded Bayes learns faster where tasks stay, forgetting where they change, adaptive is good at both.
    assert difference[0, at("bayes_graded"), 0] > 0.08
    assert difference[1, at("forgetting"), 0] > 0.15
    assert difference[1, at("forgetting"), 0] - half[1, at("forgetting"), 0] > difference[1, at("bayes_graded"), 0]
    best = found.values.mean(axis=-1)[:, :, 0].max(axis=1)
    assert (found.values[:, at("adaptive"), 0].mean(axis=-1) > best - 0.03).all()
    # A pairing narrows the interval, and the curves are the same numbers.
    unpaired = 1.96 * np.hypot(*found.values[0, [0, at("confidence")], 0].std(axis=-1)) / np.sqrt(220)
    assert half[0, at("confidence"), 0] < unpaired
    np.testing.assert_allclose(found.curves.mean(axis=-1), found.values[:, :, 0].mean(axis=-1), rtol=1e-9)


def test_without_information_nobody_learns():
    variant = [Variant("SIM2", "50", JointTask(episodes=40), CoinFlips(Rates.level(50)))]
    found = compare(variant, KINDS, repetitions=400, seed=1, tau=0.1)
    for values in found.values[0, :, 0]:
        assert abs(values.mean() - 0.5) < 3 * max(values.std() / 20, 1e-9) + 1e-9
