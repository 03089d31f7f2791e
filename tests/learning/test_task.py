import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.learning.decoder import decide
from hrcneuro.learning.rates import PAPER, Rates, case
from hrcneuro.learning.task import JointTask, actors, draw, previous_actors, taught

tasks = st.builds(
    lambda n, m, episodes, events, reassign, period, carry: JointTask(
        n, min(m, n - 1), episodes, events, period, carry, reassign
    ),
    st.integers(2, 32),
    st.integers(1, 31),
    st.integers(1, 6),
    st.integers(1, 5),
    st.sampled_from(["never", "once", "every"]),
    st.integers(1, 4),
    st.booleans(),
)


@settings(max_examples=40, deadline=None)
@given(task=tasks, seed=st.integers(0, 99))
def test_draws_are_the_tasks(task, seed):
    draws = draw(task, 3, np.random.default_rng(seed))
    assert draws.subtask.shape == draws.epsilon.shape == (task.episodes, task.events, 3)
    assert draws.subtask.max() < task.subtasks
    assert (draws.human.sum(axis=1) == task.chosen).all()
    assert ((draws.epsilon >= 0) & (draws.epsilon < 100)).all()
    acting = actors(draws)
    before = previous_actors(acting, carry_over=task.carry_over)
    useful = taught(task)
    flat, flat_before = acting.reshape(-1, 3), before.reshape(-1, 3)
    for k, (e, o) in enumerate(np.ndindex(task.episodes, task.events)):
        owner = draws.human[task.segment[e]]
        assert (acting[e, o] == owner[draws.subtask[e, o], np.arange(3)]).all()
        assert useful[e, o] == (k > 0 and (o > 0 or task.carry_over))
        if useful[e, o]:
            assert (flat_before[k] == flat[k - 1]).all()


def test_assignments_are_redrawn_when_they_should_be():
    for reassign, expected in (("never", [0] * 7), ("once", [0, 0, 0, 1, 1, 1, 1]), ("every", [0, 0, 0, 1, 1, 1, 2])):
        assert JointTask(episodes=7, period=3, reassign=reassign).segment.tolist() == expected


def test_a_redraw_is_independent():
    human = draw(JointTask(reassign="every"), 6000, np.random.default_rng(0)).human
    same = (human[0] == human[1]).all(axis=0).mean()
    assert same == pytest.approx(1 / 6, abs=0.015)  # six ways to choose two of four


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"subtasks": 1}, "1; allowed are 2 to 32"),
        ({"chosen": 0}, "0 of 4; allowed are 1 to"),
        ({"chosen": 4}, "4 of 4"),
        ({"episodes": 0}, "are 0, 10, 40"),
        ({"reassign": "often"}, "'often'; allowed are never, once, every"),
    ],
)
def test_impossible_tasks_are_refused(changes, match):
    with pytest.raises(ValueError, match=match):
        JointTask(**changes)


def test_eq4_is_right_as_often_as_its_rates():
    task = JointTask(episodes=400, events=50)
    draws = draw(task, 50, np.random.default_rng(3))
    acting = actors(draws)
    before = previous_actors(acting, carry_over=False)
    rates = Rates(10, 35, 70, 95)
    right = decide(before, acting, draws.epsilon, rates) == acting
    useful = np.broadcast_to(taught(task)[..., None], right.shape)
    for was, now, rate in ((1, 1, 10), (1, 0, 35), (0, 0, 70), (0, 1, 95)):
        chosen = useful & (before == was) & (acting == now)
        assert right[chosen].mean() * 100 == pytest.approx(rate, abs=0.5)


def test_cases_are_those_of_table_1():
    before, acting = np.array([True, True, False, False]), np.array([True, False, False, True])
    assert PAPER.by_case[case(before, acting)].tolist() == [51.5, 51.4, 57.9, 56.1]  # HH, HR, RR, RH


@pytest.mark.parametrize(
    ("rates", "match"), [((101, 50, 50, 50), "TNR_HH is 101 %"), ((50, 50, 50, -1), "TPR_RH is -1")]
)
def test_impossible_rates_are_refused(rates, match):
    with pytest.raises(ValueError, match=f"{match}.*allowed are 0 to 100"):
        Rates(*rates)
