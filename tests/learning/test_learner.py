from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner, accuracy, greedy, learn
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.reference import learn_one
from hrcneuro.learning.task import JointTask, draw


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(2, 12),
    m=st.integers(1, 11),
    repetitions=st.integers(1, 5),
    reassign=st.sampled_from(["never", "once", "every"]),
    carry_over=st.booleans(),
    ddof=st.integers(0, 1),
    alpha=st.floats(0.001, 2),
    tau=st.floats(0.0001, 2),
    rates=st.tuples(*[st.floats(0, 100)] * 4),
    seed=st.integers(0, 10**6),
)
def test_equal_to_the_reference_to_the_last_bit(n, m, repetitions, reassign, carry_over, ddof, alpha, tau, rates, seed):
    task = JointTask(n, min(m, n - 1), 12, 5, period=4, carry_over=carry_over, reassign=reassign)
    rng = np.random.default_rng(seed)
    draws, rates = draw(task, repetitions, rng), Rates(*rates)
    answers = CoinFlips(rates).answer(draws, rng)
    fast, _ = learn(partial(PaperLearner, alpha=alpha, ddof=ddof), [draws], [answers.predicted], tau=tau)
    for repetition in range(repetitions):
        plain = learn_one(draws, repetition, rates, alpha=alpha, tau=tau, ddof=ddof)
        assert fast[:, repetition].tolist() == plain


def test_the_full_size_is_equal_too():
    rng = np.random.default_rng(1)
    draws = draw(JointTask(), 2, rng)
    rates = Rates(51.5, 51.4, 57.9, 56.1)
    fast, _ = learn(
        partial(PaperLearner, alpha=0.05), [draws], [CoinFlips(rates).answer(draws, rng).predicted], tau=0.1
    )
    assert fast[:, 1].tolist() == learn_one(draws, 1, rates, alpha=0.05, tau=0.1)


def test_memory_is_standardised_over_all_entries():
    learner = PaperLearner(3, 4, alpha=0.3)
    rng = np.random.default_rng(0)
    for _ in range(20):
        learner.update(rng.integers(0, 6, 4) * 4 + np.arange(4))
        np.testing.assert_allclose(learner.q.mean(axis=0), 0, atol=1e-12)
        np.testing.assert_allclose(learner.q.std(axis=0), 1, rtol=1e-12)


def test_a_perfect_decoder_is_believed():
    rng = np.random.default_rng(2)
    draws = draw(JointTask(episodes=60), 50, rng)
    make = partial(PaperLearner, alpha=0.05)
    soft, hard = learn(make, [draws], [CoinFlips(Rates.level(100)).answer(draws, rng).predicted], tau=0.1)
    assert soft[-1].min() > 0.99
    assert hard[-1].min() == 1
    soft, _ = learn(make, [draws], [CoinFlips(Rates.level(0)).answer(draws, rng).predicted], tau=0.1)
    assert soft[-1].max() < 0.01


def test_human_and_robot_are_alike():
    # Exchanging the partners, with their rates, exchanges q's halves and changes no accuracy.
    rng = np.random.default_rng(5)
    draws = draw(JointTask(5, 2, 30), 20, rng)
    mirror = type(draws)(JointTask(5, 3, 30), draws.subtask, ~draws.human, draws.epsilon)
    make = partial(PaperLearner, alpha=0.05)
    one, _ = learn(make, [draws], [CoinFlips(Rates(60, 70, 55, 80)).answer(draws, rng).predicted], tau=0.1)
    two, _ = learn(make, [mirror], [CoinFlips(Rates(55, 80, 60, 70)).answer(mirror, rng).predicted], tau=0.1)
    np.testing.assert_allclose(one, two, atol=1e-9)


def test_policy_is_the_softmax():
    margin, human = np.array([[0.3], [-0.2]]), np.array([[True], [True]])
    expected = np.mean([np.exp(x / 0.1) / (np.exp(x / 0.1) + 1) for x in (0.3, -0.2)])
    assert accuracy(margin, human, 0.1)[0] == pytest.approx(expected, rel=1e-12)
    assert accuracy(np.zeros((2, 1)), human, 0.1)[0] == 0.5
    assert greedy(margin, human)[0] == 0.5
    assert greedy(np.zeros((2, 1)), human)[0] == 0.5
    assert accuracy(np.array([[1e6]]), np.array([[False]]), 1e-9)[0] == 0.0  # no overflow, no nan


def test_only_like_tasks_learn_together():
    rng = np.random.default_rng(0)
    one, two = draw(JointTask(episodes=3), 2, rng), draw(JointTask(episodes=4), 2, rng)
    with pytest.raises(ValueError, match="differ in subtasks, episodes"):
        learn(partial(PaperLearner, alpha=0.1), [one, two], [one.epsilon > 50, two.epsilon > 50], tau=0.1)
    with pytest.raises(ValueError, match="1 column"):
        PaperLearner(4, 1, alpha=0.1)
