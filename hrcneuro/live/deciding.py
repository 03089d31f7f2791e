"""From samples and markers to decisions and what is learned of them: no stream, no file, no thread.

Moves are dealt with in their order, each as soon as the last sample of its epoch is there. What comes out depends on
samples, stamps and markers alone, not on the chunks in which they came.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.decoding.refusals import NotFiniteTrialsError
from hrcneuro.eeg.causal import State
from hrcneuro.learning.online import HUMAN, ROBOT, SUBTASKS, OnlineLearner, Policy
from hrcneuro.live.decisions import Known, Trial
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.live.timeline import NOT_FINITE, RAILED, Timeline
from hrcneuro.live.transport import Clock

KEPT_S = 8.0
_PATIENCE_S = 2.0  # behind the deadline, until a sample that did not come is given up
_STATES = {State.BROKEN: "gap", State.GONE: "gone", State.COMING: "missing"}


@dataclass
class _Waiting:
    """A move or a block's beginning that waits for its turn.

    ``moment`` is its time on the EEG sender's clock, ``first`` the epoch's first sample as soon as that is known.
    """

    tags: Mapping[str, Any]
    trial: Trial | None
    moment: float = float("nan")
    first: int | None = None
    lost: bool = False  # the stream in which its epoch lay has ended


class Deciding:
    """Decoder and learner at a stream.

    Attributes:
        learner: What has been learned.
        policy: What the robot may act by now, by the mode: at first either action has the probability 1/2.
        causes: Cause -> moves that taught nothing for it.
        blocks: How many blocks have begun.
    """

    def __init__(
        self,
        decoder: FrozenDecoder,
        learner: OnlineLearner,
        options: OnlineOptions,
        clock: Clock,
        *,
        known: Known | None = None,
    ) -> None:
        """Begin at a stream of which no sample has come.

        Args:
            decoder, learner: That decide and learn.
            options: How.
            clock: Seconds of the receiver's clock.
            known: What the log of the live session tells, where this is a replay: zeros are taken from there, and
                nothing is late but what was.
        """
        self.learner, self.policy = learner, learner.policy()
        self.causes: Counter[str] = Counter()
        self.blocks = 0
        self._decoder, self._options, self._clock, self._known = decoder, options, clock, known
        self._queue: deque[_Waiting] = deque()
        self._episode: tuple[Any, ...] | None = None
        self._block: tuple[Any, ...] | None = None  # the newest of which was heard: practice and number
        self.begin_stream()

    def begin_stream(self) -> None:
        """Begin with another stream, whose clock may be another one: what waits is decided no more."""
        self._stream = self._decoder.stream(kept_s=KEPT_S)
        self._timeline = Timeline(self._decoder.sfreq, kept_s=KEPT_S + 1.0)
        for one in self._queue:
            one.lost = True

    def go_on(self, policy: Policy, episode: tuple[Any, ...] | None) -> None:
        """Go on where another loop was, whose lessons the learner has had.

        Args:
            policy: What that one had learned up to its last block's beginning.
            episode: The episode of its last move: practice, block and episode; None for none.
        """
        self._episode = episode
        self._block = episode and episode[:2]
        if self._options.mode == "semi":
            self.policy = policy

    @property
    def memory(self) -> dict[str, Any] | None:
        """What the filter keeps of the past, and the stamp of its last sample; None where it begins."""
        kept = self._stream.chain.memory
        return None if kept is None else {"stamp": self._timeline.stamp(self._stream.end - 1), "memory": kept.tolist()}

    def remember(self, memory: np.ndarray) -> None:
        """Let the filter go on, at the next sample, where a live session's was."""
        self._stream.chain.go_on(memory)

    # --- what comes -----------------------------------------------------------------------------------------------

    def samples(
        self, stamps: np.ndarray, values: np.ndarray, codes: np.ndarray | None, marks: np.ndarray, pulled: float
    ) -> None:
        """Take the next samples, of at most a second.

        Args:
            stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
            values: ndarray, shape (n_channels, n_samples), µV, the decoder's channels.
            codes, marks, pulled: As :meth:`.Timeline.add` takes them.
        """
        self._stream.push(values)
        self._timeline.add(stamps, codes, marks, pulled)

    def broken(self) -> None:
        """Say that samples are missing before the next one."""
        self._stream.broken()
        self._timeline.broken()

    def move(self, trial: Trial, moment: float) -> None:
        """Take a move's marker; ``moment``: its time on the EEG sender's clock, NaN where that is not known."""
        tags = {"practice": trial.practice, "block": trial.block, "episode": trial.episode}
        self._queue.append(_Waiting(tags, trial, moment))

    def begins(self, tags: Mapping[str, Any]) -> bool:
        """Return whether a move's tags tell of a block whose own marker was not heard."""
        return (tags["practice"], tags["block"]) != self._block

    def block(self, tags: Mapping[str, Any]) -> None:
        """Take the marker of a block's beginning, or of its first move that was heard: the block before has ended."""
        self._block = tags["practice"], tags["block"]
        self._queue.append(_Waiting(tags, None))

    # --- what comes of it -----------------------------------------------------------------------------------------

    @property
    def waiting(self) -> bool:
        """Whether a move waits for its samples."""
        return bool(self._queue)

    def due_s(self) -> float:
        """Return in how many seconds the next decision is due, about; infinity for none."""
        first = next((one.trial for one in self._queue if one.trial is not None), None)
        if first is None:
            return float("inf")
        return first.marker_s + self._decoder.n_times / self._decoder.sfreq - self._clock()

    def advance(self, *, more: bool = False, finish: bool = False) -> list[Trial | Mapping[str, Any]]:
        """Return the moves that are dealt with, and the tags of blocks that began, in their order.

        Args:
            more: More samples have come already: nothing is given up for want of them.
            finish: No more samples come: what waits is given up.
        """
        done: list[Trial | Mapping[str, Any]] = []
        while self._queue:
            head = self._queue[0]
            if head.trial is None:
                self._begin_block()
                done.append(head.tags)
            elif self._dealt_with(head, head.trial, more=more, finish=finish):
                done.append(head.trial)
            else:
                break
            self._queue.popleft()
        return done

    def _begin_block(self) -> None:
        self.blocks += 1
        if self._options.afresh:
            self.learner.afresh()
            self._episode = None
        if self._options.mode == "semi" or self._options.afresh:
            self.policy = self.learner.policy()

    def _dealt_with(self, head: _Waiting, trial: Trial, *, more: bool, finish: bool) -> bool:
        """Decide and learn, if the time has come."""
        begun = self._clock()
        given_up = finish or (not more and begun - trial.marker_s > self._options.deadline_s + _PATIENCE_S)
        problem, cause = self._problem(trial)
        first = None if head.lost else head.first
        if head.lost:
            cause = cause or "missing"
        elif np.isnan(head.moment) and not self._knows(trial):
            cause = cause or "clock"
        elif first is None:
            first, why = self._first(head, trial, given_up)
            if first is None and not why:
                return False
            # What it follows from has come: it need not be found again in each step.
            cause, head.first = cause or why, first if trial.zero_stamp is not None else None
        if first is not None:
            state = self._stream.state(first, self._decoder.n_times)
            if state is State.COMING and not given_up:
                return False
            if state is not State.COMPLETE:
                numbers = self._timeline.marked(first, self._decoder.n_times) & NOT_FINITE == 0
                cause = cause or (_STATES[state] if numbers or state is not State.BROKEN else "not finite")
            elif problem:
                cause = self._decide(trial, first, problem)
        self._learn(trial, cause, begun)
        return True

    def _knows(self, trial: Trial) -> bool:
        return self._known is not None and (trial.marker, trial.marker_stamp) in self._known.zeros

    def _problem(self, trial: Trial) -> tuple[str, str]:
        """Return the name of the problem that is decided, or why there is none."""
        if trial.actor not in (HUMAN, ROBOT):
            return "", "untagged"
        try:
            return self._decoder.problem_of(trial.actor), ""
        except KeyError:
            return "", "no problem"

    def _first(self, head: _Waiting, trial: Trial, given_up: bool) -> tuple[int | None, str]:
        """Return the epoch's first sample, or why there is none; neither where that is not known yet."""
        timeline, sfreq = self._timeline, self._decoder.sfreq
        key = trial.marker, trial.marker_stamp
        if self._known is not None and self._knows(trial):
            first = timeline.with_stamp(self._known.zeros[key])
            if first is not None:
                trial.zero_from, trial.zero_stamp = "log", self._known.zeros[key]
            return first, "" if first is not None or not given_up else "missing"
        # An edge may come as late as the window is wide: only then all that may time it are there.
        last = max(0.0, 1e-3 * self._options.amp_delay_ms) + self._options.snap_s
        if not timeline.passed(head.moment + last + 2 / sfreq):
            return None, "missing" if given_up else ""
        place = timeline.place(head.moment)
        if place is None:
            return None, "gone" if timeline.forgotten(head.moment) else "gap"
        expected = place + 1e-3 * self._options.amp_delay_ms * sfreq
        edge = timeline.edge(expected, self._options.snap_s * sfreq)
        zero = expected if edge is None else float(edge)
        first = self._decoder.first(zero)
        if first < 0:
            return None, "gone"
        trial.zero_from = "marker" if edge is None else "trigger"
        trial.zero_shift_ms = 1e3 * (zero - place) / sfreq
        if first < timeline.end:
            trial.zero_stamp = timeline.stamp(first)
        return first, ""

    def _decide(self, trial: Trial, first: int, problem: str) -> str:
        """Write down what the epoch says; return why nothing may be learned of it, or an empty string."""
        decoder, timeline = self._decoder, self._timeline
        last = first + decoder.n_times - 1
        trial.zero_stamp, trial.last_stamp = timeline.stamp(first), timeline.stamp(last)
        trial.pulled_s, trial.problem = timeline.pulled(last), problem
        try:
            decision = decoder.decide(self._stream.cut(first, decoder.n_times), problem)
        except NotFiniteTrialsError:
            return "not finite"
        trial.score, trial.probability, trial.peak_uv = decision.score, decision.probability, decision.peak_uv
        trial.takeover = decision.takeover
        trial.predicted = trial.actor if not decision.takeover else (ROBOT if trial.actor == HUMAN else HUMAN)
        if timeline.marked(first, decoder.n_times) & RAILED:
            return "railed"
        return "artefact" if decision.artefact else ""

    def _learn(self, trial: Trial, cause: str, begun: float) -> None:
        options, learner = self._options, self.learner
        trial.decided_s = decided = self._clock()
        in_time = decided - trial.marker_s <= options.deadline_s
        if self._known is not None:
            late = self._known.late.get((trial.marker, trial.marker_stamp), "")
            in_time, cause = not late, cause or late
        trial.deadline_met = in_time and trial.score is not None
        cause = cause or ("" if in_time else "late") or self._teaches_nothing(trial)
        episode = (trial.practice, trial.block, trial.episode)
        if self._episode not in (None, episode):
            learner.end_episode()
        self._episode = episode
        trial.q_before, trial.policy_before = learner.values(), learner.policy()
        if not cause:
            assert trial.score is not None
            assert trial.takeover is not None
            odds = self._decoder.problems[trial.problem].log_odds(trial.score)
            learner.update(str(trial.next), before=trial.actor, takeover=trial.takeover, log_odds=odds)
        trial.update, trial.cause = not cause, cause
        self.causes[cause] += 1
        trial.q_after, trial.policy_after = learner.values(), learner.policy()
        if options.mode == "closed":
            self.policy = trial.policy_after
        trial.stages_ms = {"decision": 1e3 * (decided - begun), "learning": 1e3 * (self._clock() - decided)}
        if trial.pulled_s is not None:
            trial.stages_ms["waiting"] = 1e3 * (begun - trial.pulled_s)

    def _teaches_nothing(self, trial: Trial) -> str:
        if trial.practice:
            return "practice"
        if trial.scenario not in self._options.scenarios:
            return "scenario"
        if not trial.next:
            return "untagged" if trial.next is None else "last"
        return "" if trial.next in SUBTASKS else "diagonal"

    @property
    def published(self) -> Policy | None:
        """The policy that the robot may take up; None in ``shadow``."""
        return None if self._options.mode == "shadow" else self.policy
