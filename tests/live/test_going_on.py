"""A loop that was broken off goes on with what it had learned, and with nothing else."""

import os

import pytest
from online_lab import Lab, decoder, learner, moves

from hrcneuro.errors import DataError
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
    assert going_on.relearned(lab.lines, learner(), decoder(), afresh=False) == blocks[-1]["policy"]


def test_another_learner_is_refused(lab):
    with pytest.raises(DataError, match="another decoder or learner"):
        going_on.relearned(lab.lines, learner("bayes_graded"), decoder(), afresh=False)


def test_the_newest_log_is_gone_on_with(tmp_path):
    with pytest.raises(DataError, match="no closed loop to go on with"):
        going_on.newest(tmp_path)
    for number, name in enumerate(("2026-01-02T000000-online", "2026-01-01T000000-online")):
        (tmp_path / name).mkdir()
        path = tmp_path / name / decisions.FILE
        path.write_text("")
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
