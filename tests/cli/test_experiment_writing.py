"""The experimenter's terminal: one that nobody reads holds up nobody, and has missed nothing but old pictures."""

import contextlib
import os
import pty
import sys
import threading
import time

import pytest
from rich.text import Text
from tiny_study import wait_for

from hrcneuro.cli.experiment_writing import Writer

LONG = "x" * 300_000  # more than a terminal takes while nobody reads it


class Held:
    """A terminal that is held up until somebody reads it."""

    def __init__(self):
        self.master, slave = pty.openpty()
        self.error = os.fdopen(slave, "w")
        self.text = b""

    def read(self):
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        with contextlib.suppress(OSError):
            while piece := os.read(self.master, 65536):
                self.text += piece


@contextlib.contextmanager
def held_up(monkeypatch):
    """Give a terminal that is standard error; a fixture would be too early, as pytest's own comes after it."""
    terminal = Held()
    with monkeypatch.context() as patch, terminal.error:
        patch.setattr(sys, "stderr", terminal.error)
        patch.setenv("TERM", "xterm")
        yield terminal


@pytest.mark.parametrize("pictures", [True, False])
def test_who_writes_on_a_terminal_that_is_held_up_never_waits(monkeypatch, pictures):
    with held_up(monkeypatch) as held:
        writer = Writer(pictures=pictures)
        began = time.monotonic()
        writer.say(LONG)
        for number in range(50):
            writer.draw(Text(f"picture {number};"))
        writer.say("the arm was stopped")
        assert time.monotonic() - began < 0.5
        held.read()
        if pictures:
            wait_for(lambda: b"picture 49;" in held.text)
            assert b"picture 48;" not in held.text
        writer.say("last words")
        writer.close()
        wait_for(lambda: b"last words" in held.text)
        assert held.text.index(b"the arm was stopped") < held.text.index(b"last words")


def test_the_end_waits_for_a_terminal_that_is_held_up_a_second_at_most(monkeypatch):
    with held_up(monkeypatch) as held:
        writer = Writer(pictures=True)
        writer.say(LONG)
        began = time.monotonic()
        writer.close()
        assert 0.5 < time.monotonic() - began < 5
        held.read()
        wait_for(lambda: held.text.count(b"x") == len(LONG))


def test_a_terminal_that_has_gone_is_known_to_be_so(monkeypatch):
    with held_up(monkeypatch) as held:
        writer = Writer(pictures=False)
        os.close(held.master)
        writer.say("anybody?")
        wait_for(lambda: writer.gone)
        writer.close()
