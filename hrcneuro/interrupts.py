"""Ctrl-C and the other signals that ask a command to end, where something must not be cut in two: an arm that is being
stopped, a record that is being written.

Handlers belong to the whole process, hence functions of a module. ``whole`` says how far the care reaches; within it,
whoever is in the midst of something calls ``once`` or ``hold``, and whoever has a safe place to end calls ``deliver``.
Outside the main thread, where Python delivers no signal, nothing happens.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

from hrcneuro.errors import StageInterrupted

INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_REQUESTS = {
    # What these say is known from Ctrl-C; the others are named, with the exit code that a shell shows for them.
    **dict.fromkeys(INTERRUPTS, (130, "interrupted")),
    signal.SIGQUIT: (131, "ended by SIGQUIT (Ctrl-\\)"),
    signal.SIGXCPU: (128 + signal.SIGXCPU, "ended by SIGXCPU: the limit of processor time is reached"),
    **{one: (128 + one, f"ended by {one.name}") for one in (signal.SIGUSR1, signal.SIGUSR2)},
}


_MOMENT_S = 0.01


class _Care:
    """What is known of the signals of this process."""

    def __init__(self) -> None:
        self.depth = 0
        self.before: dict[int, Any] = {}
        self.held = self.waiting = False
        self.answer: Callable[[], None] = lambda: None
        self.kept = ""
        self.first: signal.Signals | None = None

    def take(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: raise where none has come yet and none is to wait, else answer and remember it."""
        self.first = self.first or signal.Signals(number)
        if not self.held:
            # From this instant on: a shutdown sends two kinds at once, and the second must not break the first's way.
            self.held = True
            raise KeyboardInterrupt
        self.waiting = True
        self.answer()

    def restore(self) -> bool:
        """Put back the handlers; return whether a signal waited."""
        waited = self.waiting
        for number, handler in self.before.items():
            signal.signal(number, handler)
        self.before = {}
        self.held = self.waiting = False
        return waited


_care = _Care()


def listen() -> None:
    """From here on, what a terminal, a scheduler or a shutdown sends raises KeyboardInterrupt, as Ctrl-C does."""
    _care.first = None
    sys.unraisablehook = _ignored
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _REQUESTS:
        # What is ignored, as by nohup, stays so.
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _raise)


def again(number: signal.Signals) -> None:
    """Send this process a signal a moment from now."""
    threading.Timer(_MOMENT_S, os.kill, (os.getpid(), number)).start()


def _ignored(unraisable: Any) -> None:
    """What is raised in a callback of Python's own, as of weak references, is dropped: raise it once more."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return
    _care.held = False
    again(_care.first or signal.SIGINT)


def over() -> None:
    """From here on no signal changes how this process ends: Python lets go of its handlers before the very end."""
    if threading.current_thread() is threading.main_thread():
        for number in _REQUESTS:
            signal.signal(number, signal.SIG_IGN)


def told() -> tuple[int, str]:
    """Return the exit code of a command that a signal has ended, and what ended it in words."""
    return _REQUESTS[_care.first or signal.SIGINT]


def _raise(number: int, frame: FrameType | None) -> None:
    _care.first = _care.first or signal.Signals(number)
    raise KeyboardInterrupt


@contextlib.contextmanager
def whole() -> Iterator[None]:
    """Limit how long signals can be held: with the outermost of these, all is as before."""
    _care.depth += 1
    try:
        yield
    except BaseException:
        _care.depth -= 1
        if not _care.depth:
            _care.restore()
        raise
    _care.depth -= 1
    if not _care.depth:
        deliver()


def once(answer: Callable[[], None]) -> None:
    """From here on the first signal raises KeyboardInterrupt; the next ones wait, and ``answer`` is called for each."""
    assert _care.depth, "only within whole()"
    if threading.current_thread() is not threading.main_thread() or _care.before:
        return
    _care.answer, _care.kept, _care.first = answer, "", None
    for number in _REQUESTS:
        handler = signal.getsignal(number)
        # What is ignored, as by nohup, stays so.
        if handler not in (signal.SIG_IGN, None):
            _care.before[number] = handler
            signal.signal(number, _care.take)


def hold(kept: str = "") -> None:
    """From here on every signal waits, if :func:`once` was called; ``kept`` is what a person is told in the end."""
    _care.held = bool(_care.before)
    _care.kept = kept or _care.kept


def asked() -> bool:
    """Return whether a signal waits: somebody wants this to end."""
    return _care.waiting


def forget() -> None:
    """What has waited so far was answered, and ends nothing more."""
    _care.waiting = False


def deliver() -> None:
    """Let go of the signals.

    Raises:
        StageInterrupted: One has waited.
    """
    if _care.restore():
        raise StageInterrupted(
            "; ".join(filter(None, (told()[1], _care.kept))), cure="the same command goes on from here"
        )
