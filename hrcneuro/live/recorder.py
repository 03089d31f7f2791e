"""A recording as it goes: what comes of each stream goes into the file, and what stands out is told and marked.

The recorder is stepped from outside, some twenty times a second in real time; it reads no clock and finds no stream but
those it is handed, so that the same code records at virtual pace.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.live import xdf
from hrcneuro.live.part import Part
from hrcneuro.live.transport import RECORDER, Clock, Description, Inlet, Lost, Samples
from hrcneuro.live.watch import Event, StreamWatch
from hrcneuro.paradigm import markers

OWN = RECORDER
_OWN_NUMBER = 1
_OWN_XML = (
    f'<?xml version="1.0"?><info><name>{OWN}</name><type>Markers</type><channel_count>1</channel_count>'
    f"<channel_format>string</channel_format><source_id>{OWN}</source_id><nominal_srate>0</nominal_srate>"
    "<version>1.1</version><desc/></info>"
)
_BOUNDARY_S = 10.0
_SYNC_S = 1.0
_SLEPT_S = 2.0  # between two steps: the streams wait in memory for half a minute
_OVERLAP_S = 30.0
_LAGS = 10_000
_EVERY_LAG = 5  # pulls: so much of them tells how late they are


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
        lags: From when the newest sample of a pull was taken to when it was received and written, s, of some pulls.
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
    lags: deque[float] = field(default_factory=lambda: deque(maxlen=_LAGS))

    @property
    def said_end(self) -> bool:
        """Whether its newest text tells that none comes any more: such a stream ends on purpose."""
        if self.last is None or self.description.channel_format != "string":
            return False
        return markers.is_end(str(self.last.values[-1][0]))


Tell = Callable[[Stream, Event], None]


class Recorder:
    """Streams on their way into a file.

    Attributes:
        streams: Those that are recorded.
        own: The stream of marks.
    """

    def __init__(self, part: Part, clock: Clock, *, stall_s: float, tell: Tell, keep_host: bool = False) -> None:
        """Begin with no stream.

        Args:
            part: The file.
            clock: Seconds of the receiver's clock.
            stall_s: A regular stream that is silent for so long is told of.
            tell: Is told what stands out.
            keep_host: Whether the file tells which machines the streams come from.
        """
        self.streams: list[Stream] = []
        self._part, self._clock, self._stall_s, self._tell, self._keep_host = part, clock, stall_s, tell, keep_host
        now = clock()
        about = Description(OWN, "Markers", "string", 0.0, 1, source_id=OWN, xml=_OWN_XML, bare_xml=_OWN_XML)
        self.own = Stream("recorder", _OWN_NUMBER, about, None, StreamWatch(0.0))
        self._bounded = self._synced = self._stepped = now
        part.add(xdf.stream_header(_OWN_NUMBER, _OWN_XML))
        part.add(xdf.clock_offset(_OWN_NUMBER, now, 0.0))

    def add(self, key: str, inlet: Inlet) -> Stream:
        """Record a stream from now on."""
        about = inlet.description
        watch = StreamWatch(about.sfreq, stall_s=self._stall_s)
        stream = Stream(key, len(self.streams) + _OWN_NUMBER + 1, about, inlet, watch)
        self.streams.append(stream)
        self._part.add(xdf.stream_header(stream.number, about.xml if self._keep_host else about.bare_xml))
        return stream

    def resume(self, stream: Stream, inlet: Inlet) -> None:
        """Go on with a stream that had ended, or comes from another inlet now; what it sent twice counts once."""
        self._take(stream, self._clock())
        if stream.inlet is not None:
            stream.inlet.close()
        stream.inlet, stream.gone, stream.overlap = inlet, False, stream.watch.last
        self.find(stream)

    def lose(self, stream: Stream, why: str) -> None:
        """Tell of a stream that is gone, once, unless it has ended on purpose."""
        if stream.lost is None and not stream.said_end:
            stream.lost = self._clock()
            self.mark(stream, Event("lost", stream.watch.last, why=why))

    def find(self, stream: Stream) -> None:
        """Tell that a stream is there again, where it was told to be lost."""
        if stream.lost is None:
            return
        seconds, stream.lost = self._clock() - stream.lost, None
        # Of one that is silent, the watch tells when its samples come.
        if not stream.watch.stalled:
            self.mark(stream, Event("back", stream.watch.last, seconds, why="it is there again"))

    def replace(self, stream: Stream, inlet: Inlet) -> None:
        """Go on with a stream that is another one now: the one in the file ends here, and a new one begins."""
        self._take(stream, self._clock())
        if stream.inlet is not None:
            stream.inlet.close()
        stream.inlet, stream.ended = None, True
        name = stream.key.partition("#")[0]
        runs = sum(one.key.partition("#")[0] == name for one in self.streams)
        self.add(f"{name}#{runs + 1}", inlet)

    def step(self) -> None:
        """Take what has come and write it.

        Raises:
            OSError: The file cannot be written.
        """
        now = self._clock()
        if now - self._stepped > _SLEPT_S:
            self.mark(self.own, Event("slept", self._stepped, now - self._stepped))
        self._stepped = now
        for stream in self.streams:
            self._take(stream, now)
        if now - self._bounded >= _BOUNDARY_S:
            self._part.add(xdf.boundary())
            self._bounded = now
        sync = now - self._synced >= _SYNC_S
        if sync:
            self._synced = now
        self._part.write(sync=sync)

    def close(self) -> None:
        """Take what has come, end each stream in the file, and close it.

        Raises:
            OSError: The rest cannot be written.
        """
        now = self._clock()
        try:
            for stream in self.streams:
                self._take(stream, now)
                if stream.inlet is not None:
                    stream.inlet.close()
                self._part.add(_footer(stream))
            self._part.add(_footer(self.own))
        finally:
            self._part.close()

    def mark(self, stream: Stream, event: Event) -> None:
        """Tell of an event, and mark it in the file at the time it happened, by the recorder's clock."""
        known = event.stamp == event.stamp
        when = event.stamp + (stream.offsets[-1][1] if stream.offsets else 0.0) if known else self._clock()
        text = f"{event.kind}/stream={stream.key}/samples={event.samples}/seconds={event.seconds:.6f}"
        self._part.add(xdf.samples(self.own.number, np.array([when]), [[text]], "string"))
        self.own.watch.feed(np.array([when]), when)
        self._tell(stream, event)

    def _take(self, stream: Stream, now: float) -> None:
        if stream.inlet is None:
            return
        for when, offset in stream.inlet.offsets():
            stream.offsets.append((when, offset))
            self._part.add(xdf.clock_offset(stream.number, when, offset))
        try:
            samples = stream.inlet.pull()
        except Lost as error:
            stream.inlet.close()
            stream.inlet = None
            self.lose(stream, str(error))
            return
        if garbled := stream.inlet.garbled():
            stream.garbled += garbled
            self.mark(stream, Event("garbled", stream.watch.last, samples=garbled))
        samples = _not_yet(samples, stream)
        for event in stream.watch.feed(samples.stamps, now):
            self.mark(stream, event)
        if len(samples):
            stream.last = samples
            stream.pulls += 1
            if stream.pulls % _EVERY_LAG == 1:
                lag = now - float(samples.stamps[-1]) - (stream.offsets[-1][1] if stream.offsets else 0.0)
                stream.lags.append(lag)
            about = stream.description
            self._part.add(xdf.samples(stream.number, samples.stamps, samples.values, about.channel_format))


def _not_yet(samples: Samples, stream: Stream) -> Samples:
    """Return what is new of a stream that is received from two inlets, one after the other, for a moment both."""
    if stream.overlap != stream.overlap or not len(samples):
        return samples
    # A clock that began anew is no overlap.
    new = (samples.stamps > stream.overlap) | (samples.stamps < stream.overlap - _OVERLAP_S)
    stream.overlap = float("nan")
    values = samples.values
    kept = values[new] if isinstance(values, np.ndarray) else [v for v, keep in zip(values, new, strict=True) if keep]
    return Samples(samples.stamps[new], kept)


def _footer(stream: Stream) -> bytes:
    watch = stream.watch
    first, last = (watch.first, watch.last) if watch.count else (0.0, 0.0)
    return xdf.stream_footer(stream.number, first, last, watch.count, stream.offsets)
