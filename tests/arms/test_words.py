"""What a person must read at once: in order, and never waited for."""

import io
import sys
import threading

import pytest

from hrcneuro.arms.words import Words


def test_each_text_is_a_line_with_its_cure_below(capsys):
    with Words("robot s01") as words:
        words.say("the arm moves", cure="press the emergency stop")
        words.say("the arm is at rest")
    assert capsys.readouterr().err == (
        "robot s01: the arm moves\n  cure: press the emergency stop\nrobot s01: the arm is at rest\n"
    )


def test_a_terminal_that_takes_nothing_keeps_nobody_waiting(monkeypatch):
    """As one that someone has stopped with Ctrl-S."""
    read, asked = threading.Event(), threading.Event()

    class Stuck(io.StringIO):
        def write(self, text):
            asked.set()
            read.wait(10)
            return super().write(text)

    stuck = Stuck()
    monkeypatch.setattr(sys, "stderr", stuck)
    words = Words("robot s01")
    words.start()
    words.say("one")
    assert asked.wait(10)
    words.say("two")
    assert stuck.getvalue() == ""
    read.set()
    words.__exit__(None, None, None)
    assert stuck.getvalue() == "robot s01: one\nrobot s01: two\n"


@pytest.mark.parametrize("gone", [None, OSError(5, "Input/output error"), ValueError("closed")])
def test_a_terminal_that_is_gone_breaks_nothing(monkeypatch, gone):
    class Gone(io.StringIO):
        def write(self, text):
            raise gone

    monkeypatch.setattr(sys, "stderr", Gone() if gone else None)
    with Words("robot s01") as words:
        words.say("one")
        words.say("two")
    assert not words._thread.is_alive()
