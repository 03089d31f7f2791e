"""How far a run is: a label a worker, and the time left by what is known of durations."""

import os
import signal
import threading

import pytest

from hrcneuro.cli.at_once import answered
from hrcneuro.cli.progress import Progress
from hrcneuro.pipeline.forecast import Forecast
from hrcneuro.pipeline.item import Item, State

PLACES = [("epoch", f"s{i}") for i in range(4)]


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def shown(known, workers=2):
    clock = Clock()
    return clock, Progress(4, Forecast(PLACES, known, workers=workers), workers=workers, clock=clock)


def report(progress, unit, state, seconds=0.0):
    progress.report(Item("epoch", unit, state=state, seconds=seconds))


def test_two_workers_have_two_labels_and_what_waits_has_none():
    clock, progress = shown({})
    for i in range(4):
        report(progress, f"s{i}", State.RUNNING)
    clock.now = 65.0
    assert [line.split() for line in progress.lines()[1:]] == [["epoch", "s0", "1:05"], ["epoch", "s1", "1:05"]]
    report(progress, "s0", State.RAN, 65.0)
    clock.now = 75.0
    assert [line.split() for line in progress.lines()[1:]] == [["epoch", "s1", "1:15"], ["epoch", "s2", "0:10"]]
    assert " 1/4 " in progress.lines()[0]


def test_the_time_left_is_of_recorded_durations():
    clock, progress = shown(dict.fromkeys(PLACES, 60.0))
    assert "about 2 min left" in progress.lines()[0]
    report(progress, "s0", State.RUNNING)
    clock.now = 30.0
    assert "about 2 min left" in progress.lines()[0]  # 30 + 3 · 60 s on two workers: 105 s
    for unit in ("s0", "s1", "s2"):
        report(progress, unit, State.HIT)
    assert "about 60 s left" in progress.lines()[0]


def test_nothing_is_said_where_nothing_is_known():
    _, progress = shown({})
    assert "left" not in progress.lines()[0]
    report(progress, "s0", State.RAN, 10.0)
    assert "about 15 s left" in progress.lines()[0]


def test_a_run_lasts_at_least_as_long_as_its_longest_task():
    known = {("a", "s1"): 100.0, ("b", "s1"): 1.0}
    assert Forecast(known, known, workers=8).left({}) == 100.0
    assert Forecast(known, known, workers=8).left({("a", "s1"): 99.5}) == 1.0


def test_a_subjects_duration_says_nothing_of_the_groups():
    places = [("erp", "s1"), ("erp", "s2"), ("erp", "group")]
    known = {("erp", "s1"): 4.0}
    assert Forecast(places, known, workers=1).left({}) is None
    assert Forecast(places[:2], known, workers=1).left({}) == 8.0


def test_a_first_run_says_nothing_before_every_kind_of_task_has_run_once():
    places = [("acquire", "s1"), ("acquire", "s2"), ("epoch", "s1"), ("epoch", "s2")]
    forecast = Forecast(places, {}, workers=1)
    forecast.settle(("acquire", "s1"), 2.0)
    forecast.settle(("acquire", "s2"), 2.0)
    assert forecast.left({}) is None
    forecast.settle(("epoch", "s1"), 5.0)
    assert forecast.left({}) == 5.0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_answered_once_while_the_main_thread_is_busy(number):
    said, times = threading.Event(), []

    def answer():
        times.append(1)
        said.set()

    before = signal.signal(number, lambda *_: None)
    try:
        with answered(answer):
            os.kill(os.getpid(), number)
            assert said.wait(30)
            os.kill(os.getpid(), number)
    finally:
        signal.signal(number, before)
    assert times == [1]
    assert signal.set_wakeup_fd(-1) == -1


def test_a_run_that_ends_by_itself_is_not_answered():
    times = []
    with answered(lambda: times.append(1)):
        pass
    assert times == []
