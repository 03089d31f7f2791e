"""The flow of closed blocks: choices as keys open, waits, keys, what a simulated amplifier is told, what is logged."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from quick_arm import Lab

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.ports import Order
from hrcneuro.experiment.turns import EARLY
from hrcneuro.paradigm.closed import HUMAN, draw_closed, play_closed
from hrcneuro.paradigm.episode import ROBOTS_TURN
from hrcneuro.paradigm.markers import block_in, move_in
from hrcneuro.paradigm.owners import Directions
from hrcneuro.paradigm.params import ClosedParams, SessionParams
from hrcneuro.paradigm.session import draw_session
from hrcneuro.paradigm.timing import IN_RADIUS

SMALL = ClosedParams(blocks=2, episodes_per_block=3)


class Said:
    """A closed loop that says the same all the time."""

    def __init__(self, policy, decided=""):
        self.policy, self.decided = policy, decided
        self.note, self.refused = lambda kind, about: None, Counter()


def always(human):
    return Said({step: float(step in human) for step in "NESW"})


HALF = dict.fromkeys("NESW", 0.5)


def chosen(lab):
    return [about for kind, _, about in lab.log.events if kind == "choice"]


def whens(lab):
    return [when for kind, when, _ in lab.log.events if kind == "choice"]


@pytest.mark.parametrize("seed", range(4))
def test_the_session_goes_as_the_rules_alone_have_it(seed):
    """With the same generators, as the null model of the loop plays it."""
    lab = Lab(SMALL, seed=seed, policies=Said(HALF)).run()
    assert lab.flow.seen.whole
    human, _ = draw_session(SessionParams(), rng=np.random.default_rng(seed))
    expected = []
    for block in draw_closed(SMALL, rng=np.random.default_rng(seed)):
        for episode in block.episodes():
            expected += [
                (choice.step, choice.drawn, move.actor, move.intended, move.row, move.col)
                for choice, move in play_closed(episode, human, HALF, keys=block.draw.keys, choices=block.choices)
            ]
    made = [
        (choice["step"], choice["drawn"], row["actor"], row["intended"], row["row"], row["col"])
        for choice, row in zip(chosen(lab), lab.log.rows, strict=True)
    ]
    assert made == expected
    assert {row["error"] for row in lab.log.rows} == {False}


def test_in_shadow_it_goes_by_the_owners():
    lab = Lab(SMALL, policies=Said(None)).run()
    for choice, row in zip(chosen(lab), lab.log.rows, strict=True):
        assert len(choice["step"]) == 2 or choice["owner"] == row["actor"]


def test_the_robot_waits_for_the_person_before_it_makes_what_it_left_lying():
    lab = Lab(SMALL, policies=always("NESW"), wait_s=1.5).run()
    waits = [
        row["onset_s"] - when
        for when, choice, row in zip(whens(lab), chosen(lab), lab.log.rows, strict=True)
        if choice["owner"] == "robot" and len(choice["step"]) == 1 and choice["trial"]
    ]
    assert waits
    assert min(waits) >= 1.5 - 1e-9
    assert max(waits) < 1.6
    keys = [direction for direction, ignored, _ in lab.log.keys]
    # The person presses for the own steps alone.
    assert len(keys) == sum(row["actor"] == HUMAN for row in lab.log.rows)


@pytest.mark.parametrize(("human", "one", "other"), [("NESW", "left", "taken"), ("", "taken", "left")])
def test_steps_taken_from_the_person_and_steps_left_lying_are_counted(human, one, other):
    lab = Lab(SMALL, policies=always(human)).run()
    whose = "robot" if one == "left" else HUMAN
    number = sum(choice["owner"] == whose and len(choice["step"]) == 1 for choice in chosen(lab))
    assert getattr(lab.flow.seen, one) == number > 0
    assert getattr(lab.flow.seen, other) == 0


def test_how_long_the_robot_waited_for_the_person_reaches_no_marker():
    """The loop hears EEG and markers alone: what it learns cannot depend on who was waited for in vain."""
    told = []
    for wait_s in (0.5, 4.0):
        lab = Lab(SMALL, policies=always("NESW"), wait_s=wait_s).run()
        assert lab.flow.seen.left
        told.append([request.marker for _, request in lab.sent if isinstance(request, m.Go)])
    assert told[0] == told[1]


def test_it_is_chosen_as_keys_open():
    lab = Lab(SMALL, policies=Said(HALF)).run()
    rows = lab.log.rows
    for when, choice, before in zip(whens(lab)[1:], chosen(lab)[1:], rows, strict=False):
        if choice["trial"]:
            assert when == pytest.approx(before["onset_s"] + IN_RADIUS * before["t_f_s"])


def test_a_decision_is_in_time_where_it_is_that_of_the_move_before():
    said = Said(HALF)
    lab = Lab(SMALL, policies=said)
    while not lab.flow.over:
        gone = [request.marker for _, request in lab.sent if isinstance(request, m.Go)]
        if gone:
            said.decided = gone[-1] if len(gone) % 3 else gone[0]
        lab.step()
    heard = [choice["in_time"] for choice in chosen(lab)]
    assert {None, True, False} == set(heard)
    assert all((one is None) == (choice["trial"] == 0) for one, choice in zip(heard, chosen(lab), strict=True))


def test_a_persons_keys():
    lab = Lab(SMALL, simulated=False, policies=always("NESW"))
    while not (chosen(lab) and chosen(lab)[-1]["actor"] == HUMAN and not lab.turns.released):
        if not lab.step():
            lab.now += 2
            if lab.scenes[-1].title:
                lab.flow.key(m.Key("N", lab.now))
            else:
                break
    own = sorted(lab.turns.episode.owners.human)
    for key in sorted(set("NESW") - set(own)):
        lab.flow.key(m.Key(key, lab.now))
        assert lab.log.keys[-1][1]
    lab.flow.key(m.Key(lab.turns.episode.target, lab.now))
    assert lab.log.keys[-1][1] == ""
    # The arm is on its way: nobody has chosen yet who makes the next step.
    if not lab.turns.episode.over:
        lab.step()
        lab.flow.key(m.Key(own[0], lab.now))
        assert lab.log.keys[-1][1] == EARLY


def test_keys_do_nothing_where_the_robot_left_its_own_step_lying():
    lab = Lab(SMALL, simulated=False, policies=always("NESW"))
    lab.run(lambda lab: bool(lab.scenes[-1].title) and lab.flow.wakes is None)
    for _ in range(10_000):
        if chosen(lab) and chosen(lab)[-1]["owner"] == "robot" and not lab.turns.released:
            break
        if not lab.step():
            lab.now += 2
            lab.flow.key(m.Key("N" if lab.scenes[-1].title else lab.turns.episode.target, lab.now))
    n = len(lab.log.rows)
    lab.flow.key(m.Key(chosen(lab)[-1]["step"], lab.now))
    assert lab.log.keys[-1][1] == ROBOTS_TURN
    assert len(lab.log.rows) == n


def test_markers_say_that_the_block_is_closed():
    lab = Lab(SMALL, policies=Said(HALF)).run()
    blocks = [block_in(one.text) for _, one in lab.sent if isinstance(one, m.Mark) and one.text.startswith("block/")]
    moves = [move_in(one.marker) for _, one in lab.sent if isinstance(one, m.Go)]
    assert len(blocks) == 2
    assert all(one["closed"] for one in blocks + moves)


def test_a_simulated_amplifier_is_told_of_the_own_key_ahead_and_of_every_move_before_it_begins():
    lab = Lab(ClosedParams(blocks=2, episodes_per_block=8), truth=True, policies=Said(HALF)).run()
    told = {}
    for at, request in lab.sent:
        if isinstance(request, m.Truth):
            told.setdefault(request.move["marker"], (at, request.move))
    gone = [request for _, request in lab.sent if isinstance(request, m.Go)]
    for row, go, choice in zip(lab.log.rows, gone, chosen(lab), strict=True):
        at, move = told[go.marker]
        assert at <= row["onset_s"]
        assert move["actor"] == row["actor"]
        if row["actor"] == HUMAN and choice["trial"]:
            assert row["onset_s"] - at >= 0.3
            assert move["key_s"] == pytest.approx(row["onset_s"], abs=1e-6)
    # Whom the person expects next is whose the step is, not who will make it.
    expected = {marker: move["condition_before"] for marker, (_, move) in told.items()}
    for go, after in zip(gone, chosen(lab)[1:], strict=False):
        if after["trial"]:
            assert expected[go.marker][1] == after["owner"][0].upper()


def test_after_a_pause_the_robot_waits_anew_for_the_person_before_what_it_left_lying():
    lab = Lab(SMALL, policies=always("NESW"), wait_s=5.0)

    def lies(lab):
        one = chosen(lab)[-1] if chosen(lab) else {"trial": 0}
        return bool(one["trial"]) and one["owner"] == "robot" and len(one["step"]) == 1 and not lab.turns.released

    lab.run(lies)
    made = len(lab.log.rows)
    lab.flow.pause(lab.now, "")
    lab.now += 1.0
    lab.flow.order(Order.GO_ON, lab.now)
    went_on = lab.now
    lab.run(lambda lab: len(lab.log.rows) > made)
    assert lab.log.rows[-1]["onset_s"] - went_on >= 5.0


def pressed(owners, keys):
    """Return a whole session of a robot that makes every step, while a person with these directions presses keys."""
    lab = Lab(SMALL, simulated=False, policies=always(""))
    lab.flow._blocks = (replace(block, owners=owners) for block in list(lab.flow._blocks))
    for number in range(10_000):
        if lab.flow.over:
            break
        if not lab.step():
            lab.now += 2.0
            lab.flow.key(m.Key("N", lab.now))
        elif not lab.scenes[-1].title:
            lab.flow.key(m.Key(keys[number % len(keys)], lab.now))
    assert lab.flow.seen.whole
    return lab


def test_no_marker_tells_who_owns_a_direction_or_which_keys_were_pressed():
    """A robot that makes every step is heard of alike, whoever owns it, by marker and by duration."""
    labs = [pressed(Directions(frozenset(own)), keys) for own, keys in (("NE", "NESW"), ("SW", "N"))]
    first, second = ([one for _, one in lab.sent if isinstance(one, m.Go)] for lab in labs)
    assert [(go.marker, go.t_f) for go in first] == [(go.marker, go.t_f) for go in second]
    assert {row["actor"] for row in labs[0].log.rows} == {"robot"}
    assert HUMAN in {choice["owner"] for choice in chosen(labs[0])}
    assert [choice["owner"] for choice in chosen(labs[0])] != [choice["owner"] for choice in chosen(labs[1])]
    assert [key[0] for key in labs[0].log.keys] != [key[0] for key in labs[1].log.keys]


def test_a_pause_changes_no_choice():
    whole = Lab(SMALL, policies=Said(HALF)).run()
    lab = Lab(SMALL, policies=Said(HALF))
    while not lab.flow.over and len(lab.log.rows) < 5:
        lab.step()
    lab.flow.pause(lab.now, "")
    while lab.flow._held is None:
        lab.step()

    lab.flow.order(Order.GO_ON, lab.now)
    lab.run()
    assert [one["drawn"] for one in chosen(lab)] == [one["drawn"] for one in chosen(whole)]
    assert [row["actor"] for row in lab.log.rows] == [row["actor"] for row in whole.log.rows]


def test_it_is_counted_of_how_many_moves_the_loop_has_told_nothing():
    lab = Lab(SMALL, policies=Said(HALF))
    lab.run(lambda lab: len(lab.log.rows) == 4)
    assert lab.flow.seen.unheard == 4
    lab.flow.took_up("policy", lab.now, {"mode": "semi", "marker": ""})
    assert (lab.flow.seen.unheard, lab.flow.seen.loop) == (4, "semi")
    lab.flow.took_up("policy", lab.now, {"mode": "semi", "marker": "move/1"})
    assert lab.flow.seen.unheard == 0


def test_whose_turn_it_is_is_shown_once_it_is_known():
    lab = Lab(SMALL, policies=always(""), show_turn=True)
    lab.run(lambda lab: bool(chosen(lab)))
    assert lab.scenes[-1].turn == "robot"
