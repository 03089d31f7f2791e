"""A recording session: streams that were prepared are recorded until somebody ends it; what is gone is looked for."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np

from hrcneuro.live import journal, preflight
from hrcneuro.live.parameters import Declared, RecordOptions
from hrcneuro.live.part import Part
from hrcneuro.live.preparation import Opened
from hrcneuro.live.recorded_stream import Stream
from hrcneuro.live.recorder import Recorder, Tell
from hrcneuro.live.transport import Clock, Description, Inlet, Lost, Network
from hrcneuro.live.watch import Event

_LOOK_AGAIN_S = 0.5
_GONE_S = 2.5  # the network is looked at once a second
_HELD_S = 10.0  # so long what comes of another run waits for what that run says of itself
_ASKED_S = 5.0  # so long the end of a recording waits for it
_NOTE_EVERY_S = 10.0
_MOST_EVENTS = 1000  # in session.json; the file of the recording has all of them
_FEW, _QUIET_S = 10, 10.0  # so many of a stream are said within so many seconds; all of them are counted


class Session:
    """A recording that goes on until it is ended.

    Attributes:
        recorder: What it does with the streams.
        unwritten: Why ``session.json`` cannot be written; empty where it can.
    """

    def __init__(
        self,
        network: Network,
        clock: Clock,
        opened: Opened,
        options: RecordOptions,
        part: Part,
        notes: journal.Journal,
        *,
        tell: Tell,
        helper: Executor,
    ) -> None:
        """Begin to record streams that were prepared.

        Args:
            network, clock: Where streams are found again; seconds of the receiver's clock.
            opened: The streams.
            options: How they are recorded.
            part: The file.
            notes: Its ``session.json``, where the part is the last one.
            tell: Is told what stands out.
            helper: Opens streams again, so that the others do not wait for that.
        """
        self._network, self._clock, self._options, self._notes = network, clock, options, notes
        self._say, self._helper = tell, helper
        self._opening: dict[str, Future[Inlet]] = {}
        self._asked: dict[str, str] = {}  # uids of those that are being opened
        self._was: dict[str, Description] = {}  # the newest run of each stream
        self._noted = clock()
        self._recent: dict[str, deque[float]] = {}
        self._unsure: dict[str, float] = {}  # since when
        self._seen: dict[str, float] = {}
        self._looked = clock()
        self.unwritten = ""
        self.recorder = Recorder(part, clock, stall_s=options.stall_s, tell=self._tell, keep_host=options.host_name)
        for key, inlet in opened.inlets.items():
            stream = self.recorder.add(key, inlet, inlet.description)
            if key in opened.looks:
                stream.watch.learn(opened.looks[key].stamps)
        if opened.left_out:
            notes.part["left_out"] = opened.left_out
        # Whatever ends this process: which streams these are stands there.
        self._note()

    def step(self) -> None:
        """Record what has come, and look for streams that are gone.

        Raises:
            OSError: The disk takes no more.
        """
        self.recorder.step()
        now = self._clock()
        lost = any(one.unsure or (one.inlet is None and not one.ended) for one in self.recorder.streams)
        if lost or now - self._looked >= _LOOK_AGAIN_S:
            self._looked = now
            self._follow(now)
        for key in [key for key, opening in self._opening.items() if opening.done()]:
            opening = self._opening.pop(key)
            del self._asked[key]
            with contextlib.suppress(Lost):
                stream, inlet = self._stream(key), opening.result()
                if stream.ended:
                    inlet.close()
                else:
                    self._take_over(stream, inlet)
        if now - self._noted >= _NOTE_EVERY_S:
            self._note()

    def close(self) -> None:
        """End the recording and its files.

        Raises:
            OSError: The disk takes no more.
        """
        for key, opening in self._opening.items():
            if (stream := self._stream(key)).unsure:
                with contextlib.suppress(Lost, TimeoutError):
                    self._take_over(stream, opening.result(_ASKED_S))
            opening.cancel()
        for stream in self.recorder.streams:
            if stream.unsure:
                self._unknown(stream)
        now = self._clock()
        for stream in self.recorder.streams:
            stream.silent = stream.watch.silent(now)
        self.recorder.close()
        self._notes.part["state"] = journal.ENDED
        self._note()

    def _stream(self, key: str) -> Stream:
        return next(one for one in self.recorder.streams if one.key == key)

    def _tell(self, stream: Stream, event: Event) -> None:
        """Note an event, and say it, unless so many came within seconds that nobody could read them."""
        part, now = self._notes.part, self._clock()
        counts = part.setdefault("counts", {}).setdefault(stream.key, {})
        counts[event.kind] = counts.get(event.kind, 0) + 1
        if len(part["events"]) < _MOST_EVENTS:
            stamp = event.stamp if event.stamp == event.stamp else None
            part["events"].append({"stream": stream.key, "kind": event.kind, "stamp": stamp, "text": str(event)})
        recent = self._recent.setdefault(stream.key, deque(maxlen=_FEW))
        if len(recent) == _FEW and now - recent[0] < _QUIET_S:
            return
        recent.append(now)
        self._note()
        self._say(stream, event)

    def _note(self) -> None:
        """Write ``session.json``; that it cannot be written is no reason to end a recording."""
        self._noted = self._clock()
        self._notes.part["streams"] = {one.key: summary(one) for one in self.recorder.streams}
        try:
            self._notes.write()
            self.unwritten = ""
        except OSError as error:
            self.unwritten = f"{self._notes.path} cannot be written: {error.strerror or error}"

    def _follow(self, now: float) -> None:
        """Look which streams are still on the network, and begin to open anew those that are there as another run."""
        there = self._network.visible()
        uids = {one.uid for one in there}
        for stream in [one for one in self.recorder.streams if not one.ended]:
            uid = stream.inlet.description.uid if stream.inlet is not None else ""
            if uid in uids:
                self._seen[stream.key] = now
            # One look may miss a stream that is there.
            stream.gone = now - self._seen.setdefault(stream.key, now) >= _GONE_S or stream.inlet is None
            # One that liblsl has found again by itself comes, whatever is seen.
            if stream.gone and (stream.inlet is None or now - stream.watch.came >= _GONE_S):
                self.recorder.lose(stream, "it is seen no more")
            else:
                self.recorder.find(stream)
            if not stream.unsure:
                self._unsure.pop(stream.key, None)
            elif now - self._unsure.setdefault(stream.key, now) >= _HELD_S:
                self._unknown(stream)
                continue
            wanted = stream.gone or stream.watch.stalled or stream.unsure or self._has_another_run(stream, there)
            if stream.key in self._opening or not wanted:
                continue
            if (description := self._again(stream, there)) is not None:
                self._asked[stream.key] = description.uid
                self._opening[stream.key] = self._helper.submit(self._network.open, description)

    def _has_another_run(self, stream: Stream, there: Sequence[Description]) -> bool:
        """Return whether a stream is seen as another run of its own source, and no more as the one that is received."""
        was = self._newest(stream)
        runs = {one.uid for one in there if was.source_id and one.source_id == was.source_id and one.name == was.name}
        return bool(runs) and was.uid not in runs

    def _newest(self, stream: Stream) -> Description:
        return self._was.get(stream.key, stream.description)

    def _again(self, stream: Stream, there: Sequence[Description]) -> Description | None:
        """Return another run of a stream, or what may stand in its place; None where neither is there."""
        was = self._newest(stream)
        declared = self._options.streams.get(stream.key.partition("#")[0]) or Declared(name=was.name, type=was.type)
        others = [self._newest(one) for one in self.recorder.streams if one is not stream and not one.ended]
        taken = {one.uid for one in others} | {was.uid, *self._asked.values()}
        fit = [
            one for one in there
            if preflight.fits(declared, one) and preflight.recordable(one) and one.uid not in taken
        ]  # fmt: skip
        same = [one for one in fit if one.source_id and one.source_id == was.source_id]
        # While the stream itself is seen, another one is beside it, not in its place. And what has the source id of
        # another stream that is recorded is that one's next run.
        away = was.uid not in {one.uid for one in there}
        theirs = {one.source_id for one in others} - {""}
        return next((one for one in [*same, *fit] if one in same or (away and one.source_id not in theirs)), None)

    def _take_over(self, stream: Stream, inlet: Inlet) -> None:
        """Go on with a stream from another inlet; where it is another stream by now, it gets a header of its own."""
        was, now = self._newest(stream), inlet.description
        self._seen[stream.key] = self._clock()
        self._was[stream.key] = now
        if now.source_id != was.source_id:
            why = f"source id {_short(was.source_id)!r}, now {_short(now.source_id)!r}"
            self.recorder.mark(stream, Event("source", stream.watch.last, why=why))
        if other := _differs(stream.description, inlet.description):
            self._was[self.recorder.replace(stream, inlet, now, other).key] = now
        else:
            self.recorder.resume(stream, inlet)

    def _unknown(self, stream: Stream) -> None:
        """Let what comes of another run be a stream of its own, where that run was not to be asked what it is."""
        why = "another run of it, of which nothing more could be learned"
        self.recorder.replace(stream, stream.inlet, self._newest(stream), why)


def _differs(one: Description, other: Description) -> str:
    """Return in what two descriptions of a stream differ that decides what its numbers mean; empty for nothing."""
    names = ("channel_format", "sfreq", "n_channels", "labels", "units")
    pairs = [(name, getattr(one, name), getattr(other, name)) for name in names]
    return "; ".join(f"{name} {_short(a)}, now {_short(b)}" for name, a, b in pairs if a != b)


def _short(value: Any) -> str:
    # Of all channels the same unit is said once.
    text = ", ".join(map(str, value if len(set(value)) > 1 else value[:1])) if isinstance(value, tuple) else str(value)
    return text if len(text) <= 40 else f"{text[:39]}…"


def summary(stream: Stream) -> dict[str, Any]:
    """Return what came of a stream so far, for ``session.json``."""
    about, watch = stream.description, stream.watch
    return {
        "name": about.name,
        "type": about.type,
        "sfreq": about.sfreq,
        "channels": list(about.labels) or about.n_channels,
        "units": sorted(set(about.units)),
        "source_id": about.source_id,
        "number": stream.number,
        "gone": stream.gone and not stream.ended,
        "waited_s": round(watch.waited, 3),
        "silent_s": round(stream.silent, 3),
        "samples": watch.count,
        "missing": watch.missing,
        "garbled": stream.garbled,
        "first": watch.first if watch.count else None,
        "last": watch.last if watch.count else None,
        "clock_offset_s": stream.offsets[-1][1] if stream.offsets else None,
        "lag_ms": _lag_ms(stream),
        "disk_ms": 1e3 * stream.disk if stream.disk == stream.disk else None,
    }


def _lag_ms(stream: Stream) -> dict[str, float] | None:
    """Return how late samples were in the file, by their own stamps; nothing where that is not known."""
    if not stream.lags:
        return None
    lags = 1e3 * np.array(stream.lags)
    return {"median": float(np.median(lags)), "p99": float(np.percentile(lags, 99)), "worst": float(lags.max())}
