"""Where another window has the keyboard: a session goes on once the person's window has it again, and not before."""

import pytest
from quick_arm import Lab

from hrcneuro.experiment import messages as m
from hrcneuro.experiment import real, session
from hrcneuro.experiment.parameters import ExperimentOptions
from hrcneuro.experiment.ports import Order
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.stages.robot import Config

SMALL = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)


class Desk:
    """Keeps what is said."""

    attended = True

    def __init__(self):
        self.said = []

    def say(self, text):
        self.said.append(text)


class Window:
    """Hands over the events that a test gives it."""

    def __init__(self, *events):
        self.given = list(events)

    def events(self):
        given, self.given = self.given, []
        return given


@pytest.fixture
def held(tmp_path):
    """Return a person's session among moves, and the flow's lab, just as the window has lost the keyboard."""
    lab = Lab(SMALL, simulated=False)
    while not (lab.scenes[-1].path and not lab.turns.released):
        if not lab.step():
            lab.now += 2
            lab.flow.key(m.Key("N", lab.now))
    setup = session.Setup("s01", ExperimentOptions(), SMALL, TimingParams(), 1, Config(), tmp_path)
    running = real.RealTime(setup, Desk())
    running._flow = lab.flow
    focus(running, lab, has=False)
    return running, lab


def focus(running, lab, *, has):
    running._window = Window(m.Focus(has, lab.now))
    running._take_events(lab.now)


def test_it_does_not_go_on_before_the_window_has_the_keyboard_and_then_by_itself(held):
    running, lab = held
    assert lab.scenes[-1].title == "Pause"
    running._order(Order.GO_ON, lab.now)
    assert lab.scenes[-1].title == "Pause"
    assert "click the person's window" in running._desk.said[-1]
    focus(running, lab, has=True)
    assert lab.scenes[-1].path
    assert not lab.flow.seen.trouble


def test_the_keyboard_alone_ends_no_pause(held):
    running, lab = held
    focus(running, lab, has=True)
    assert lab.scenes[-1].title == "Pause"
    running._order(Order.GO_ON, lab.now)
    assert lab.scenes[-1].path


def test_who_asks_for_a_pause_meanwhile_has_it(held):
    running, lab = held
    running._order(Order.GO_ON, lab.now)
    running._order(Order.PAUSE, lab.now)
    focus(running, lab, has=True)
    assert lab.scenes[-1].title == "Pause"
