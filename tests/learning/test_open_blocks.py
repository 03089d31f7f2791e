"""What is learned in the study's own blocks: from moves of a simulated session, which have owners and errors."""

import numpy as np
import pytest

from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop_decoders import anticipation, of_rule
from hrcneuro.learning.loop_scores import accuracy, continuing, rates_by_case, staying
from hrcneuro.learning.online import SUBTASKS
from hrcneuro.learning.open_blocks import learn_open, owned
from hrcneuro.learning.rates import Rates
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import draw_session, simulate_session

PARAMS = SessionParams(practice_episodes=2, blocks=4, episodes_per_block=6)
PAPER = kinds(alpha=0.05, ddof=0, horizon=40.0)["paper"]


@pytest.fixture(scope="module")
def moves():
    return simulate_session(PARAMS, rng=np.random.default_rng(8))


def learned(moves, decoder, repetitions=1):
    return learn_open(moves, decoder, PAPER, tau=0.1, rng=np.random.default_rng(1), repetitions=repetitions)


def test_each_block_of_ic_is_learned_with_its_own_owners(moves):
    _, blocks = draw_session(PARAMS, rng=np.random.default_rng(8))
    found = learned(moves, anticipation(Rates.level(100)))
    own = [one.owners.human for one in blocks if one.block.scenario == "iC" and not one.block.practice]
    assert len(found.policies) == len(own) == 2
    for session, human in zip(found.owners, own, strict=True):
        assert (session == [one in human for one in SUBTASKS]).all()
    assert (accuracy(found)[:, -1] > 0.95).all()
    assert (rates_by_case(found).mean == 1).all()


def test_what_teaches_are_the_pairs_that_count_where_the_path_leads_straight_on(moves):
    found = learned(moves, of_rule("stays"), repetitions=3)
    iC = moves[(moves["scenario"] == "iC") & ~moves["practice"]]
    ahead = iC.groupby(["block", "episode"])["target"].shift(-1)
    pairs = iC[iC["condition_before"].notna() & ahead.isin(SUBTASKS)]
    assert found.updates[:, -1].sum() == 3 * len(pairs) == found.decisions.sum()
    assert (continuing(found).mean == 1).all()
    stay = pairs["condition_before"].isin(["HH", "RR"]).groupby(pairs["actor"]).mean()
    per_block = staying(found).mean
    assert per_block == pytest.approx([stay["robot"], stay["human"]], abs=0.05)


def test_the_rule_that_the_actor_stays_teaches_though_it_knows_nothing(moves):
    end = accuracy(learned(moves, of_rule("stays")))[:, -1]
    assert end.mean() > 0.75


def test_owners_are_told_by_straight_steps_alone(moves):
    block = moves[(moves["scenario"] == "iC") & ~moves["practice"] & (moves["block"] == 1)]
    assert owned(block) == owned(block[block["target"].str.len() == 1])
    assert len(owned(block)) == 2
