"""A session in real time: the window and the arm in processes of their own, the flow and the log in this one."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from multiprocessing.connection import wait
from typing import Any, Protocol

from hrcneuro import interrupts
from hrcneuro.arms.clock import seconds
from hrcneuro.errors import HrcError
from hrcneuro.experiment import messages as m
from hrcneuro.experiment import scenes, session
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.arm_process import ArmProcess
from hrcneuro.experiment.arm_side import ArmSettings
from hrcneuro.experiment.flow import Flow
from hrcneuro.experiment.log import Log
from hrcneuro.experiment.ports import Order, Seen
from hrcneuro.experiment.recorder_watch import RecorderWatch
from hrcneuro.experiment.window.process import Window
from hrcneuro.live.lsl import LslNetwork
from hrcneuro.live.policies import Policies

_LOOK_S = 0.5
_STEP_S, _QUICK_S = 0.1, 0.01
_UNHEARD = 10  # moves: a decision may fail, so many in a row do not
_NO_ROOM = (
    "the session ends as soon as there is room for the rest; asked to end once more, it ends now, and the lines that "
    "are missing come out on the terminal"
)


class Desk(Protocol):
    """Where the experimenter sits."""

    @property
    def attended(self) -> bool:
        """Whether somebody sits there who can let the session go on."""

    def waits_for(self) -> Sequence[Any]:
        """Return what becomes readable when the experimenter does something."""

    def asked(self) -> list[Order | str]:
        """Return what was asked for since the last call, and remarks; never waits."""

    def show(self, seen: Seen, now: float) -> None:
        """Show how the session stands; called often."""

    def say(self, text: str) -> None:
        """Say something at once."""


class RealTime:
    """One session, from the opening of its window to the last line of its log."""

    def __init__(
        self, setup: session.Setup, desk: Desk, *, streams: Sequence[str] = (), ahead: Ahead | None = None
    ) -> None:
        """Prepare it.

        Args:
            setup: What it is run with.
            desk: The experimenter's.
            streams: Those that must not be lost while somebody records.
            ahead: Checks each request, and has tried the whole grid; none: it is made for this session.

        Raises:
            ConfigError: The arm cannot work in the cell.
        """
        self._setup, self._desk = setup, desk
        self._ahead = ahead or session.looked_ahead(setup)
        self._arm_settings = ArmSettings(setup.arm, setup.subject, expected_s=session.lasts_s(setup))
        watched = setup.options.watch_recorder and bool(streams)
        self._recorder = RecorderWatch(setup.folder / setup.subject, streams) if watched else None
        self._arm: ArmProcess | None = None
        self._window: Window | None = None
        self._flow: Flow
        self._policies: Policies | None = None
        self._loop_trouble = ""
        self._looked = float("-inf")
        self._trouble = ""
        self._has_keyboard = True  # the window
        self._awaited = False  # its keyboard, to go on

    def run(self, *, resume: bool = False) -> Seen:
        """Run it until it ends; return what was seen of it.

        Raises:
            ConfigError, DataError, HardwareError, StageError: It cannot be begun.
        """
        with contextlib.ExitStack() as stack:
            stack.enter_context(interrupts.whole())
            stack.enter_context(_not_suspended())
            session.refuse(self._setup, resume=resume)
            about: dict[str, Any] = {}
            if self._setup.closed:
                self._policies = self._found(stack)
            if self._setup.options.screen:
                self._window = stack.enter_context(Window(self._setup.options.window, self._calibrating))
                self._desk.say(self._window.opened.told(self._setup.options.window.scale))
                about["window"] = self._window.opened.about
            running = stack.enter_context(
                session.opened(
                    self._setup,
                    resume=resume,
                    now=seconds,
                    arm=self._ask,
                    restart=self._restart,
                    show=self._show,
                    policies=self._policies,
                    about=about,
                )
            )
            stack.callback(self._close_arm)
            self._flow = running.flow
            for note in running.log.progress.notes:
                self._desk.say(note)
            interrupts.once(self._tell_patience)
            interrupts.hold()
            self._restart()
            self._go_on()
            interrupts.forget()
            self._await_room(running.log)
            interrupts.forget()
        return self._flow.seen

    def _go_on(self) -> None:
        ended, seen = False, self._flow.seen
        while not self._flow.over:
            wait(self._sources(), timeout=self._patience())
            now = seconds()
            if self._policies is not None:
                # Before the arm's words: what has come by now is what the robot draws from.
                self._policies.pull()
                if seen.phase == "the end":
                    # The loop hears of it, and ends as well.
                    self._policies.close()
                    self._policies = None
            for report in self._arm.reports() if self._arm is not None else ():
                self._flow.report(report)
            self._take_events(now)
            for asked in self._desk.asked():
                if isinstance(asked, Order):
                    self._order(asked, now)
                else:
                    self._flow.remark(asked, now)
            if interrupts.asked() and not ended:
                ended = seen.interrupted = True
                self._flow.end(now, "interrupted")
            if seen.trouble and not self._desk.attended and not ended:
                ended = True
                self._flow.end(now, "trouble, and nobody at the terminal", wanted=False)
            self._flow.tick(now)
            self._look(now)
            self._desk.show(seen, now)

    def _await_room(self, log: Log) -> None:
        """Wait until all is written that the disk had no room for, as long as somebody is there who can make some."""
        told = False
        while True:
            try:
                log.catch_up()
            except HrcError as error:
                if not self._desk.attended:
                    return
                if not told:
                    self._desk.say(f"{error.problem}; {_NO_ROOM}")
                told = True
            else:
                return
            wait(self._desk.waits_for(), timeout=_LOOK_S)
            if Order.END in self._desk.asked() or interrupts.asked():
                return

    def _sources(self) -> list[Any]:
        arm = [self._arm.connection] if self._arm is not None and not self._arm.over else []
        window = [self._window.connection] if self._window is not None else []
        return [*arm, *window, *self._desk.waits_for()]

    def _patience(self) -> float:
        wakes, longest = self._flow.wakes, _STEP_S if self._policies is None else _QUICK_S
        return longest if wakes is None else min(max(wakes - seconds(), 0.0), longest)

    def _take_events(self, now: float) -> None:
        for event in self._window.events() if self._window is not None else ():
            if isinstance(event, m.Closed):
                seen = self._flow.seen
                if event.problem:
                    seen.trouble, seen.cure, seen.hardware = event.problem, event.cure, True
                self._window = None
                self._flow.end(now, event.problem or "the window was closed", wanted=not event.problem)
            elif isinstance(event, m.Key):
                if not self._setup.simulated or event.name == "escape":
                    self._flow.key(event)
            elif not self._setup.simulated:
                self._focus(event.has, now)

    def _focus(self, has: bool, now: float) -> None:
        """Pause where the window loses the keyboard; go on with it where only that was missing."""
        awaited, self._has_keyboard, self._awaited = self._awaited, has, False
        if not has:
            self._flow.pause(now, scenes.KEYBOARD_LOST)
        elif awaited:
            self._flow.order(Order.GO_ON, now)

    def _order(self, order: Order, now: float) -> None:
        """Hand on what the experimenter asks for, but not to go on while the person's keys go elsewhere."""
        self._awaited = order is Order.GO_ON and not self._has_keyboard
        if self._awaited:
            self._desk.say("click the person's window; then the session goes on")
        else:
            self._flow.order(order, now)

    def _look(self, now: float) -> None:
        """Pause where the recorder loses a stream, or the closed loop is gone."""
        if now - self._looked < _LOOK_S:
            return
        self._looked = now
        self._look_for_loop()
        if self._recorder is None:
            return
        trouble = self._recorder.look()
        self._flow.seen.recorded = "lost" if trouble else "yes" if self._recorder.seen else "no"
        if trouble and trouble != self._trouble:
            self._flow.seen.hardware = True
            self._flow.trouble(trouble, "see what 'hrcneuro record' says; go on once the stream is back")
        self._trouble = trouble

    def _look_for_loop(self) -> None:
        if self._policies is None:
            return
        trouble, seen = self._policies.look(), self._flow.seen
        if not trouble and seen.unheard >= _UNHEARD:
            trouble, seen.unheard = f"the closed loop has told nothing of the last {_UNHEARD} moves", 0
        if trouble and trouble != self._loop_trouble:
            seen.hardware = True
            subject = self._setup.subject
            self._flow.trouble(
                trouble, f"see that one runs, then go on: hrcneuro online {subject} --mode closed --go-on"
            )
        self._loop_trouble = trouble

    def _found(self, stack: contextlib.ExitStack) -> Policies:
        """Return what the closed loop says; it must be there."""
        network = stack.enter_context(LslNetwork())
        policies = Policies(network, network.clock, self._setup.subject)
        stack.callback(policies.close)
        policies.find(time.sleep, patience_s=self._setup.options.loop_wait_s)
        return policies

    # --- what the flow asks for

    def _ask(self, request: m.Request) -> None:
        if self._arm is None:
            return
        try:
            self._arm.send(request)
        except HrcError as error:
            # Looked ahead to and refused: the arm rests, and nothing of it was begun.
            now = seconds()
            self._close_arm()
            self._flow.report(m.Halted(error.problem, error.cure, True, now))

    def _restart(self) -> None:
        self._close_arm()
        self._arm = ArmProcess(self._arm_settings, self._ahead, say=lambda text: self._desk.say(text.rstrip()))

    def _close_arm(self) -> None:
        arm, self._arm = self._arm, None
        if arm is not None:
            arm.close()

    def _show(self, scene: m.Scene) -> None:
        if self._window is not None:
            self._window.show(scene)

    def _calibrating(self) -> None:
        self._desk.say("hold a bank card to the screen: arrow keys fit the rectangle to it, Enter accepts")

    def _tell_patience(self) -> None:
        self._desk.say("the session ends as soon as the arm rests and all is written; a moment")


@contextlib.contextmanager
def _not_suspended() -> Iterator[None]:
    """Ignore Ctrl-Z: the arm would go on, and nobody would hear of it. What is started meanwhile ignores it, too."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)
