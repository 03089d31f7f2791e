"""The flow of a session: the simulated study's rows, keys that count, pauses, trouble, the end."""

import itertools

import numpy as np
import pandas as pd
import pytest
from quick_arm import Lab

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.ports import Order
from hrcneuro.experiment.turns import EARLY, NOTHING_DUE
from hrcneuro.paradigm.episode import ROBOTS_KEY, ROBOTS_TURN
from hrcneuro.paradigm.owners import Areas, allowed
from hrcneuro.paradigm.session import SessionParams, simulate_session

TIMES = ["onset_s", "t_f_s", "soa_s"]
SMALL = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)


def expected(params=SMALL, seed=0):
    return simulate_session(params, rng=np.random.default_rng(seed)).drop(columns=TIMES)


def rows(lab):
    table = lab.log.table()
    return table[[name for name in table if name not in TIMES]]


def same(left, right):
    left, right = (table.assign(executed=table["executed"].fillna("")) for table in (left, right))
    pd.testing.assert_frame_equal(left[sorted(left)], right[sorted(right)], check_dtype=False)


def begun(lab):
    return "episode" in vars(lab.turns)


@pytest.mark.parametrize("seed", range(4))
def test_a_simulated_person_at_the_keys_gives_the_simulated_studys_rows(seed):
    params = SessionParams(practice_episodes=2, blocks=4, episodes_per_block=4)
    lab = Lab(params, seed=seed).run()
    assert lab.flow.over
    assert lab.flow.seen.whole
    same(rows(lab), expected(params, seed))
    onsets = np.array([row["onset_s"] for row in lab.log.rows])
    assert (np.diff(onsets) >= 0.6).all()


def test_a_person_with_the_same_keys_gives_the_same_rows():
    simulated = Lab(SMALL).run()
    keys = [row["intended"] for row in simulated.log.rows if row["actor"] == "human"]
    lab = Lab(SMALL, simulated=False)
    while not lab.flow.over:
        if lab.step():
            continue
        if lab.scenes[-1].title:
            lab.now += 2
            lab.flow.key(m.Key("N", lab.now))
        else:
            lab.now += 0.3
            lab.flow.key(m.Key(keys.pop(0), lab.now))
    assert not keys
    same(rows(lab), expected())


def test_the_path_appears_once_the_arm_stands_on_the_start_tile():
    lab = Lab(SMALL)
    lab.run(lambda lab: any(isinstance(request, m.Approach) for _, request in lab.sent))
    assert not lab.scenes[-1].path
    start, asked = lab.sent[-1][1].tile, lab.now
    lab.run(lambda lab: bool(lab.scenes[-1].path))
    assert lab.scenes[-1].path[0] == start
    assert lab.now > asked + 1.0


def test_keys_count_from_the_radius_on_in_the_persons_turn_only():
    lab = Lab(SMALL, simulated=False)
    while not lab.flow.over:
        if lab.step():
            if begun(lab) and lab.turns.released and not lab.scenes[-1].title:
                episode = lab.turns.episode
                moves = len(episode.moves)
                mine = "" if episode.over else allowed(episode.owners, "human").intersection(episode.target)
                lab.flow.key(m.Key(min(mine) if mine else "N", lab.now))
                assert (len(lab.turns.episode.moves) == moves) == bool(lab.log.keys[-1][1])
            continue
        if lab.scenes[-1].title:
            lab.now += 2
            lab.flow.key(m.Key("N", lab.now))
            continue
        lab.now += 0.3
        episode = lab.turns.episode
        mine, moves = allowed(episode.owners, "human"), len(episode.moves)
        for key in sorted(set("NESW") - mine):
            lab.flow.key(m.Key(key, lab.now))
            assert lab.log.keys[-1][1] == ROBOTS_KEY
        assert len(episode.moves) == moves
        lab.flow.key(m.Key(next(key for key in episode.target if key in mine), lab.now))
        assert lab.log.keys[-1][1] == ""
        assert len(episode.moves) == moves + 1
    verdicts = [ignored for _, ignored, _ in lab.log.keys]
    assert set(verdicts) == {EARLY, ROBOTS_TURN, ROBOTS_KEY, NOTHING_DUE, ""}
    assert {why: verdicts.count(why) for why in set(verdicts)} == dict(lab.flow.seen.keys)


def test_a_key_is_judged_by_when_it_went_down_not_by_when_it_was_heard():
    """One that went down before the tool came within its radius may be heard after that."""
    lab, judged = Lab(SMALL, simulated=False), 0
    while not lab.flow.over:
        if lab.step():
            continue
        if lab.scenes[-1].title:
            lab.now += 2
            lab.flow.key(m.Key("N", lab.now))
            continue
        episode = lab.turns.episode
        key = min(allowed(episode.owners, "human").intersection(episode.target))
        opened = lab.flow.seen.moves[-1].radius if episode.moves else lab.now
        for when, verdict in ((opened - 1e-3, EARLY), (opened, "")):
            lab.flow.key(m.Key(key, when))
            assert lab.log.keys[-1] == (key, verdict, when)
        judged += bool(episode.moves)
    assert judged > 3
    assert lab.flow.seen.whole


def test_a_pause_comes_at_rest_and_goes_on_with_the_same_session():
    lab = Lab(SMALL)
    lab.run(lambda lab: len(lab.log.rows) == 3)
    lab.flow.order(Order.PAUSE, lab.now)
    lab.run()
    assert not lab.flow.over
    assert lab.scenes[-1].title == "Pause"
    assert not lab.turns.released
    lab.flow.order(Order.GO_ON, lab.now)
    lab.run()
    assert lab.flow.seen.whole
    same(rows(lab), expected())


@pytest.mark.parametrize("moves", [0, 1, 5, 9, 14])
def test_an_arm_that_was_stopped_makes_the_move_again_and_nothing_else_changes(moves):
    lab = Lab(SMALL)
    lab.run(lambda lab: len(lab.log.rows) == moves and begun(lab))
    lab.run(lambda lab: isinstance(lab.sent[-1][1], m.Go))
    lab.halt()
    lab.run()
    assert lab.scenes[-1].title == "Stopped"
    assert lab.scenes[-1].alarm
    lab.flow.order(Order.GO_ON, lab.now)
    lab.run()
    assert lab.flow.seen.whole
    assert lab.flow.seen.stops == 1
    same(rows(lab), expected())


@pytest.mark.parametrize("steps", range(1, 60, 7))
def test_a_stop_at_any_instant_loses_and_doubles_no_row(steps):
    lab = Lab(SMALL).after(steps)
    lab.halt()
    lab.run()
    lab.flow.order(Order.GO_ON, lab.now)
    lab.run()
    assert lab.flow.seen.whole
    same(rows(lab), expected())


@pytest.mark.parametrize("steps", range(1, 90, 7))
def test_a_pause_at_any_instant_changes_nothing_but_times(steps):
    lab = Lab(SMALL).after(steps)
    lab.flow.pause(lab.now, "a stream is lost")
    lab.run()
    if not lab.flow.over:
        assert lab.scenes[-1].alarm
        lab.flow.order(Order.GO_ON, lab.now)
        lab.run()
    assert lab.flow.seen.whole
    same(rows(lab), expected())


@pytest.mark.parametrize("between", range(4))
def test_a_pause_taken_back_before_the_arm_rests_changes_nothing_but_times(between):
    """Also where the tool has come within its radius meanwhile, so that the next turn was not given to anybody."""
    for steps in range(1, 60):
        lab = Lab(SMALL).after(steps)
        lab.flow.pause(lab.now, "")
        lab.after(between)
        lab.flow.order(Order.GO_ON, lab.now)
        lab.run()
        assert lab.flow.seen.whole, steps
        same(rows(lab), expected())


@pytest.mark.parametrize("steps", range(1, 60, 7))
def test_escape_twice_ends_at_rest(steps):
    lab = Lab(SMALL).after(steps)
    lab.flow.key(m.Key("escape", lab.now))
    lab.flow.key(m.Key("escape", lab.now + 0.5))
    lab.run()
    assert lab.flow.over
    assert not lab.flow.seen.whole
    assert isinstance(lab.sent[-1][1], m.Finish)
    done = lab.log.rows
    whole = ["scenario", "block", "episode", "trial", "actor", "intended", "executed", "error", "row", "col"]
    same(pd.DataFrame(done, columns=whole), expected()[whole].head(len(done)))


def test_one_escape_does_nothing():
    lab = Lab(SMALL)
    lab.flow.key(m.Key("escape", 1.0))
    lab.flow.key(m.Key("escape", 4.0))
    assert lab.run().flow.seen.whole


def test_a_session_that_was_broken_off_goes_on_as_it_would_have():
    whole, rest = expected(), rows(Lab(SMALL, blocks=slice(2, None)).run())
    same(rest, whole[~whole["practice"]].reset_index(drop=True))


def test_the_colours_are_swapped_from_one_block_of_areas_to_the_next():
    lab = Lab(SessionParams(practice_episodes=1, blocks=6, episodes_per_block=1)).run()
    colours = [block.owners.human_colour for block in lab.log.blocks if isinstance(block.owners, Areas)]
    assert len(colours) == 4
    assert all(a != b for a, b in itertools.pairwise(colours))
    shown = [scene for scene in lab.scenes if scene.title == "Next block" and scene.human_colour]
    assert [scene.human_colour for scene in shown] == colours[1:]


def test_a_simulated_amplifier_is_told_of_each_move_before_it_begins():
    lab = Lab(SMALL, truth=True).run()
    told = [(at, request.move) for at, request in lab.sent if isinstance(request, m.Truth)]
    table = lab.log.table().set_index(["practice", "block", "episode", "trial"])
    assert len(told) == len(table)
    for at, move in told:
        tags = dict(tag.split("=") for tag in move["marker"].split("/") if "=" in tag)
        row = table.loc["practice" in move["marker"], int(tags["block"]), int(tags["episode"]), int(tags["trial"])]
        for name in ("actor", "error", "prev_error", "turn", "scenario", "condition_before"):
            assert move[name] == row[name] or (move[name] is None and row[name] is None)
        assert row["onset_s"] - at >= 0.3
        # Before an episode's first move nothing moves: when the person will press is known as they do.
        assert ("key_s" in move) == (move["actor"] == "human" and int(tags["trial"]) > 0)
        if "key_s" in move:
            assert move["key_s"] == pytest.approx(row["onset_s"], abs=1e-6)


@pytest.mark.parametrize("moves", [0, 1, 5, 9, 14])
@pytest.mark.parametrize("ends", [False, True])
def test_an_arm_that_is_lost_in_a_pause_changes_nothing_but_times(moves, ends):
    """Also where the pause came with the last move of an episode."""
    lab = Lab(SMALL)
    lab.run(lambda lab: len(lab.log.rows) >= moves and begun(lab) and (not ends or lab.turns.episode.over))
    lab.flow.pause(lab.now, "")
    lab.run()
    assert lab.scenes[-1].title == "Pause"
    lab.halt()
    lab.run()
    assert lab.scenes[-1].title == "Stopped"
    lab.flow.order(Order.GO_ON, lab.now)
    lab.run()
    assert lab.flow.seen.whole
    same(rows(lab), expected())


def test_only_markers_that_are_sent_are_counted():
    """Moves that the grid's edge stops send none."""
    lab = Lab(SessionParams(practice_episodes=1, blocks=4, episodes_per_block=6), seed=10).run()
    moves = [request for _, request in lab.sent if isinstance(request, m.Go)]
    stays = sum(move.start == move.end for move in moves)
    assert stays
    marks = sum(isinstance(request, m.Mark) for _, request in lab.sent)
    assert lab.flow.seen.markers == len(moves) - stays + marks


def test_trouble_beside_the_arm_pauses_at_rest_and_changes_nothing_but_times():
    lab = Lab(SMALL)
    lab.run(lambda lab: begun(lab) and lab.turns.released)
    lab.flow.report(m.Trouble("the trigger port did not take code 1", "plug it in", lab.now))
    lab.flow.tick(lab.now)
    lab.run()
    assert lab.scenes[-1].title == "Pause"
    assert not lab.turns.released
    seen = lab.flow.seen
    assert (seen.trouble, seen.cure, seen.hardware) == ("the trigger port did not take code 1", "plug it in", True)
    assert ("trouble", {"problem": seen.trouble, "cure": seen.cure}) in [
        (kind, about) for kind, _, about in lab.log.events
    ]
    lab.flow.order(Order.GO_ON, lab.now)
    assert not seen.trouble
    assert lab.run().flow.seen.whole
    same(rows(lab), expected())


def test_a_session_that_ends_with_a_block_has_done_that_block():
    lab = Lab(SMALL)
    lab.run(lambda lab: begun(lab) and lab.turns.done and lab.turns.released)
    lab.flow.end(lab.now, "somebody ended it")
    lab.run()
    assert lab.flow.over
    assert lab.flow.seen.blocks_done == 1


@pytest.mark.parametrize("kind", ["block", "episode", "move", "key", "goes on"])
@pytest.mark.parametrize("which", [0, 1, 3])
def test_what_cannot_be_written_pauses_at_rest_and_changes_nothing_but_times(kind, which):
    """The log complains in the midst of what the flow is doing: that is done first."""
    lab = Lab(SMALL)
    count = itertools.count()
    for name in ("block", "episode", "move", "key", "event"):
        complain_in(lab, name, lambda about, n=name: (about[0] if n == "event" else n) == kind and next(count) == which)
    if kind == "goes on":
        lab.flow.pause(lab.now, "")
    pauses = 0
    while not lab.flow.over:
        lab.run()
        if not lab.flow.over:
            assert lab.scenes[-1].title == "Pause"
            assert not lab.turns.released if begun(lab) else True
            pauses += 1
            assert pauses < 4
            lab.flow.order(Order.GO_ON, lab.now)
    assert lab.flow.seen.whole
    assert pauses or which
    same(rows(lab), expected())


def complain_in(lab, name, when):
    """Let the log complain in one of its methods, once it has written, where ``when`` says so."""
    write = getattr(lab.log, name)

    def writes(*about, **more):
        write(*about, **more)
        if when(about):
            lab.flow.trouble("the disk is full", "free space")

    setattr(lab.log, name, writes)
