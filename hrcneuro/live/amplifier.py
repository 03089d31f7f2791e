"""A simulated amplifier: samples at true pace, with a trigger channel, and whatever goes wrong with such a thing.

Sample k is taken at ``start + k / rate`` of the amplifier's own clock, however late this process gets to send it: over
an hour it neither loses nor gains a sample. It leaves ``LATENCY_S`` later, so that a trigger, which a cable would bring
at once and a marker stream brings milliseconds late, is still in time for its sample.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from hrcneuro.live.faults import Fault
from hrcneuro.live.transport import Clock

LATENCY_S = 0.03
PULSE_S = 0.01
PAUSE_S = 1.0  # of a recording that is sent again, for each of its breaks
TRIGGER = "TRIGGER"
MOVE_CODE = 1.0


class Signal(Protocol):
    """What the amplifier's electrodes see."""

    @property
    def ch_names(self) -> Sequence[str]:
        """The channels."""

    @property
    def sfreq(self) -> float:
        """Sampling rate, Hz."""

    def take(self, n: int) -> np.ndarray:
        """Return the next samples, shape (n, n_channels), float32, µV; fewer where it ends.

        A row of NaN is a sample that nobody took: it is not sent.
        """


class Outlet(Protocol):
    """Where samples go."""

    def push(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Send samples, shape (n_samples, n_channels), each with its stamp, seconds."""

    def close(self) -> None:
        """Let the stream vanish."""


@dataclass
class Replay:
    """A recording that is sent again, from its first sample to its last.

    Attributes:
        ch_names: The channels.
        sfreq: Sampling rate, Hz.
        data: ndarray, shape (n_channels, n_times), float32, µV.
        breaks: First samples after breaks, ascending: nobody knows how long they lasted; a pause stands for each.
        taken: Samples that were taken, those of pauses among them.
    """

    ch_names: Sequence[str]
    sfreq: float
    data: np.ndarray
    breaks: Sequence[int] = ()
    taken: int = 0

    @property
    def pause(self) -> int:
        """Samples of a pause."""
        return round(PAUSE_S * self.sfreq)

    def place(self, sample: int) -> int:
        """Return which one of those that are taken a sample of the data is."""
        return sample + self.pause * bisect_right(self.breaks, sample)

    def take(self, n: int) -> np.ndarray:
        """Return the next samples, shape (n, n_channels), float32, µV; fewer at its end, and NaN in a pause."""
        n_channels, n_times = self.data.shape
        n = min(n, n_times + self.pause * len(self.breaks) - self.taken)
        piece = np.full((n, n_channels), np.nan, np.float32)
        edges = [0, *self.breaks, n_times]
        for start, stop in pairwise(edges):
            # Of each stretch, what lies in the piece.
            shift = self.place(start) - start - self.taken
            low, high = max(start, -shift), min(stop, n - shift)
            if low < high:
                piece[low + shift : high + shift] = self.data[:, low:high].T
        self.taken += n
        return piece


class Amplifier:
    """The amplifier.

    Attributes:
        sent: Samples that were sent or lost.
        over: Whether its signal has ended, or it has vanished for good.
    """

    def __init__(
        self,
        signal: Signal,
        open_outlet: Callable[[], Outlet],
        clock: Clock,
        *,
        chunk: int = 10,
        apart: bool = True,
        faults: Iterable[Fault] = (),
        rng: np.random.Generator,
    ) -> None:
        """Begin at this moment.

        Args:
            signal: What it measures.
            open_outlet: Lets its stream be there.
            clock: Seconds.
            chunk: Samples that leave together.
            apart: Chunks that are due at the same time leave one by one; else as one.
            faults: What goes wrong.
            rng: For what is by chance.
        """
        self._signal, self._open, self._clock, self._chunk, self._rng = signal, open_outlet, clock, chunk, rng
        self._apart = apart
        constant = {one.kind: one.value for one in faults}
        self._delay, self._jitter = constant.get("delay", 0.0), constant.get("jitter", 0.0)
        self._rate = signal.sfreq * (1 + 1e-6 * constant.get("drift", 0.0))
        self._flat = int(constant.get("flat", 0))
        self._scale = 1e-6 if "volts" in constant else 1.0
        self._stuck = "stuck" in constant
        timed = [one for one in faults if one.kind in ("drop", "stall", "reconnect", "end")]
        self._coming = deque(sorted(timed, key=lambda one: one.at))
        self._begun: list[tuple[Fault, float]] = []
        self._pulses: list[tuple[int, float]] = []
        self._outlet: Outlet | None = open_outlet()
        self.start, self.sent, self.over = clock(), 0, False

    def sample_at(self, when: float) -> float:
        """Return which sample is taken at a time of the clock, and its fraction."""
        return (when - self.start) * self._rate

    def seen_at(self, when: float) -> int:
        """Return the first sample that shows what happens at a time; a thousandth keeps rounding from costing one."""
        return math.ceil(self.sample_at(when) - 1e-3)

    def time_of(self, sample: int) -> float:
        """Return when a sample is taken, seconds of the clock."""
        return self.start + sample / self._rate

    def trigger(self, when: float, code: float = MOVE_CODE) -> int:
        """Let the trigger channel show a code from a time on; return the sample of its edge.

        A line that rises between two samples is seen in the later one. A time whose sample has left already is answered
        with the next one that leaves.
        """
        edge = max(self.seen_at(when), self.sent)
        self._pulses.append((edge, code))
        return edge

    def due_s(self) -> float:
        """Return in how many seconds of the clock the next chunk is due; no more than 0 where it has been."""
        return self.time_of(self.sent + self._chunk) + LATENCY_S - self._clock()

    def step(self) -> None:
        """Send what is due."""
        now = self._clock()
        while self._coming and now - self.start >= self._coming[0].at:
            fault = self._coming.popleft()
            self._begun.append((fault, self.start + fault.at + fault.value))
            if fault.kind in ("reconnect", "end"):
                self.close()
                self.over = self.over or fault.kind == "end"
        for fault, end in [one for one in self._begun if now >= one[1]]:
            self._begun.remove((fault, end))
            if fault.kind == "reconnect" and not self.over:
                self._outlet = self._open()
        if self.over or any(fault.kind == "stall" for fault, _ in self._begun):
            return
        due = (int((now - LATENCY_S - self.start) * self._rate) - self.sent) // self._chunk
        if self._apart:
            for _ in range(due):
                self._send(self._chunk)
        elif due > 0:
            self._send(due * self._chunk)

    def close(self) -> None:
        """Let the stream vanish."""
        if self._outlet is not None:
            self._outlet.close()
            self._outlet = None

    def _send(self, n: int) -> None:
        values = self._signal.take(n)
        if len(values) < n:
            self.over = True
        if not len(values):
            return
        numbers = self.sent + np.arange(len(values))
        self.sent += len(values)
        triggers = self._triggers(numbers)
        if self._flat:
            values = values.copy()
            values[:, : self._flat] = 0
        rows = np.column_stack([values * np.float32(self._scale), triggers]).astype(np.float32)
        late = self._delay
        if self._jitter:
            # No sample is stamped before it was taken.
            late = max(0.0, late + self._jitter * self._rng.standard_normal())
        stamps = self.start + numbers / self._rate + late
        lost = any(fault.kind == "drop" for fault, _ in self._begun)
        taken = ~np.isnan(values).all(axis=1)
        if self._outlet is not None and not lost and not self._stuck and taken.any():
            self._outlet.push(stamps[taken], rows[taken])

    def _triggers(self, numbers: np.ndarray) -> np.ndarray:
        length = max(1, round(PULSE_S * self._rate))
        out = np.zeros(len(numbers), np.float32)
        for edge, code in self._pulses:
            out[(numbers >= edge) & (numbers < edge + length)] = code
        self._pulses = [one for one in self._pulses if one[0] + length > numbers[-1]]
        return out
