"""Signals that wait while something must not be cut in two."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from hrcneuro import interrupts
from hrcneuro.errors import StageInterrupted

KINDS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]


@pytest.fixture(autouse=True)
def as_a_command():
    """The command line lets each kind raise KeyboardInterrupt."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in KINDS}
    yield
    assert all(signal.getsignal(number) is signal.default_int_handler for number in KINDS)
    for number, handler in before.items():
        signal.signal(number, handler)


def send(number):
    os.kill(os.getpid(), number)


@pytest.mark.parametrize("second", KINDS)
@pytest.mark.parametrize("first", KINDS)
def test_the_first_interrupts_and_the_next_are_answered(first, second):
    answers, cleaned = [], []
    with pytest.raises(KeyboardInterrupt), interrupts.whole():
        interrupts.once(lambda: answers.append(second))
        try:
            send(first)
        finally:
            for _ in range(3):
                send(second)
            cleaned.append(True)
    assert (answers, cleaned) == ([second] * 3, [True])


def test_two_at_once_interrupt_once():
    """A shutdown sends SIGTERM and SIGHUP together; the second must not come between the first and its handling."""
    handled = []
    with pytest.raises(KeyboardInterrupt), interrupts.whole():
        interrupts.once(lambda: None)
        signal.pthread_sigmask(signal.SIG_BLOCK, KINDS)
        for number in (signal.SIGTERM, signal.SIGHUP):
            # To this thread: another one of the process would take what is blocked here.
            signal.pthread_kill(threading.main_thread().ident, number)
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, KINDS)
        finally:
            handled.append(True)
    assert handled == [True]


def test_what_is_held_is_delivered_with_what_was_kept():
    with pytest.raises(StageInterrupted, match="interrupted; all is in the cupboard"), interrupts.whole():
        interrupts.once(lambda: None)
        interrupts.hold("all is in the cupboard")
        send(signal.SIGINT)
        reached = True
    assert reached


def test_inner_care_leaves_the_delivery_to_the_outer():
    with interrupts.whole():
        with interrupts.whole():
            interrupts.once(lambda: None)
            interrupts.hold("kept")
            send(signal.SIGINT)
        with pytest.raises(StageInterrupted):
            interrupts.deliver()
        interrupts.deliver()


def test_without_a_signal_nothing_happens():
    with interrupts.whole():
        interrupts.once(lambda: None)
        interrupts.hold()
        interrupts.deliver()


def test_what_is_ignored_stays_ignored():
    """As SIGHUP under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interrupts.whole():
            interrupts.once(lambda: None)
            send(signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_python_ends_changes_no_exit_code(number):
    """What runs at the very end stands for all that Python does there, which takes a while."""
    code = f"""
import atexit, os, sys
from hrcneuro.__main__ import main
atexit.register(os.kill, os.getpid(), {int(number)})
sys.argv = ["hrcneuro", "path", "no-such-stage", "s01"]
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "no-such-stage" in done.stderr
    assert "Traceback" not in done.stderr


_IN_A_CALLBACK = """
import os, signal, sys, time, weakref
from hrcneuro import interrupts
from hrcneuro.pipeline import executors

class Thing:
    pass

def called(reference):
    os.kill(os.getpid(), signal.{number})
    for _ in range(1000):
        pass

{prepare}
thing = Thing()
kept = weakref.ref(thing, called)
try:
    del thing
    time.sleep(20)
except {raises}:
    sys.exit(7)
"""
_LISTEN = "interrupts.listen()"
_WORK = "signal.signal(signal.SIGTERM, executors._exit_once); sys.unraisablehook = executors._ignored"


@pytest.mark.parametrize(
    ("number", "prepare", "raises"),
    [
        ("SIGINT", _LISTEN, "KeyboardInterrupt"),
        ("SIGQUIT", _LISTEN, "KeyboardInterrupt"),
        ("SIGTERM", _WORK, "SystemExit"),
    ],
)
def test_a_signal_in_a_callback_of_pythons_own_is_not_lost(number, prepare, raises):
    """Python drops what is raised there, and says "Exception ignored"."""
    script = _IN_A_CALLBACK.format(number=number, prepare=prepare, raises=raises)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stderr) == (7, "")
