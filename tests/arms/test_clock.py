"""Who runs first: a real-time session asks for it, and gives it back."""

import os
import threading

import pytest

from hrcneuro.arms.clock import WallClock


def scheduling():
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority


def in_thread(work):
    """Run in a thread of its own: what it asks for must not stay with the test runner."""
    found = []
    thread = threading.Thread(target=lambda: found.append(work()))
    thread.start()
    thread.join()
    return found[0]


def test_a_session_runs_first_and_gives_that_back():
    def work():
        clock, before = WallClock(), scheduling()
        assert scheduling() == before, "a clock alone asks for nothing"
        clock.raise_priority()
        during = scheduling()
        clock.restore_priority()
        clock.restore_priority()
        return before, during, scheduling()

    before, during, after = in_thread(work)
    assert before == after
    if during == before:
        pytest.skip("no right to run first on this machine")
    assert during == (os.SCHED_FIFO, 20)


@pytest.fixture
def refused(monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)


def test_without_the_right_it_asks_for_less_and_gives_that_back(refused, monkeypatch):
    asked = []
    monkeypatch.setattr(os, "setpriority", lambda *given: asked.append(given))
    before = os.getpriority(os.PRIO_PROCESS, 0)
    clock = WallClock()
    clock.raise_priority()
    assert asked == [(os.PRIO_PROCESS, 0, -15)]
    clock.restore_priority()
    clock.restore_priority()
    assert asked[1:] == [(os.PRIO_PROCESS, 0, before)]


def test_the_nice_value_is_as_before(refused):
    def work():
        values = [os.getpriority(os.PRIO_PROCESS, 0)]
        clock = WallClock()
        clock.raise_priority()
        values.append(os.getpriority(os.PRIO_PROCESS, 0))
        clock.restore_priority()
        return [*values, os.getpriority(os.PRIO_PROCESS, 0)]

    before, during, after = in_thread(work)
    assert before == after
    if during == before:
        pytest.skip("no right to a higher priority on this machine")
    assert during == -15
