"""The simulated closed loop: what each mode lets the robot do, and what decoders teach in it."""

import numpy as np
import pytest

from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop import MODES, STEPS, LoopModel, LoopSessions, simulate_loop
from hrcneuro.learning.loop_decoders import anticipation, independent
from hrcneuro.learning.loop_scores import accuracy, continuing, mean_over_sessions, rates_by_case, staying
from hrcneuro.learning.params import LEARNERS
from hrcneuro.learning.rates import Rates
from hrcneuro.paradigm.params import ClosedParams, SessionParams

KINDS = kinds(alpha=0.05, ddof=0, horizon=40.0)
PERFECT = anticipation(Rates.level(100))
SHORT = ClosedParams(blocks=2, episodes_per_block=4)


def model(mode="closed", name="paper", **how):
    return LoopModel(KINDS[name], tau=0.1, mode=mode, **({"closed": SHORT} | how))


def at_end(sessions, rows="all"):
    return mean_over_sessions(accuracy(sessions, rows)[:, -1])


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in LoopSessions.__dataclass_fields__)


@pytest.mark.parametrize("mode", MODES)
def test_sessions_are_the_same_however_they_are_split_up(mode):
    decoder = anticipation(Rates())
    whole = simulate_loop(model(mode), decoder, sessions=5, seed=3)
    parts = [
        simulate_loop(model(mode), decoder, sessions=2, seed=3),
        simulate_loop(model(mode), decoder, sessions=3, seed=3, first=2),
    ]
    assert same(whole, LoopSessions.joined(parts))
    assert not same(whole, simulate_loop(model(mode), decoder, sessions=5, seed=4))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", LEARNERS)
def test_a_decoder_that_is_always_right_teaches_everything(mode, name):
    long = ClosedParams(blocks=2, episodes_per_block=6)
    sessions = simulate_loop(model(mode, name, closed=long), PERFECT, sessions=6, seed=1)
    human = sessions.policies[:, -1] > 0.5
    known = sessions.policies[:, -1] != 0.5
    assert known.mean() > 0.9
    assert (human == sessions.owners[:, -1])[known].all()
    assert (rates_by_case(sessions).mean == 1).all()


def test_in_shadow_each_makes_the_own_steps_and_the_learner_looks_on():
    sessions = simulate_loop(model("shadow"), anticipation(Rates()), sessions=6, seed=1)
    taken, left = (sessions.steps[..., STEPS.index(kind)] for kind in ("taken", "left"))
    assert not taken.any()
    assert not left.any()
    assert (sessions.updates[:, -1] > 0).all()


def test_what_is_not_taught_or_not_taken_up_leaves_the_robot_tossing_coins():
    """In the first block semi acts by no knowledge: step for step as where nothing teaches."""
    one = ClosedParams(blocks=1, episodes_per_block=8)
    semi = simulate_loop(model("semi", closed=one), PERFECT, sessions=4, seed=2)
    untaught = simulate_loop(model("closed", closed=one, teaches=0.0), PERFECT, sessions=4, seed=2)
    assert np.array_equal(semi.steps, untaught.steps)
    assert (untaught.policies == 0.5).all()
    assert not untaught.decisions.any()
    assert not untaught.updates.any()
    closed = simulate_loop(model("closed", closed=one), PERFECT, sessions=4, seed=2)
    assert not np.array_equal(semi.steps, closed.steps)


def test_a_decision_that_comes_late_for_its_step_is_heeded_one_step_later():
    one = ClosedParams(blocks=1, episodes_per_block=1)
    misses = []
    for in_time in (1.0, 0.0):
        sessions = simulate_loop(model(name="votes", closed=one, in_time=in_time), PERFECT, sessions=60, seed=5)
        wrong = sessions.steps[..., [STEPS.index("taken"), STEPS.index("left")]].sum(axis=2)
        misses.append(wrong.mean())
        assert (sessions.updates > 0).all()
    # In time, only the first step is tossed for; else the first step of each direction, too.
    assert misses[0] < 1.0
    assert misses[1] > misses[0] + 0.4


def test_rates_of_the_decisions_are_those_of_the_decoder():
    rates = Rates(tnr_hh=70, tpr_hr=60, tnr_rr=80, tpr_rh=55)
    sessions = simulate_loop(model("shadow"), anticipation(rates), sessions=40, seed=7)
    found = rates_by_case(sessions)
    expected = rates.by_case / 100
    assert (np.abs(found.mean - expected) < 1.7 * found.half_width).all()


def test_a_decoder_that_says_that_the_actor_stays_seems_to_learn_where_each_makes_the_own_steps():
    """The third confound: it knows nothing, in open blocks it is rewarded for that, in the loop the robot takes all."""
    stays = independent(after_human=0.0, after_robot=0.0)
    shadow = simulate_loop(model("shadow", closed=ClosedParams()), stays, sessions=8, seed=1)
    closed = simulate_loop(model("closed", closed=ClosedParams()), stays, sessions=8, seed=1)
    assert (continuing(shadow).mean == 1).all()
    assert (staying(shadow).low > 0.7).all()
    assert at_end(shadow).low > 0.95
    assert at_end(closed, "robot").low > 0.95
    assert at_end(closed, "human").high < 0.8


def test_a_decoder_that_knows_nothing_and_says_both_alike_teaches_nothing():
    sessions = simulate_loop(
        model("shadow", closed=ClosedParams()), independent(after_human=0.5, after_robot=0.5), sessions=24, seed=1
    )
    end = at_end(sessions)
    assert abs(end.mean - 0.5) < 1.5 * end.half_width


def test_a_direct_trigger_is_wrong_as_often_as_the_decoder_and_a_learner_is_not():
    """Acting by the last decision alone, the robot errs as the decoder does, and goes on to."""
    decoder = anticipation(Rates.level(75))
    steps = {
        mode: simulate_loop(model(mode, closed=ClosedParams()), decoder, sessions=6, seed=4).steps[:, 13:]
        for mode in ("direct", "closed")
    }
    wrong = {
        mode: one[..., [STEPS.index("taken"), STEPS.index("left")]].sum() / one.sum() for mode, one in steps.items()
    }
    # The first step of an episode is a coin's.
    assert wrong["direct"] == pytest.approx(0.25 + 0.25 / 7.3, abs=0.03)
    assert wrong["closed"] < wrong["direct"] - 0.1


def test_surprise_at_what_the_robot_does_teaches_too():
    nothing = independent(after_human=0.5, after_robot=0.5)
    alone = simulate_loop(model(closed=ClosedParams(), teaches=0.0, errp=(90.0, 90.0)), nothing, sessions=4, seed=4)
    assert at_end(alone).low > 0.9
    assert (alone.updates[:, -1] > 0).all()
    assert not alone.decisions.any()


def test_a_person_who_adapts_is_scored_by_their_own_choice_and_comes_to_expect_what_the_robot_does():
    """The robot that never learns tosses coins: what is expected drifts away from who owns a step."""
    adapting = ClosedParams(blocks=2, episodes_per_block=10, adapts=True)
    still, drifting = (
        simulate_loop(model("closed", closed=one, floor=0.5), PERFECT, sessions=12, seed=2)
        for one in (ClosedParams(blocks=2, episodes_per_block=10), adapting)
    )
    assert (rates_by_case(still).mean == 1).all()
    assert (rates_by_case(drifting).mean < 0.9).all()
    assert (rates_by_case(drifting).high < 1).all()


def test_who_often_presses_a_wrong_key_leaves_many_diagonals():
    rare, often = (
        simulate_loop(model("shadow", session=SessionParams(wrong_key_rate=rate)), PERFECT, sessions=6, seed=2)
        for rate in (0.0, 0.3)
    )
    diagonal = STEPS.index("diagonal")
    assert not rare.steps[..., diagonal].any()
    assert often.steps[..., diagonal].any()


def test_owners_stay_unless_they_are_drawn_anew():
    still = simulate_loop(model(), PERFECT, sessions=8, seed=1)
    anew = simulate_loop(
        model(closed=ClosedParams(blocks=4, episodes_per_block=2, reassign=True)), PERFECT, sessions=8, seed=1
    )
    assert (still.owners == still.owners[:, :1]).all()
    assert (still.owners.sum(axis=2) == 2).all()
    assert (anew.owners != anew.owners[:, :1]).any()


@pytest.mark.parametrize(
    ("how", "words"),
    [({"mode": "open"}, "'open'"), ({"teaches": 1.5}, "1.5"), ({"mode": "shadow", "errp": (60, 60)}, "errp")],
)
def test_what_is_no_model_is_refused(how, words):
    with pytest.raises(ValueError, match=words):
        model(**how)
