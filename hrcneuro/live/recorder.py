"""A recording as it goes: what comes of each stream goes into the file, and what stands out is told and marked.

The recorder is stepped from outside, some twenty times a second in real time; it reads no clock and finds no stream but
those it is handed, so that the same code records at virtual pace.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hrcneuro.live import xdf
from hrcneuro.live.part import Part
from hrcneuro.live.recorded_stream import Stream, apart, footer, not_yet
from hrcneuro.live.transport import RECORDER, Clock, Description, Inlet, Lost, Samples
from hrcneuro.live.watch import Event, StreamWatch

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
_EVERY_LAG, _OF_A_PULL = 5, 10  # so many samples of every fifth pull tell how late they are


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
        self._untold: list[tuple[Stream, Event]] = []
        part.add(xdf.stream_header(_OWN_NUMBER, _OWN_XML))
        part.add(xdf.clock_offset(_OWN_NUMBER, now, 0.0))

    def add(self, key: str, inlet: Inlet | None, about: Description) -> Stream:
        """Record a stream from now on, which says ``about`` of itself."""
        watch = StreamWatch(about.sfreq, stall_s=self._stall_s)
        stream = Stream(key, len(self.streams) + _OWN_NUMBER + 1, about, inlet, watch)
        self.streams.append(stream)
        self._part.add(xdf.stream_header(stream.number, about.xml if self._keep_host else about.bare_xml))
        return stream

    def resume(self, stream: Stream, inlet: Inlet) -> None:
        """Go on with a stream that had ended, or comes from another inlet now; what it sent twice counts once."""
        now = self._clock()
        self._take(stream, now)
        for samples in self._settled(stream):
            self._put(stream, samples, now)
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

    def replace(self, stream: Stream, inlet: Inlet | None, about: Description, why: str) -> Stream:
        """Go on with a stream that is another one now: the one in the file ends here, and a new one begins.

        What was held of the new one goes into the new one. Its inlet may be the old one's, or none where it is gone.
        """
        now = self._clock()
        self._take(stream, now)
        held = self._settled(stream)
        alike = (about.channel_format, about.n_channels) == (
            stream.description.channel_format, stream.description.n_channels
        )  # fmt: skip
        before, after = apart(held, stream.watch) if alike else (held, [])
        for samples in before:
            self._put(stream, samples, now)
        self.mark(stream, Event("changed", stream.watch.last, why=why))
        if stream.inlet is not None and stream.inlet is not inlet:
            stream.inlet.close()
        stream.inlet, stream.ended = None, True
        name = stream.key.partition("#")[0]
        runs = sum(one.key.partition("#")[0] == name for one in self.streams)
        new = self.add(f"{name}#{runs + 1}", inlet, about)
        for samples in after:
            self._put(new, samples, now)
        if new.watch.count:
            new.overlap = new.watch.last
        return new

    @staticmethod
    def _settled(stream: Stream) -> list[Samples]:
        held, stream.held, stream.unsure = stream.held, [], False
        return held

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
        try:
            self._part.write(sync=sync)
        finally:
            self._tell_all()
        written = self._clock()
        for stream in self.streams:
            stream.written(written, synced=sync)

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
                self._part.add(footer(stream))
            self._part.add(footer(self.own))
        finally:
            try:
                self._part.close()
            finally:
                self._tell_all()

    def mark(self, stream: Stream, event: Event) -> None:
        """Mark an event in the file at the time it happened, by the recorder's clock; it is told with the next step."""
        known = event.stamp == event.stamp
        when = event.stamp + (stream.offsets[-1][1] if stream.offsets else 0.0) if known else self._clock()
        text = f"{event.kind}/stream={stream.key}/samples={event.samples}/seconds={event.seconds:.6f}"
        self._part.add(xdf.samples(self.own.number, np.array([when]), [[text]], "string"))
        self.own.watch.feed(np.array([when]), when)
        self._untold.append((stream, event))

    def _tell_all(self) -> None:
        """Tell what stood out, once it is in the file: whoever is told may take his time, or be the last thing done."""
        untold, self._untold = self._untold, []
        for stream, event in untold:
            self._tell(stream, event)

    def _take(self, stream: Stream, now: float) -> None:
        if stream.inlet is None:
            return
        stream.unsure = stream.inlet.reconnected() or stream.unsure
        if not stream.unsure:
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
        # Asked again: it may have happened while samples were pulled.
        stream.unsure = stream.inlet.reconnected() or stream.unsure
        if not stream.unsure:
            self._put(stream, samples, now)
        elif len(samples):
            stream.held.append(samples)

    def _put(self, stream: Stream, samples: Samples, now: float) -> None:
        """Let samples go into the file, and what stands out of them."""
        samples = not_yet(samples, stream)
        if len(samples):
            stream.last = samples
            stream.pulls += 1
            about = stream.description
            self._part.add(xdf.samples(stream.number, samples.stamps, samples.values, about.channel_format))
            if stream.offsets:
                taken = samples.stamps + stream.offsets[-1][1]
                stream.unsynced = float(np.fmin(stream.unsynced, taken.min()))
                if stream.pulls % _EVERY_LAG == 1:
                    some = np.linspace(0, len(taken) - 1, min(len(taken), _OF_A_PULL)).round().astype(int)
                    stream.fresh += taken[some].tolist()
        for event in stream.watch.feed(samples.stamps, now):
            self.mark(stream, event)
