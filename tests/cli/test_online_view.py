"""The picture of the closed loop: what it says of a loop under way, and that it never ends one."""

import io

import pytest
from online_lab import LABELS, Lab, moves
from rich.console import Console as RichConsole

from hrcneuro.cli.console import Console
from hrcneuro.cli.online_view import View, bar
from hrcneuro.live.parameters import OnlineOptions, RecordOptions


def drawn(lab, tmp_path, loop=None):
    view = View(Console(), RecordOptions(), lab.options, tmp_path / "decisions.jsonl")
    out = io.StringIO()
    RichConsole(file=out, width=120).print(view.table(loop or lab.loop))
    return out.getvalue()


def test_it_shows_policy_decisions_deadlines_latencies_and_the_signal(tmp_path):
    lab = Lab(moves(episodes=1), options=OnlineOptions(mode="semi"))
    assert "no EEG yet" in drawn(lab, tmp_path)
    lab.run()
    said = drawn(lab, tmp_path)
    for subtask, human in lab.learner.policy().items():
        assert bar(subtask, human, 0.5) in said
    assert "8 moves, 8 decided, 8 in time, 7 taught; not: last 1" in said
    last = lab.trials[-1]
    assert f"1.1.7 {last['actor']}, next -: P(takeover) {last['probability']:.2f} {last['predicted']}  last" in said
    assert "onset to sent" in said
    assert "received to sent" in said
    assert "EEG amp" in said


def test_a_channel_that_says_nothing_is_named(tmp_path):
    def flat(now, stamps, rows):
        rows = rows.copy()
        rows[:, 2] = 7.0
        return stamps, rows

    said = drawn(Lab(moves(episodes=1), spoil=flat).run(8.0), tmp_path)
    assert f"{LABELS[2]} flat" in said


@pytest.mark.parametrize(("human", "filled"), [(0.0, 0), (1.0, 30), (0.5, 15)])
def test_a_bar_is_as_long_as_the_probability(human, filled):
    assert bar("N", human, 0.5).count("█") == filled
