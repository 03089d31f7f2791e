"""The closed loop over streams: EEG and markers come in, decisions and the policy go out, a line a move is written.

It is stepped from outside, in real time some hundreds of times a second; it reads no clock and finds no stream but
those of the network that it is handed, so that the same code runs live, at virtual pace, and on a recording. It hears
the EEG and the markers, and no other stream: what a simulated person knows stays unknown to it.
"""

from __future__ import annotations

import glob
import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Any

import numpy as np

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.errors import HardwareError
from hrcneuro.learning.online import OnlineLearner
from hrcneuro.live import online_streams
from hrcneuro.live.deciding import Deciding
from hrcneuro.live.decisions import BLOCK, BREAK, STRANGE, Known, Trial, begin_line, message, trial_of
from hrcneuro.live.hearing import Hearing
from hrcneuro.live.online_streams import Eeg
from hrcneuro.live.parameters import Declared, OnlineOptions
from hrcneuro.live.transport import UNMEASURED_S, Clock, Inlet, Lost, Network, Samples, abandon
from hrcneuro.live.watch import Event
from hrcneuro.paradigm import markers

Publish = Callable[[str, float], None]
"""Sends a text with its stamp, seconds of the receiver's clock."""
Log = Callable[[Mapping[str, Any]], None]
_LOOK_EVERY_S = 0.5
_SHOWN, _TIMED = 200, 10_000
_LOOK_BACK_S = 2.0
_MOST_TOLD = 20  # of a kind; all are counted


class Online:
    """The loop.

    Attributes:
        deciding: Decoder and learner.
        eeg: The EEG.
        hearing: The markers.
        events: What stood out in the EEG, kind -> how often.
        recent: The last seconds of the EEG in pieces, each ndarray, shape (n_channels, n_times), µV.
        trials: The last moves, for who looks on.
        decided, in_time: How many moves were decided, and how many of them before the deadline.
        durations: Stage -> how long it took, ms, of the last decisions.
        over: Whether a marker has told that none comes any more, and every move is dealt with.
    """

    def __init__(
        self,
        network: Network,
        clock: Clock,
        eeg: Eeg,
        decoder: FrozenDecoder,
        learner: OnlineLearner,
        options: OnlineOptions,
        *,
        subject: str,
        publish: Publish,
        log: Log,
        rail_uv: float = 0.0,
        known: Known | None = None,
        tell: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Begin with a stream that was found.

        Args:
            network, clock: Where streams are found again; seconds of the receiver's clock.
            eeg: The stream.
            decoder, learner, options: How it is decided and learned.
            subject: Whose moves count.
            publish: Sends decisions.
            log: Writes lines.
            rail_uv: A channel that reaches this is railed, µV; 0 for no such bound.
            known: Of a replay, what the live session's log tells.
            tell: Is told at once what a person should know.
        """
        self._network, self._clock, self._decoder, self._options = network, clock, decoder, options
        self._subject, self._publish, self._log, self._rail_uv, self._tell = subject, publish, log, rail_uv, tell
        self._known = known
        self.eeg = eeg
        self.deciding = Deciding(decoder, learner, options, clock, known=known)
        self.events: Counter[str] = Counter()
        self.trials: deque[Trial] = deque(maxlen=_SHOWN)
        self.decided = self.in_time = 0
        self.durations: dict[str, deque[float]] = {}
        self.recent: deque[np.ndarray] = deque()
        self._difference = float("nan")  # from markers' stamps to the EEG's, fixed at a block's start
        self._after = float("-inf")  # a measurement before this is of a clock that was set since
        now = clock()
        self.hearing = Hearing(network, options.markers, subject, now, strange=self._odd, tell=tell)
        self.hearing.look(now)
        self._looked, self._came, self._returned = float("-inf"), now, float("-inf")
        self._first, self._seen = True, 0
        self._begins: tuple[float, np.ndarray | None] | None = None
        self._lost = ""
        self._opening: Future[Inlet] | None = None  # the EEG that is back, and is being connected to

    # --- steps ----------------------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether a marker has told that none comes any more, and every move is dealt with."""
        return self.hearing.ended and not self.deciding.waiting

    def step(self) -> None:
        """Take what has come; decide, publish and log what is due.

        Raises:
            HardwareError: The EEG is gone for too long, or came back as one that the decoder does not serve.
            StageError: The log cannot be written.
        """
        samples, pulled = self._pull_eeg()
        now = self._clock()
        self._hear(now)
        if samples is not None and len(samples):
            self._take(samples, pulled)
        elif samples is not None:
            self._told(self.eeg.watch.feed(samples.stamps, now))
        self._deal()
        if now - self._looked >= _LOOK_EVERY_S or (self._opening is not None and self._opening.done()):
            self._looked = now
            self._look(now)

    def finish(self) -> None:
        """Deal with what still waits: no more comes."""
        self._deal(finish=True)

    def _deal(self, *, more: bool = False, finish: bool = False) -> None:
        for one in self.deciding.advance(more=more, finish=finish):
            if isinstance(one, Trial):
                one.sent_s = self._clock()
                self._publish(message(self._options.mode, self.deciding.published, one.sent_s, one), one.sent_s)
                one.stages_ms["sending"] = 1e3 * (self._clock() - one.sent_s)
                self._note(one)
            else:
                now = self._clock()
                self._publish(message(self._options.mode, self.deciding.published, now), now)
                difference = None if np.isnan(self._difference) else self._difference
                about = {"difference_s": difference, "policy": self.deciding.policy, "filter": self.deciding.memory}
                self._log({"kind": BLOCK, **one, **about})

    def _note(self, one: Trial) -> None:
        self.trials.append(one)
        if one.score is not None and one.pulled_s is not None and one.sent_s is not None:
            self.decided += 1
            self.in_time += one.deadline_met
            whole = {
                "onset to sent": 1e3 * (one.sent_s - one.marker_s),
                "received to sent": 1e3 * (one.sent_s - one.pulled_s),
            }
            for name, ms in {**whole, **one.stages_ms}.items():
                self.durations.setdefault(name, deque(maxlen=_TIMED)).append(ms)
        self._log(one.line)

    # --- the EEG --------------------------------------------------------------------------------------------------

    def _pull_eeg(self) -> tuple[Samples | None, float]:
        if self._lost:
            return None, self._clock()
        try:
            samples = self.eeg.inlet.pull()
            if self.eeg.inlet.reconnected():
                # Its units and channels are to be looked at again before a sample of it counts.
                raise Lost("another run of it has begun")
            self.eeg.measure()
        except Lost as error:
            self._lost = str(error)
            self.events["lost"] += 1
            self._tell(f"the EEG has ended ({error}); it is looked for")
            return None, self._clock()
        return samples, self._clock()

    def _take(self, samples: Samples, pulled: float) -> None:
        self._came = pulled
        samples = self._from_start(samples)
        if not len(samples):
            return
        samples, breaks = self._in_order(samples, pulled)
        values = np.asarray(samples.values)
        for broken, part in online_streams.pieces(samples, breaks, self._decoder.sfreq):
            if broken:
                self.deciding.broken()
                self._log({"kind": BREAK, "stamp": float(samples.stamps[part.start])})
            own = values[part][:, self.eeg.rows].T
            codes = values[part][:, self.eeg.trigger] if self.eeg.trigger >= 0 else None
            self.deciding.samples(samples.stamps[part], own, codes, self.eeg.marks(own, self._rail_uv), pulled)
            self._deal(more=True)
            self._remember(own)

    def _remember(self, own: np.ndarray) -> None:
        self.recent.append(own)
        self._seen += own.shape[1]
        while self._seen - self.recent[0].shape[1] > _LOOK_BACK_S * self._decoder.sfreq:
            self._seen -= self.recent.popleft().shape[1]

    def _from_start(self, samples: Samples) -> Samples:
        """Return the samples from where the loop begins; a replay begins where the live session's state is known."""
        if not self._first:
            return samples
        at = 0
        if self._known is not None:
            if self._begins is None:
                self._begins = self._known.state(float(samples.stamps[0]))
            begins, memory = self._begins
            # A memory is that of the sample, a start the sample's own.
            at = int(np.searchsorted(samples.stamps, begins, side="left" if memory is None else "right"))
            if at == len(samples):
                return Samples(samples.stamps[:0], np.asarray(samples.values)[:0])
            if memory is not None:
                self.deciding.remember(memory)
        self._first = False
        stamp = float(samples.stamps[at])
        self._log(begin_line(self._subject, stamp, self.eeg.inlet.description, self._options))
        return Samples(samples.stamps[at:], np.asarray(samples.values)[at:])

    def _told(self, events: list[Event]) -> list[Event]:
        for event in events:
            self.events[event.kind] += 1
            if self.events[event.kind] <= _MOST_TOLD:
                self._tell(f"EEG: {event}")
        return events

    def _in_order(self, samples: Samples, pulled: float) -> tuple[Samples, list[int]]:
        """Return the samples without those that came behind younger ones, and where others are missing before."""
        last, events = self.eeg.watch.last, self._told(self.eeg.watch.feed(samples.stamps, pulled))
        kinds = {event.kind for event in events}
        if "late" in kinds and "clock" not in kinds:
            samples = online_streams.in_order(samples, last)
        return samples, self._breaks(samples, pulled, np.concatenate([[last], samples.stamps[:-1]]), events)

    def _breaks(self, samples: Samples, pulled: float, before: np.ndarray, events: list[Event]) -> list[int]:
        """Return the places among the samples before which others are missing."""
        found = []
        for event in events:
            if event.kind == "clock":
                # What was measured of the old clock is worth nothing now.
                self._after, self._difference = pulled, float("nan")
            if event.kind in ("gap", "clock"):
                found += np.flatnonzero(before == event.stamp)[:1].tolist()
        if self._known is not None and self._known.starts:
            return np.flatnonzero(np.isin(samples.stamps, self._known.starts[1:])).tolist()
        return found

    # --- markers --------------------------------------------------------------------------------------------------

    def _hear(self, now: float) -> None:
        if math.isnan(self.eeg.offset) and now - self._returned < UNMEASURED_S:
            return
        for tags, text, stamp, when in self.hearing.hear(now):
            move = "trial" in tags
            # A marker may be missed: the move tells of its block, too.
            block = not move or self.deciding.begins(tags)
            if self.hearing.clock_was_set():
                # What was measured of the old clock is worth nothing now.
                self._difference = float("nan")
                self.events["markers' clock"] += 1
                self._tell("the markers' clock was set: their times are fixed anew")
            if block or np.isnan(self._difference):
                self._fix()
            if block:
                self.deciding.block({name: tags[name] for name in markers.BLOCK_TAGS})
            if move:
                self.deciding.move(trial_of(tags, text, stamp, when), stamp + self._difference)

    def _fix(self) -> None:
        """Fix what brings a marker's stamp onto the EEG's clock, until the next block."""
        if self.eeg.measured > self._after:
            self._difference = self.hearing.offset - self.eeg.offset

    def _odd(self, text: str, stamp: float, why: str) -> None:
        known = stamp if math.isfinite(stamp) else None
        self._log({"kind": STRANGE, "marker": text, "stamp": known, "why": why})

    # --- streams that come and go ---------------------------------------------------------------------------------

    def _look(self, now: float) -> None:
        if self.hearing.look(now):
            self._difference = float("nan")
        silent = now - self._came
        if not self._lost and silent < max(1.0, 0.25 * self._options.lost_s):
            if self._opening is not None:
                # It goes on as it was; the other one is not needed.
                abandon(self._opening)
                self._opening = None
            return
        was = self.eeg.inlet.description
        again = online_streams.another(
            self._network, Declared(name=glob.escape(was.name), type=glob.escape(was.type)), was.uid
        )
        if again is not None and self._opening is None:
            # Markers are heard meanwhile, and whoever asks is answered.
            self._opening = self._network.opening(again)
        if self._opening is not None:
            if self._opening.done():
                self._go_on(self._opening)
        elif silent >= self._options.lost_s:
            there = any(one.uid == was.uid for one in self._network.visible())
            state = "is there and brings nothing" if there else "is gone"
            raise HardwareError(
                f"no EEG for {silent:.1f} s: {was.name!r} {state}; all that was decided stands in the log",
                cure="start the amplifier's program again, then this command with --go-on, which keeps what was "
                "learned; the session, which pauses meanwhile, goes on by the experimenter's key",
            )

    def _go_on(self, opening: Future[Inlet]) -> None:
        """Take up the EEG again, if the decoder still serves it."""
        name = self.eeg.inlet.description.name
        self._opening = None
        self.eeg.inlet.close()
        self.eeg = online_streams.served(opening, name, self._decoder, self._options)
        self.deciding.begin_stream()
        self._difference, self._after, self._lost, self._first = float("nan"), float("-inf"), "", True
        self._came = self._returned = self._clock()
        self._tell("the EEG is back")
