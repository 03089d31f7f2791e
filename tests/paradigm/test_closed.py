"""Closed blocks: who makes a step is drawn from the policy; ownership decides only whether keys work."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.paradigm.closed import HUMAN, ROBOT, Choice, ClosedEpisode, Habits, draw_closed, play_closed
from hrcneuro.paradigm.episode import ROBOTS_KEY, ROBOTS_TURN
from hrcneuro.paradigm.owners import Directions
from hrcneuro.paradigm.params import ClosedParams
from hrcneuro.paradigm.partners import ROBOT_CHOICE, Human

STRAIGHT = ((2, 2), (1, 2), (0, 2), (0, 3))  # N, N, E
OWNERS = Directions(frozenset("NE"))
HALF = dict.fromkeys("NESW", 0.5)


def rng(seed=0):
    return np.random.default_rng(seed)


def policy(human=""):
    return {step: float(step in human) for step in "NESW"}


def played(owners=OWNERS, acted_by=HALF, seed=0, path=STRAIGHT):
    episode = ClosedEpisode(path, owners)
    return episode, list(play_closed(episode, Human(), acted_by, keys=rng(seed), choices=rng(seed + 1)))


def test_by_the_owners_everybody_makes_the_own_steps():
    for block in draw_closed(ClosedParams(blocks=2, episodes_per_block=5), rng=rng()):
        acted_by = {step: float(step in block.owners.human) for step in "NESW"}
        for episode in block.episodes():
            for choice, move in play_closed(episode, Human(), acted_by, keys=block.draw.keys, choices=block.choices):
                assert len(choice.step) == 2 or move.actor == choice.owner
                assert (choice.taken, choice.left, move.error) == (False, False, False)
            assert episode.tile == episode.path[-1]


def test_a_robot_that_is_sure_to_be_alone_takes_all():
    episode, steps = played(acted_by=policy())
    assert episode.over
    assert [choice.taken for choice, _ in steps] == [True, True, True]
    assert all(move.actor == ROBOT for _, move in steps)


def test_a_robot_that_leaves_all_to_the_person_makes_its_own_late():
    owners = Directions(frozenset("SW"))
    _, steps = played(owners, policy("NESW"))
    assert all(choice.left and move.actor == ROBOT for choice, move in steps)


@pytest.mark.parametrize("p", [0.0, 0.2, 0.7, 1.0])
def test_steps_are_drawn_as_the_policy_says(p):
    drawn = Counter()
    source = rng(3)
    for _ in range(2000):
        drawn[ClosedEpisode(STRAIGHT, OWNERS).choose({**HALF, "N": p}, source).drawn] += 1
    assert drawn[HUMAN] / 2000 == pytest.approx(p, abs=3.3 * np.sqrt(p * (1 - p) / 2000))


def test_a_step_is_drawn_once_and_draws_depend_on_nothing_that_is_pressed():
    episode, source = ClosedEpisode(STRAIGHT, OWNERS), rng(5)
    first = episode.choose(HALF, source)
    assert episode.choose(policy("NESW"), source) is first
    assert source.random() == rng(5).random(2)[1]


@given(st.sampled_from(sorted(ROBOT_CHOICE)), st.floats(0, 1), st.floats(0, 1))
def test_on_a_diagonal_the_robot_goes_where_it_is_surer(target, first, second):
    row, col = (0 if "N" in target else 2), (2 if "E" in target else 0)
    episode = ClosedEpisode(((1, 1), (row, col)), OWNERS)
    choice = episode.choose({**HALF, target[0]: first, target[1]: second}, rng())
    surer = ROBOT_CHOICE[target] if first == second else target[0] if first < second else target[1]
    assert (choice.way, choice.actor, choice.owner) == (surer, ROBOT, ROBOT)
    assert (choice.taken, choice.left) == (False, False)


def test_keys_count_where_the_robot_leaves_a_step_that_is_the_persons():
    episode = ClosedEpisode(STRAIGHT, OWNERS)
    episode.choose(policy("N"), rng())
    assert [episode.refusal(key) for key in "NESW"] == ["", "", ROBOTS_KEY, ROBOTS_KEY]
    robots = ClosedEpisode(STRAIGHT, Directions(frozenset("SW")))
    robots.choose(policy("N"), rng())
    assert {robots.refusal(key) for key in "NESW"} == {ROBOTS_TURN}


def test_a_wrong_key_leads_to_a_diagonal_which_the_robot_takes():
    episode = ClosedEpisode(STRAIGHT, OWNERS)
    episode.choose(policy("NE"), rng())
    assert episode.act("E").key_wrong
    assert (episode.target, episode.owner, episode.expected) == ("NW", ROBOT, ROBOT)


def test_nobody_moves_before_the_choice_nor_where_they_may_not():
    episode = ClosedEpisode(STRAIGHT, OWNERS)
    with pytest.raises(ValueError, match="nobody was chosen"):
        episode.act("N")
    episode.choose(policy("N"), rng())
    with pytest.raises(ValueError, match="no direction that the human commands"):
        episode.act("S")


def test_what_a_key_would_do_is_told_without_doing_it():
    episode = ClosedEpisode(STRAIGHT, OWNERS)
    move, ahead = episode.after("N")
    assert (episode.tile, episode.moves) == ((2, 2), [])
    episode.choose(policy("N"), rng())
    assert (episode.act("N"), episode.target) == (move, ahead)


@given(st.integers(0, 50), st.booleans())
def test_directions_are_kept_over_the_session_unless_they_are_to_be_reassigned(seed, reassign):
    blocks = draw_closed(ClosedParams(blocks=8, reassign=reassign), rng=rng(seed))
    assert (len({block.owners for block in blocks}) == 1) != (reassign and len({b.owners for b in blocks}) > 1)
    assert all(block.closed and block.block.scenario == "iC" and not block.block.practice for block in blocks)


def test_the_same_seed_gives_the_same_paths_whatever_the_robot_does():
    one, other = (draw_closed(ClosedParams(blocks=1, episodes_per_block=6), rng=rng(9))[0] for _ in range(2))
    paths = []
    for block, acted_by in ((one, policy()), (other, policy("NESW"))):
        paths.append([])
        for episode in block.episodes():
            paths[-1].append(episode.path)
            list(play_closed(episode, Human(), acted_by, keys=block.draw.keys, choices=block.choices))
    assert paths[0] == paths[1]


def test_a_person_who_adapts_comes_to_expect_what_the_robot_does():
    habits = Habits()
    assert habits.expected("N", HUMAN) == HUMAN
    # It drifts: what is seen once turns nobody.
    for _ in range(6):
        habits.saw("N", ROBOT, HUMAN)
        assert habits.expected("N", HUMAN) == HUMAN
    habits.saw("N", ROBOT, HUMAN)
    assert habits.expected("N", HUMAN) == ROBOT
    # Owners that are drawn anew are known to the person.
    assert habits.expected("N", ROBOT) == ROBOT
    for _ in range(4):
        habits.saw("N", HUMAN, HUMAN)
    assert habits.expected("N", HUMAN) == HUMAN
    assert habits.expected("E", HUMAN) == HUMAN
    block = draw_closed(ClosedParams(blocks=1, episodes_per_block=20, adapts=True), rng=rng(2))[0]
    for episode in block.episodes():
        list(play_closed(episode, Human(), policy(), keys=block.draw.keys, choices=block.choices))
    assert {episode.whom(step) for step in block.owners.human} == {ROBOT}
    assert {episode._owner(step) for step in block.owners.human} == {HUMAN}


def test_a_choice_says_who_acts():
    assert Choice("N", HUMAN, HUMAN, 0.9, "N").actor == HUMAN
    for owner, drawn in ((HUMAN, ROBOT), (ROBOT, HUMAN), (ROBOT, ROBOT), (ROBOT, "")):
        assert Choice("N", owner, drawn, 0.5, "N").actor == ROBOT
