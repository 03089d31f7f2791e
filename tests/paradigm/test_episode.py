"""An episode step by step: whose key counts, and what its parts draw from."""

import numpy as np
import pytest

from hrcneuro.paradigm.episode import ROBOTS_KEY, ROBOTS_TURN, Episode, play
from hrcneuro.paradigm.owners import TILES, Areas, Directions
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.partners import Human
from hrcneuro.paradigm.session import draw_session

PATH = ((3, 1), (3, 2), (2, 2), (2, 3))


def episode(owners, *, error_rate=0.0, seed=0):
    return Episode(PATH, owners, error_rate=error_rate, errors=np.random.default_rng(seed))


def test_a_step_at_a_time_to_the_goal():
    one = episode(Directions(frozenset("EW")))
    assert (one.actor, one.target, one.over) == ("human", "E", False)
    one.act("E")
    assert (one.actor, one.target, one.tile) == ("robot", "N", (3, 2))
    assert one.plan() == "N"
    one.act("N")
    assert one.act("E").trial == 2
    assert one.over
    with pytest.raises(ValueError, match="over"):
        one.act("E")


def test_keys_of_the_robots_do_not_count():
    one = episode(Directions(frozenset("EW")))
    assert one.refusal("E") == one.refusal("W") == ""
    assert one.refusal("N") == one.refusal("S") == ROBOTS_KEY
    with pytest.raises(ValueError, match="'N' is no direction that the human commands here"):
        one.act("N")
    one.act("E")
    assert {one.refusal(key) for key in "NESW"} == {ROBOTS_TURN}
    with pytest.raises(ValueError, match="robot"):
        one.act("E")


def test_all_four_keys_count_in_the_persons_area():
    one = episode(Areas(frozenset(TILES)))
    assert {one.refusal(key) for key in "NESW"} == {""}
    assert {episode(Areas(frozenset())).refusal(key) for key in "NESW"} == {ROBOTS_TURN}


def test_a_wrong_key_moves_and_the_pending_tile_waits():
    one = episode(Areas(frozenset(TILES)))
    move = one.act("S")
    assert (move.key_wrong, move.executed, one.tile, one.target) == (True, "S", (4, 1), "NE")


@pytest.mark.parametrize("seed", range(5))
def test_what_goes_wrong_depends_on_no_key(seed):
    everywhere = Areas(frozenset(TILES))
    careful = play(episode(everywhere, error_rate=0.4, seed=seed), Human(0.0), keys=np.random.default_rng(1))
    clumsy = play(episode(everywhere, error_rate=0.4, seed=seed), Human(0.3), keys=np.random.default_rng(2))
    both = min(len(careful), len(clumsy))
    assert [move.error for move in careful[:both]] == [move.error for move in clumsy[:both]]


def test_each_part_of_a_block_draws_from_its_own_generator():
    params = SessionParams(practice_episodes=1, blocks=4, episodes_per_block=3)
    _, blocks = draw_session(params, rng=np.random.default_rng(3))
    _, others = draw_session(params, rng=np.random.default_rng(3))
    for block in others:
        block.draw.keys.random(7)
        block.draw.timing.random(5)
        block.draw.errors.random(3)
    for one, other in zip(blocks, others, strict=True):
        assert one.owners == other.owners
        # The whole path is drawn before an episode is played: what is played changes none.
        assert [e.path for e in one.episodes()] == [e.path for e in other.episodes()]


def test_a_later_block_needs_none_before_it():
    params = SessionParams(practice_episodes=1, blocks=4, episodes_per_block=2)
    human, blocks = draw_session(params, rng=np.random.default_rng(3))
    played = [[play(e, human, keys=b.draw.keys) for e in b.episodes()] for b in blocks]
    _, fresh = draw_session(params, rng=np.random.default_rng(3))
    last = fresh[-1]
    assert [play(e, human, keys=last.draw.keys) for e in last.episodes()] == played[-1]
