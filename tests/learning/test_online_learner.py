"""A learner that takes one decision at a time: the same as the simulated ones, and what its policy can be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.learning.learners import kinds
from hrcneuro.learning.online import SUBTASKS, OnlineLearner, rates_of
from hrcneuro.learning.params import LEARNERS
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.reference import learn_one
from hrcneuro.learning.task import JointTask, actors, draw

KINDS = kinds(alpha=0.05, ddof=0, horizon=40.0)
ODDS = st.floats(0.01, 4) | st.floats(-4, -0.01)
ANSWERS = st.lists(
    st.tuples(st.sampled_from(SUBTASKS), st.sampled_from(["human", "robot"]), ODDS),
    max_size=40,
)


def taught(name, answers, **how):
    learner = OnlineLearner(KINDS[name], tau=0.1, rates=Rates(), **how)
    for subtask, before, odds in answers:
        learner.update(subtask, before=before, takeover=odds > 0, log_odds=odds)
    return learner


def test_decisions_one_by_one_teach_what_the_papers_equations_do():
    """Eq 3 to 6 as printed, on the same answers: equal to the last bit."""
    task = JointTask(subtasks=4, chosen=2, episodes=12, events=10)
    draws = draw(task, 3, np.random.default_rng(5))
    rates = Rates()
    expected = learn_one(draws, 1, rates, alpha=0.05, tau=0.1)
    acting = actors(draws)[:, :, 1]
    learner, found = OnlineLearner(KINDS["paper"], tau=0.1), []
    human = draws.human[0, :, 1]
    for episode in range(12):
        for event in range(1, 10):
            before, now = acting[episode, event - 1], acting[episode, event]
            right = draws.epsilon[episode, event, 1] <= rates.by_case[2 * int(before) + int(now)]
            learner.update(
                SUBTASKS[draws.subtask[episode, event, 1]],
                before="human" if before else "robot",
                takeover=bool((now if right else not now) != before),
                log_odds=0.0,
            )
        policy = learner.policy()
        found.append(np.mean([policy[s] if human[i] else 1 - policy[s] for i, s in enumerate(SUBTASKS)]))
    assert learner.updates == 108
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    learner.afresh()
    assert learner.policy() == dict.fromkeys(SUBTASKS, 0.5)


@pytest.mark.parametrize("name", LEARNERS)
@given(answers=ANSWERS)
def test_a_policy_is_a_probability_and_mirrored_answers_mirror_it(name, answers):
    one = taught(name, answers).policy()
    assert all(0 <= p <= 1 for p in one.values())
    if name == "bayes":
        return  # its rates are not alike for both partners
    swapped = {"human": "robot", "robot": "human"}
    other = taught(name, [(s, swapped[before], odds) for s, before, odds in answers]).policy()
    for subtask in SUBTASKS:
        assert one[subtask] == pytest.approx(1 - other[subtask], abs=1e-6)


@given(answers=ANSWERS, floor=st.floats(0, 0.5))
def test_a_floor_leaves_each_action_so_much(answers, floor):
    policy = taught("paper", answers, floor=floor).policy()
    assert all(floor - 1e-12 <= p <= 1 - floor + 1e-12 for p in policy.values())


def test_one_answer_moves_its_subtask_toward_who_was_expected():
    for before, takeover, more_human in (
        ("robot", True, True), ("robot", False, False), ("human", True, False), ("human", False, True),
    ):  # fmt: skip
        learner = OnlineLearner(KINDS["paper"], tau=0.1)
        learner.update("E", before=before, takeover=takeover, log_odds=0.3 if takeover else -0.3)
        human, robot = learner.values()["E"]
        assert (human > robot) is more_human
        # The paper's memory after its first answer: one entry far above the other seven.
        assert max(human, robot) == pytest.approx(7**0.5)
        assert (learner.policy()["E"] > 0.999) is more_human


def test_bayes_rule_adds_log_odds_and_weighs_by_rates():
    graded = taught("bayes_graded", [("N", "robot", 0.4), ("N", "human", 0.1)])
    assert graded.margin()[0] == pytest.approx(0.3)
    human, robot = graded.values()["N"]
    assert np.exp(human) + np.exp(robot) == pytest.approx(1)
    known = taught("bayes", [("N", "robot", 0.4)]).margin()[0]
    assert known == pytest.approx(np.log(Rates().tpr_rh / (100 - Rates().tnr_rr)), rel=1e-5)
    unknown = OnlineLearner(KINDS["bayes"], tau=0.1)
    unknown.update("N", before="robot", takeover=True, log_odds=0.4)
    assert unknown.margin()[0] == 0


def test_what_is_no_answer_is_refused():
    learner = OnlineLearner(KINDS["paper"], tau=0.1)
    with pytest.raises(ValueError, match="NE"):
        learner.update("NE", before="human", takeover=True, log_odds=0.1)
    with pytest.raises(ValueError, match="finite"):
        learner.update("N", before="human", takeover=True, log_odds=float("nan"))
    with pytest.raises(ValueError, match="floor"):
        OnlineLearner(KINDS["paper"], tau=0.1, floor=0.6)
    assert learner.updates == 0


def test_rates_come_from_the_decoders_figures_or_not_at_all():
    figures = {
        "a": {"actor": "human", "tnr": 51.0, "tpr": 52.0, "bacc": 3.0},
        "b": {"actor": "robot", "tnr": 53.0, "tpr": 54.0},
    }
    assert rates_of(figures) == Rates(tnr_hh=51, tpr_hr=52, tnr_rr=53, tpr_rh=54)
    assert rates_of({"a": figures["a"]}) is None
    assert rates_of({**figures, "b": {"actor": "robot", "tnr": None, "tpr": 54.0}}) is None
