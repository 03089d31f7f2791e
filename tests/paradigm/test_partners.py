"""The robot's fixed choice and the human's habits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.paradigm.episode import EndlessEpisodeError, Episode, play
from hrcneuro.paradigm.grid import STEPS, beyond, move, toward
from hrcneuro.paradigm.owners import TILES, Areas, Directions, actor_of, draw_areas, draw_directions
from hrcneuro.paradigm.partners import Human, Move, draw_human, robot_plan
from hrcneuro.paradigm.paths import draw_path

EVERYWHERE = Areas(frozenset(TILES))
CAREFUL = Human(wrong_key=0.0)


def after(executed, *, intended="N", actor="human", error=True, tile=(3, 3), wrong=False):
    return [Move(0, actor, intended, executed, intended, error, *tile, wrong)]


@pytest.mark.parametrize(("target", "plan"), [("NE", "N"), ("NW", "N"), ("SE", "E"), ("SW", "S"), ("W", "W")])
def test_the_free_robot_has_a_fixed_way(target, plan):
    assert robot_plan(Areas(frozenset()), target) == plan


def test_the_robot_takes_its_own_component_of_a_split_diagonal():
    assert robot_plan(Directions(frozenset("NS")), "NE") == "E"
    assert robot_plan(Directions(frozenset("EW")), "NE") == "N"


def presses(human, owners, target, before, n=4000):
    rng = np.random.default_rng(1)
    keys = [human.press(owners, target, before, rng=rng) for _ in range(n)]
    return {way: keys.count(way) / n for way in STEPS}


def test_without_an_error_either_component_of_a_diagonal_is_as_likely():
    share = presses(CAREFUL, EVERYWHERE, "SE", after("N", error=False))
    assert share["S"] == pytest.approx(0.5, abs=0.03)
    assert share["S"] + share["E"] == 1


def test_most_errors_are_taken_back_more_so_where_that_keeps_to_the_own_area():
    before = after("E", tile=(3, 3))
    assert presses(Human(0.0, undo=0.8), EVERYWHERE, "NW", before)["W"] == pytest.approx(0.8, abs=0.02)
    # 0.8 are odds of 4; 2.2 times that, and that divided by 2.2.
    west, north = Areas(frozenset(set(TILES) - {(2, 3)})), Areas(frozenset(set(TILES) - {(3, 2)}))
    assert presses(Human(0.0, undo=0.8), west, "NW", before)["W"] == pytest.approx(8.8 / 9.8, abs=0.02)
    assert presses(Human(0.0, undo=0.8), north, "NW", before)["W"] == pytest.approx(1.818 / 2.818, abs=0.02)


WRONG = after("W", intended="W", error=False, wrong=True)


def test_an_episodes_first_wrong_key_is_rare_and_later_ones_are_likelier():
    human = Human(wrong_key=0.05, repeat=0.0, persistence=1.0, relapse=0.11)
    fresh = presses(human, EVERYWHERE, "N", after("N", error=False), n=20000)
    assert 1 - fresh["N"] == pytest.approx(0.05 * (0.4 + 0.6 * 0.05), abs=0.004)
    later = presses(human, EVERYWHERE, "N", [*WRONG, *after("N", error=False)])
    assert 1 - later["N"] == pytest.approx(0.11, abs=0.02)


@pytest.mark.parametrize(("before", "again"), [(WRONG, 0.4), (2 * WRONG, 0.52), (5 * WRONG, 0.7)])
def test_a_wrong_key_is_pressed_again_the_likelier_the_longer_the_run(before, again):
    human = Human(wrong_key=0.0, repeat=0.4, persistence=4.0, relapse=0.0)
    assert presses(human, EVERYWHERE, "N", before)["W"] == pytest.approx(again, abs=0.03)


def test_a_run_outlasts_a_turn_at_which_its_key_was_right_but_not_another_key():
    human = Human(wrong_key=0.0, repeat=0.4, persistence=4.0, relapse=0.0)
    right = after("W", intended="W", error=False)
    robots = after("S", intended="S", actor="robot", error=False)
    assert presses(human, EVERYWHERE, "N", [*WRONG, *right, *robots])["W"] == pytest.approx(0.4, abs=0.03)
    assert presses(human, EVERYWHERE, "N", [*WRONG, *after("N", error=False)])["N"] == 1


def test_a_wrong_key_is_not_pressed_again_where_the_grid_ends():
    human = Human(wrong_key=0.0, repeat=0.4, persistence=4.0, relapse=0.0)
    at_edge = after("W", intended="W", error=False, wrong=True, tile=(3, 0))
    assert presses(human, EVERYWHERE, "N", at_edge)["N"] == 1


def test_the_first_key_of_an_episode_is_right():
    assert presses(Human(wrong_key=1.0, repeat=0.0), EVERYWHERE, "N", [])["N"] == 1


def test_in_ic_only_the_own_keys_work():
    owners = Directions(frozenset("NE"))
    wrong = presses(Human(wrong_key=1.0, repeat=0.0), owners, "N", after("S", error=False))
    assert wrong["E"] == 1
    assert presses(Human(wrong_key=1.0, repeat=0.0), owners, "NE", after("S", error=False))["E"] < 0.6


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_subjects_rates_lie_in_the_logged_range(seed):
    human = draw_human(np.random.default_rng(seed))
    assert 0.001 <= human.wrong_key <= 0.07
    assert 0 <= human.undo <= 1


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.floats(0, 0.6))
def test_every_episode_follows_its_path_from_start_to_goal(seed, directions, error_rate):
    rng = np.random.default_rng(seed)
    path, owners = draw_path(rng), draw_directions(rng) if directions else draw_areas(rng)
    moves = play(Episode(path, owners, error_rate=error_rate, errors=rng), Human(0.05), keys=rng)
    tile, pending, slipped = path[0], 1, False
    for number, one in enumerate(moves):
        assert one.trial == number
        assert one.target == toward(tile, path[pending])
        assert one.actor == actor_of(owners, tile, one.target)
        assert one.key_wrong == (one.intended not in one.target)
        assert not (one.key_wrong and one.actor == "robot")
        assert not (one.error and slipped)
        if not one.error:
            assert one.executed == (one.intended if move(tile, one.intended) != tile else None)
        else:
            assert one.executed != one.intended
        tile = beyond(tile, one.executed) if one.executed else tile
        assert tile == (one.row, one.col)
        slipped = one.error
        pending += tile == path[pending]
    assert pending == len(path)


def test_partners_who_never_arrive_are_refused_with_their_rates():
    # An error in every other move leads from a neighbour of the pending tile away from it, and the next move back.
    path = ((3, 2), (3, 3), (3, 4))
    with pytest.raises(EndlessEpisodeError, match=r"within 5000 moves: error rate 1, wrong keys 0\.02"):
        rng = np.random.default_rng(0)
        play(Episode(path, Areas(frozenset()), error_rate=1.0, errors=rng), Human(0.02), keys=rng)
