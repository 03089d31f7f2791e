"""The arm's side of an experiment: takes requests one at a time, drives the arm, and reports what happens.

It knows neither pipe nor process. At virtual pace the flow itself is asked and told, in the same process; in real time
:mod:`hrcneuro.experiment.arm_process` stands between.
"""

from __future__ import annotations

import contextlib
import gc
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Any

from hrcneuro.analyses.driven import Driven
from hrcneuro.arms.cures import with_cure
from hrcneuro.arms.held import held_arm
from hrcneuro.arms.words import Words
from hrcneuro.errors import HrcError
from hrcneuro.experiment import messages
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.messages import Go, Mark, Report, Request, Truth
from hrcneuro.live import onsets
from hrcneuro.paradigm import markers
from hrcneuro.robot import requests, session
from hrcneuro.robot.assembly import make_loop
from hrcneuro.robot.backend import Clock
from hrcneuro.robot.events import Approach, Finish, InRadius
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.workspace import Workspace

Send = Callable[[Report], None]
Ask = Callable[[float], Request | None]

_HEALTH_S = 0.25
_AGAIN = "then let the session go on"
_OPENED_AGAIN = "end here, then go on with --resume"
_ANEW = "start the experiment again with --resume: it goes on at the next block"


@dataclass(frozen=True)
class ArmSettings:
    """What the arm's side is started with.

    Attributes:
        config: The robot stage's options.
        subject: Whose session it is.
        real_time: Whether ``sim`` moves in the machine's time, and streams and ports are open.
        expected_s: How long the session lasts at most, about, seconds: for the room on the disk.
        about: What is asked for, JSON values, kept beside what the arm did.
    """

    config: Any
    subject: str
    real_time: bool = True
    expected_s: float = 7200.0
    about: Mapping[str, Any] = field(default_factory=dict)


def run(
    settings: ArmSettings,
    send: Send,
    ask: Ask,
    *,
    ahead: Ahead | None = None,
    gone: Callable[[], str] = str,
    say: Callable[[str], object] | None = None,
) -> None:
    """Drive the arm until it is asked to finish, or must be stopped; the last report says which.

    What an arm other than ``sim`` does is a recording, as a session of ``hrcneuro robot`` is.

    Args:
        settings: Which arm, and how.
        send: Takes every report; it must not wait.
        ask: Returns the next request, or none yet; called in every cycle with its time, seconds; it must not wait.
        ahead: Checks every request before the arm is asked; none where that is done elsewhere.
        gone: Says why nobody asks any more; an empty text while somebody does. Then the arm is stopped.
        say: Takes what the experimenter should read; none: it goes to standard error.

    Raises:
        KeyboardInterrupt: As it came, once the arm rests and what it did is kept.
    """
    with Words(f"experiment {settings.subject}", say) as words:
        try:
            side = _Side(settings, words, send, ask, ahead=ahead, gone=gone)
        except Exception as error:
            send(_halted(error, rests=True))
            return
        side.run()


class _Side:
    """One session: what was asked for, and what has come of it."""

    def __init__(
        self,
        settings: ArmSettings,
        words: Words,
        send: Send,
        ask: Ask,
        *,
        ahead: Ahead | None,
        gone: Callable[[], str],
    ) -> None:
        config = settings.config
        self._settings, self._config = settings, config
        self._send, self._ask, self._ahead, self._gone = send, ask, ahead, gone
        self._patience = config.backend == "ursim" and not config.patient
        self._moves: list[PlannedMove] = []  # numbered as they come; their numbers in the session are in …
        self._asked: list[Go] = []
        self._texts: list[str] = []
        self._codes: list[int] = []
        workspace = ahead.workspace if ahead is not None else Workspace(config.cell)
        self._driven = Driven(
            settings.subject, self._moves, workspace, nan, Path(config.rescue_folder), words,
            may_be_patient=self._patience, anew=_ANEW, again=_AGAIN,
        )  # fmt: skip
        self._waiting: deque[Request] = deque()
        self._first = True  # the next move follows an approach, or nothing
        self._halted = False
        self._health_due = -1.0
        self._markers: onsets.Markers | None = None
        self._truths: onsets.Truths | None = None
        self._senders: list[onsets.OnOnset] = []
        self._failed: deque[HrcError] = deque()  # beside the arm, and not told yet; other threads add to it
        self._loop: Loop
        self._clock: Clock

    def run(self) -> None:
        """Drive; whatever happens, the last report is sent and what the arm did is kept."""
        driven = self._driven
        try:
            if self._config.backend != "sim":
                driven.begin_open_recording(self._settings.expected_s, about=self._settings.about)
            self._drive()
        except BaseException as error:
            reason = driven.stopped(with_cure(error, may_be_patient=self._patience, again=_AGAIN))
            if not self._halted:
                self._send(_halted(reason, rests=True))
            if isinstance(error, Exception):
                return
            raise
        self._send(messages.Ended(self._clock.now()))
        if driven.recording is not None:
            driven.tell_end()
            try:
                driven.ended(None)
            except HrcError as error:
                driven.words.say(error.problem, cure=error.cure)

    def _drive(self) -> None:
        config, driven = self._config, self._driven
        with contextlib.ExitStack() as stack:
            if self._settings.real_time:
                # A pass of Python's collector over all that the libraries have loaded takes many cycles.
                gc.collect()
                gc.freeze()
                stack.callback(gc.unfreeze)
                self._open(stack)
            arm, self._clock = held_arm(
                config, driven.workspace, stack, max_delay=config.max_lead_s, real_time=self._settings.real_time
            )
            self._loop = make_loop(
                arm, self._clock, driven.workspace, tracking=config, safety=config, keeper=driven.fault,
                on_onset=self._onset, on_stop=driven.tell_stop, on_rest=self._rest, on_cycle=self._cycle,
            )  # fmt: skip
            driven.follow(stack.enter_context(self._loop))
            session.serve(
                self._loop, driven.workspace, self._source, lead=config.lead_s, most_lead=config.max_lead_s,
                pace=config, tell=self._tell,
            )  # fmt: skip

    def _open(self, stack: contextlib.ExitStack) -> None:
        # The trigger first: it times the recording.
        config, source = self._config, f"hrcneuro experiment {self._settings.subject}"
        if config.trigger.port != "none":
            port = onsets.trigger(config.trigger, stack, failed=self._failed.append, codes=self._codes)
            self._senders.append(port)
        if config.markers == "lsl":
            self._markers = onsets.Markers(source, config.recorder_wait_s, stack)
            self._senders.append(self._markers.at_onsets(self._texts, self._driven.stamps))
        if config.truth:
            self._truths = onsets.Truths(f"{source} truth", stack)

    # --- what is asked for

    def _cycle(self, now: float) -> str:
        if now >= self._health_due:
            worst, (late_packets, _) = self._loop.worst(), self._loop.late_packets
            health = messages.Health(self._absolute(now), worst.age, worst.off, worst.late, late_packets)
            if self._health_due >= 0.0:
                self._send(health)
            self._health_due = now + _HEALTH_S
        while self._failed:
            error = self._failed.popleft()
            self._send(messages.Trouble(error.problem, f"{error.cure}: {_OPENED_AGAIN}", self._absolute(now)))
        self._poll(now)
        return self._gone()

    def _poll(self, now: float) -> None:
        while (request := self._ask(self._absolute(now))) is not None:
            if self._ahead is not None:
                self._ahead.check(request)
            if isinstance(request, Mark):
                self._mark(request)
            elif isinstance(request, Truth):
                self._tell_truth(dict(request.move))
            else:
                self._waiting.append(request)

    def _mark(self, mark: Mark) -> None:
        if self._markers is not None:
            self._markers.send(mark.text, lambda: self._clock.now() - mark.when)

    def _tell_truth(self, move: dict[str, Any]) -> None:
        if self._truths is not None:
            key = move.pop("key_s", None)
            self._truths.send(move, key_in_s=None if key is None else key - self._clock.now())

    def _source(self, now: float, moving: bool) -> requests.Request | None:
        self._poll(now)
        if not self._waiting or (moving and not isinstance(self._waiting[0], Go)):
            return None
        request = self._waiting.popleft()
        if isinstance(request, Go):
            return self._make(request)
        assert isinstance(request, Approach | Finish)
        self._first = True
        return request

    def _make(self, go: Go) -> requests.Make:
        tags = markers.move_in(go.marker) or {}
        block, episode, trial = (int(tags.get(name, 0)) for name in ("block", "episode", "trial"))
        scenario, practice = str(tags.get("scenario", "")), bool(tags.get("practice", False))
        move = PlannedMove(scenario, practice, block, episode, trial, go.start, go.end, self._first, go.t_f, nan)
        self._first = False
        self._moves.append(move)
        self._asked.append(go)
        self._texts.append(go.marker)
        self._codes.append(go.code)
        return requests.Make(len(self._moves) - 1, move, go.not_before - self._loop.began)

    # --- what happens

    def _tell(self, event: session.Event) -> None:
        if isinstance(event, session.ExecutedMove):
            self._driven.take(event)
            self._send(messages.Executed(self._asked[event.index].index, self._absolute(event.track.end)))
            return
        when = self._absolute(event.when)
        if isinstance(event, requests.Stays):
            self._send(messages.Onset(self._asked[event.index].index, when))
        elif isinstance(event, InRadius):
            self._send(replace(event, index=self._asked[event.index].index, when=when))
        else:
            self._send(replace(event, when=when))

    def _onset(self, age: Callable[[], float], move: int) -> None:
        for sender in self._senders:
            sender(age, move)
        when = self._clock.now() - age()
        self._send(messages.Onset(self._asked[move].index, when, self._driven.stamps.get(move, nan)))

    def _rest(self, seen: bool) -> None:
        self._driven.tell_rest(seen)
        self._halted = True
        self._send(messages.Halted(self._driven.problem, self._driven.cure, seen, self._clock.now()))

    def _absolute(self, now: float) -> float:
        return self._loop.began + now


def _halted(error: BaseException, *, rests: bool) -> messages.Halted:
    from hrcneuro.arms.clock import seconds

    if isinstance(error, HrcError):
        return messages.Halted(error.problem, error.cure, rests, seconds())
    return messages.Halted(f"{type(error).__name__}: {error}", "", rests, seconds())
