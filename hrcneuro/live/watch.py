"""Whether a stream comes as it should: gaps, stalls, clocks that were set anew. Numbers only: no clock, no stream.

A stream that says it is regular has a sample each ``1 / sfreq`` seconds of its sender's clock. Where two stamps are
farther apart than that, samples are missing between them. Senders that stamp a chunk when it leaves have steps that
waver: how far is learned from the stream itself, and only what exceeds it by far is called a gap.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.eeg.stamps import usual_step

_LEARN = 2000  # steps between samples from which it is learned how they waver
_FEW_INTERVALS = 5  # a slow stream is not silent between two of its samples
_HOLES = 1000  # gaps that what comes late may still fill
_RESET_S = 1.0  # by so much more than the time that passed a clock does not run ahead


@dataclass(frozen=True)
class Event:
    """Something that a person should know of a stream.

    Attributes:
        kind: ``gap``, ``late``, ``clock``, ``stall``, ``back``, ``lost``, ``garbled``, ``changed``, ``source`` or
            ``slept``.
        stamp: Where, seconds of the sender's clock: of the last sample before it.
        seconds: How long it lasted, or by how much the clock was set; 0 where that is not known yet.
        samples: How many are missing, or came late.
        why: What is known of the cause.
    """

    kind: str
    stamp: float
    seconds: float = 0.0
    samples: int = 0
    why: str = ""

    def __str__(self) -> str:
        if self.kind == "gap":
            return f"{self.samples} samples ({self.seconds:.3f} s) are missing"
        if self.kind == "late":
            return f"{self.samples} samples that were missing came late, behind younger ones"
        if self.kind == "clock":
            return f"the sender's clock was set by {self.seconds:+.3f} s"
        if self.kind == "slept":
            return f"the recorder itself was held up for {self.seconds:.1f} s; what came meanwhile was kept for it"
        if self.kind == "garbled":
            return f"{self.samples} texts are not in UTF-8 and are left out"
        if self.kind == "changed":
            return f"it came back another ({self.why}); it is recorded as a stream of its own"
        if self.kind == "source":
            return f"another sender has taken its place ({self.why})"
        if self.kind == "lost":
            return f"it has ended ({self.why}); it is looked for"
        if self.kind == "stall":
            return f"no samples for {self.seconds:.1f} s"
        return f"{self.why or 'samples come again'} after {self.seconds:.1f} s"


@dataclass
class StreamWatch:
    """What came of one stream so far.

    Attributes:
        sfreq: Nominal rate, Hz; 0 for a stream of irregular times, of which no gap can be told.
        stall_s: A regular stream that is silent for so long is called stalled.
        count: Samples that came.
        first, last: Stamps of the first and of the youngest, seconds of the sender's clock; NaN before any came.
        missing: Samples that did not.
        stalled: Whether it is silent now.
        waited: How long it was looked at before its first samples came, s.
    """

    sfreq: float
    stall_s: float = 1.0
    count: int = 0
    first: float = float("nan")
    last: float = float("nan")
    missing: int = 0
    stalled: bool = False
    waited: float = 0.0
    _came: float | None = None
    # By how much the last steps were shorter than the interval, s; their order does not matter.
    _early: np.ndarray = field(default_factory=lambda: np.zeros(_LEARN))
    _learned: int = 0
    _holes: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=_HOLES))

    def learn(self, stamps: np.ndarray) -> None:
        """Take in how the stamps of this stream waver, from some seconds of it before the watch."""
        if self.sfreq:
            self._learn(1 / self.sfreq - np.diff(stamps))

    @property
    def wavers(self) -> bool:
        """Whether stamps differ from a steady rate by more than half a sample, so that small gaps show in no step."""
        return bool(self.sfreq) and self._usual() > 0.5 / self.sfreq

    def feed(self, stamps: np.ndarray, now: float) -> list[Event]:
        """Return what stands out in newly come samples.

        Args:
            stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
            now: When they were pulled, seconds of the receiver's clock.
        """
        if not len(stamps):
            return self._silence(now)
        events = []
        silent = 0.0 if self._came is None else now - self._came
        if self.stalled:
            events.append(Event("back", self.last, silent))
            self.stalled = False
        joined = stamps if self.count == 0 else np.concatenate([[self.last], stamps])
        told, self.last = self._odd_steps(joined, silent)
        if self.count == 0:
            self.first, self.waited = float(stamps[0]), silent
        self.count += len(stamps)
        self._came = now
        return [*events, *told]

    @property
    def came(self) -> float:
        """When the newest samples were pulled, seconds of the receiver's clock; minus infinity before any came."""
        return self._came if self.count and self._came is not None else float("-inf")

    def silent(self, now: float) -> float:
        """Return for how long a regular stream has been silent, s; 0 for one of irregular times."""
        return now - self._came if self.sfreq and self._came is not None else 0.0

    def _silence(self, now: float) -> list[Event]:
        if self._came is None:
            self._came = now
        silent = now - self._came
        if self.stalled or not self.sfreq or silent < max(self.stall_s, _FEW_INTERVALS / self.sfreq):
            return []
        self.stalled = True
        return [Event("stall", self.last, silent)]

    def _odd_steps(self, stamps: np.ndarray, silent: float) -> tuple[list[Event], float]:
        """Return what stands out in stamps, of which the first is the last one before, and the youngest of them."""
        steps, last = np.diff(stamps), float(stamps[-1])
        if not self.sfreq or not len(steps):
            return [], last
        interval, usual = 1 / self.sfreq, self._usual()
        odd = np.flatnonzero((steps > interval + usual) | (steps < -usual))
        events, wavering = [], np.ones(len(steps), bool)
        if len(odd):
            pieces = np.split(stamps, odd + 1)
            last = float(pieces[0][-1])
            for at, piece in zip(odd, pieces[1:], strict=True):
                if hole := self._hole_of(piece, last):
                    # Its clock is the same, and what comes behind it goes on from before it.
                    events.append(self._filled(hole, piece))
                    wavering[at] = False
                    continue
                events += self._step(last, float(piece[0]), silent, usual)
                last = float(piece[-1])
        self._learn((interval - steps)[wavering])
        return events, last

    def _step(self, last: float, after: float, silent: float, usual: float) -> list[Event]:
        step = after - last
        if step < -usual or step > max(silent, 2 * self.stall_s) + _RESET_S:
            self._holes.clear()
            return [Event("clock", last, step - silent)]
        lost = round(step * self.sfreq) - 1
        if step <= 1 / self.sfreq + usual or lost < 1:
            return []
        self.missing += lost
        self._holes.append((last, after))
        return [Event("gap", last, lost / self.sfreq, lost)]

    def _hole_of(self, piece: np.ndarray, last: float) -> tuple[float, float] | None:
        """Return the gap in which samples belong that came behind younger ones; none where they belong in none."""
        if piece[0] > last:
            return None
        margin = 0.5 / self.sfreq
        around = ((a, b) for a, b in self._holes if a + margin < piece[0] and piece[-1] < b - margin)
        return next(around, None)

    def _filled(self, hole: tuple[float, float], piece: np.ndarray) -> Event:
        self._holes.remove(hole)
        begin, end = float(piece[0]), float(piece[-1])
        rest = [(hole[0], begin), (end, hole[1])]
        self._holes.extend((a, b) for a, b in rest if round((b - a) * self.sfreq) > 1)
        self.missing -= len(piece)
        return Event("late", hole[0], len(piece) / self.sfreq, len(piece))

    def _usual(self) -> float:
        """Return by how much a step may differ from the sampling interval without a word, seconds."""
        return usual_step(self._early[: self._learned], 1 / self.sfreq)

    def _learn(self, early: np.ndarray) -> None:
        early = early[-_LEARN:]
        self._early[(self._learned + np.arange(len(early))) % _LEARN] = early
        self._learned += len(early)
