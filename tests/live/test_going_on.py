"""A loop that was broken off goes on with what it had learned, and with nothing else."""

import json
import os

import pytest
from disks import mounted
from online_lab import Lab, decoder, learner, moves

from hrcneuro.errors import DataError, StageError
from hrcneuro.live import decisions, going_on
from hrcneuro.live.parameters import OnlineOptions

LEARNERS = ["paper", "bayes_graded", "forgetting", "adaptive", "votes", "confidence"]


@pytest.fixture(scope="module")
def lab():
    return Lab(moves() + [(at + 40.0, text) for at, text in moves(block=2, seed=3)]).run()


@pytest.mark.parametrize("name", LEARNERS)
def test_it_knows_what_the_one_before_had_learned(name):
    before = learner(name)
    lab = Lab(moves(), learner=before, options=OnlineOptions(mode="closed", learner=name)).run()
    again = learner(name)
    going_on.relearned(lab.lines, again, decoder(), afresh=False)
    assert again.policy() == before.policy() != learner(name).policy()
    assert again.updates == before.updates > 0


def test_where_owners_are_drawn_anew_it_knows_of_the_last_block_alone():
    before = learner()
    events = moves() + [(at + 40.0, text) for at, text in moves(block=2, seed=3)]
    lab = Lab(events, learner=before, options=OnlineOptions(mode="closed", afresh=True)).run()
    again = learner()
    going_on.relearned(lab.lines, again, decoder(), afresh=True)
    assert (again.policy(), again.updates) == (before.policy(), before.updates)


def test_in_semi_it_goes_on_with_the_policy_of_the_blocks_beginning(lab):
    blocks = [line for line in lab.lines if line["kind"] == decisions.BLOCK]
    assert going_on.relearned(lab.lines, learner(), decoder(), afresh=False).policy == blocks[-1]["policy"]


def test_after_shadow_semi_goes_on_with_what_had_been_learned_by_the_blocks_beginning(lab):
    """The robot acted by nothing of it, and the log of ``shadow`` names no policy that it had."""
    shadow = Lab(lab.events, options=OnlineOptions(mode="shadow")).run()
    before = going_on.relearned(shadow.lines, learner(), decoder(), afresh=False)
    assert before == going_on.relearned(lab.lines, learner(), decoder(), afresh=False)
    assert before.policy != learner().policy()


@pytest.mark.parametrize("name", LEARNERS)
def test_a_loop_that_was_broken_off_twice_knows_all_that_was_learned(name, tmp_path):
    options = OnlineOptions(mode="closed", learner=name)
    whole = learner(name)
    for number, block in enumerate((1, 2, 3), start=1):
        one = learner(name)
        lab = Lab(moves(block=block, seed=block, episodes=1), learner=one, options=options)
        log = written(tmp_path, number)
        if number > 1:
            path = going_on.newest(tmp_path)
            before = going_on.relearned(going_on.history(path), one, decoder(), afresh=False)
            lab.loop.deciding.go_on(before.policy, before.episode)
            log(going_on.goes_on(path))
        lab.run()
        for line in lab.lines:
            log(line)
        log.close()
        taught(whole, lab.trials, fresh=number == 1)
        assert one.policy() == pytest.approx(whole.policy(), abs=1e-12)
        assert one.updates == whole.updates == 7 * number


def taught(one, trials, *, fresh):
    """Let a learner have the lessons of an episode, as a loop that was never broken off would."""
    if not fresh:
        one.end_episode()
    for trial in trials:
        if trial["update"]:
            odds = decoder().problems[trial["problem"]].log_odds(trial["score"])
            one.update(trial["next"], before=trial["actor"], takeover=trial["takeover"], log_odds=odds)


def written(folder, number):
    """Return the log of a loop, begun; each is newer than the one before."""
    place = folder / f"2026-01-0{number}T000000-online"
    place.mkdir()
    return decisions.DecisionLog(place)


def test_a_loop_that_heard_of_nothing_is_no_loop_to_go_on_with(tmp_path, lab):
    for number, lines in enumerate((lab.lines, [], lab.lines[:1]), start=1):
        log = written(tmp_path, number)
        for line in lines:
            log(line)
        log.close()
        os.utime(log.path, (number, number))
    assert lab.lines[0]["kind"] == decisions.BEGIN
    assert going_on.newest(tmp_path).parent.name == "2026-01-01T000000-online"


def test_a_log_that_goes_on_with_one_that_is_gone_is_refused(tmp_path):
    log = written(tmp_path, 2)
    log({"kind": decisions.GOES_ON, "log": "2026-01-01T000000-online"})
    log.close()
    with pytest.raises(DataError, match="2026-01-01T000000-online"):
        list(going_on.history(log.path))


def test_a_full_disk_is_told_and_what_was_written_before_can_be_gone_on_with(tmp_path, lab):
    with mounted(tmp_path / "small", "size=16k") as small:
        log = written(small, 1)
        with pytest.raises(StageError, match="No space left") as told:
            for line in lab.lines * 10:
                log(line)
        log.close()
        assert "free space" in told.value.cure
        kept = list(decisions.lines(log.path))
        assert kept == json.loads(json.dumps(lab.lines[: len(kept)])) != []


def test_another_learner_is_refused(lab):
    with pytest.raises(DataError, match="another decoder or learner"):
        going_on.relearned(lab.lines, learner("bayes_graded"), decoder(), afresh=False)


def test_the_newest_log_is_gone_on_with(tmp_path):
    with pytest.raises(DataError, match="no closed loop to go on with"):
        going_on.newest(tmp_path)
    for number, name in enumerate(("2026-01-02T000000-online", "2026-01-01T000000-online")):
        (tmp_path / name).mkdir()
        path = tmp_path / name / decisions.FILE
        path.write_text(f'{{"kind": "{decisions.BLOCK}"}}\n')
        os.utime(path, (number, number))
    assert going_on.newest(tmp_path).parent.name == "2026-01-01T000000-online"


def test_a_line_that_a_kill_has_cut_costs_no_more_than_itself(lab, tmp_path):
    log = decisions.DecisionLog(tmp_path)
    for line in lab.lines:
        log(line)
    log.close()
    text = log.path.read_text()
    log.path.write_text(text[: len(text) - 40])
    again = learner()
    going_on.relearned(decisions.lines(log.path), again, decoder(), afresh=False)
    assert again.updates >= lab.learner.updates - 1
