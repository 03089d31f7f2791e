"""A stream on its way into a file: what came of it, what waits, and how late it is."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.live import xdf
from hrcneuro.live.transport import Description, Inlet, Samples
from hrcneuro.live.watch import StreamWatch
from hrcneuro.paradigm import markers

_LAGS = 10_000
_OVERLAP_S = 30.0
_STEADY = 0.5  # of the sampling interval: by so much a step may differ from it within one run of a stream


@dataclass
class Stream:
    """A stream that is recorded.

    Attributes:
        key: Its name in the configuration, or its own.
        number: In the file.
        description: What it said of itself when it was opened first.
        inlet: From which it comes; none while it is lost.
        watch: Whether it comes as it should.
        offsets: (when, offset) of each measured difference of clocks, seconds of the recorder's clock.
        last: The newest samples, for who looks on.
        gone: Whether it is not on the network any more, as far as is known.
        lost: Since when it is told to be lost, seconds of the recorder's clock; none where it is not.
        garbled: Texts that could not be read.
        ended: Whether another one has taken its place.
        silent: How long it had been silent when the recording was ended, s.
        overlap: Stamp up to which its samples were taken from another inlet; NaN for none.
        pulls: How often samples came.
        unsure: Whether it comes from another run, of which it is not known yet whether it is the same kind of stream.
        held: What came of that run, in no file yet.
        lags: From when a sample was taken to when it was in the file, s, of some samples of some pulls.
        fresh: When samples that are not in the file yet were taken, seconds of the recorder's clock.
        unsynced: When the oldest sample that is not on the disk yet was taken, seconds of the recorder's clock; NaN
            for none.
        disk: The longest time from when a sample was taken to when it was on the disk, s; NaN where none was.
    """

    key: str
    number: int
    description: Description
    inlet: Inlet | None
    watch: StreamWatch
    offsets: list[tuple[float, float]] = field(default_factory=list)
    last: Samples | None = None
    gone: bool = False
    lost: float | None = None
    garbled: int = 0
    pulls: int = 0
    ended: bool = False
    silent: float = 0.0
    overlap: float = float("nan")
    unsure: bool = False
    held: list[Samples] = field(default_factory=list)
    lags: deque[float] = field(default_factory=lambda: deque(maxlen=_LAGS))
    fresh: list[float] = field(default_factory=list)
    unsynced: float = float("nan")
    disk: float = float("nan")

    @property
    def said_end(self) -> bool:
        """Whether its newest text tells that none comes any more: such a stream ends on purpose."""
        if self.last is None or self.description.channel_format != "string":
            return False
        return markers.is_end(str(self.last.values[-1][0]))

    def written(self, now: float, *, synced: bool) -> None:
        """Note how old its newest samples are, now that they are in the file."""
        self.lags.extend(now - one for one in self.fresh)
        self.fresh.clear()
        if synced and self.unsynced == self.unsynced:
            self.disk = max(now - self.unsynced, self.disk if self.disk == self.disk else 0.0)
            self.unsynced = float("nan")


def apart(held: list[Samples], watch: StreamWatch) -> tuple[list[Samples], list[Samples]]:
    """Return what was held of a stream's old run, and of its new one: the old one goes on without a step.

    Args:
        held: What came, in its order.
        watch: Of what came before.
    """
    if not watch.sfreq or not watch.count:
        return [], held
    last, before = watch.last, list[Samples]()
    for number, samples in enumerate(held):
        steps = np.diff(samples.stamps, prepend=last)
        odd = np.flatnonzero(np.abs(steps * watch.sfreq - 1) > _STEADY)
        if len(odd):
            first = int(odd[0])
            pieces = [
                Samples(samples.stamps[part], samples.values[part]) for part in (slice(first), slice(first, None))
            ]
            return [*before, pieces[0]], [pieces[1], *held[number + 1 :]]
        before.append(samples)
        last = float(samples.stamps[-1])
    return before, []


def not_yet(samples: Samples, stream: Stream) -> Samples:
    """Return what is new of a stream that is received from two inlets, one after the other, for a moment both."""
    if stream.overlap != stream.overlap or not len(samples):
        return samples
    # A clock that began anew is no overlap.
    new = (samples.stamps > stream.overlap) | (samples.stamps < stream.overlap - _OVERLAP_S)
    stream.overlap = float("nan")
    values = samples.values
    kept = values[new] if isinstance(values, np.ndarray) else [v for v, keep in zip(values, new, strict=True) if keep]
    return Samples(samples.stamps[new], kept)


def footer(stream: Stream) -> bytes:
    """Return the chunk that ends a stream in its file."""
    watch = stream.watch
    first, last = (watch.first, watch.last) if watch.count else (0.0, 0.0)
    return xdf.stream_footer(stream.number, first, last, watch.count, stream.offsets)
