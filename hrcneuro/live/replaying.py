"""A recording as a network: its EEG and its markers come again, in chunks of any length, on a clock of its own."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.learning.online import OnlineLearner
from hrcneuro.live import decisions, online_streams, preflight
from hrcneuro.live.decisions import Known
from hrcneuro.live.online import Log, Online, Publish
from hrcneuro.live.parameters import Declared, OnlineOptions
from hrcneuro.live.part import number_of
from hrcneuro.live.transport import Description, Inlet, Samples, connect

_SET_S = 0.5  # by so much clocks do not drift from one measurement to the next: one was set


@dataclass
class Stream:
    """A stream of a recording.

    Attributes:
        description: What it said of itself.
        stamps: ndarray, shape (n_samples,), seconds of the sender's clock, as they came.
        values: ndarray, shape (n_samples, n_channels), or rows of texts.
        offsets: (from when on, what to add to its stamps), seconds of the recorder's clock: one for each setting of
            the clocks.
    """

    description: Description
    stamps: np.ndarray
    values: Any
    offsets: list[tuple[float, float]]


class RecordedInlet:
    """A stream that comes again, up to where the recording has been played."""

    def __init__(self, stream: Stream) -> None:
        """Begin before its first sample."""
        self.description, self._stream = stream.description, stream
        self._upto = self._pulled = self._measured = 0
        self._now = float("-inf")

    def play(self, upto: int, now: float) -> None:
        """Let samples come up to a number, at a time of the recorder's clock."""
        self._upto, self._now = upto, now

    def pull(self) -> Samples:
        """Return what has come since the last call."""
        part = slice(self._pulled, self._upto)
        self._pulled = self._upto
        return Samples(self._stream.stamps[part], self._stream.values[part])

    def offsets(self) -> list[tuple[float, float]]:
        """Return what was measured by now of the clocks' difference."""
        begun = float(self._stream.stamps[0]) + self._stream.offsets[0][1]
        known = [(max(when, begun), offset) for when, offset in self._stream.offsets if when <= self._now]
        new, self._measured = known[self._measured :], max(self._measured, len(known))
        return new

    def reconnected(self) -> bool:
        """Return False: what comes again is one run."""
        return False

    def garbled(self) -> int:
        """Return 0: what could not be read is not in the file."""
        return 0

    def close(self) -> None:
        """Nothing is open."""


class RecordedNetwork:
    """The two streams of a recording, and its clock."""

    def __init__(self, eeg: Stream, markers: Stream) -> None:
        """Begin before the first sample."""
        self._eeg, self._markers = eeg, markers
        self._inlets = {one.description.uid: RecordedInlet(one) for one in (eeg, markers)}
        self.now = float(eeg.stamps[0]) + eeg.offsets[0][1]

    def clock(self) -> float:
        """Return where the recording is, seconds of the recorder's clock."""
        return self.now

    def visible(self) -> list[Description]:
        """Return both streams."""
        return [self._eeg.description, self._markers.description]

    def open(self, description: Description) -> RecordedInlet:
        """Return one of them."""
        return self._inlets[description.uid]

    def opening(self, description: Description) -> Future[Inlet]:
        """Return the same, which takes no time here."""
        return connect(Future(), lambda: self.open(description))

    def play(self, chunk: int) -> Iterator[None]:
        """Let the EEG come in chunks of so many samples, and the markers with what was taken at their time."""
        eeg, marks = self._eeg, self._markers
        when = marks.stamps + _offset_at(marks)
        times = eeg.stamps + _offset_at(eeg)
        for start in range(0, len(times), chunk):
            stop = min(start + chunk, len(times))
            self.now = float(times[stop - 1])
            self._inlets[eeg.description.uid].play(stop, self.now)
            last = len(when) if stop == len(times) else int(np.searchsorted(when, self.now, side="right"))
            self._inlets[marks.description.uid].play(last, self.now)
            yield


def _offset_at(stream: Stream) -> np.ndarray:
    """Return what is to be added to each stamp of a stream, s."""
    if len(stream.offsets) == 1:
        return np.full(len(stream.stamps), stream.offsets[0][1])
    # Where a clock was set, the stamps step by as much as the difference does, the other way.
    steps = np.diff(stream.stamps, prepend=stream.stamps[:1])
    changes = [after[1] - before[1] for before, after in pairwise(stream.offsets)]
    out = np.full(len(stream.stamps), stream.offsets[0][1])
    at = 0
    for change, (_, offset) in zip(changes, stream.offsets[1:], strict=True):
        near = np.flatnonzero(np.abs(steps[at:] + change) < _SET_S)
        if len(near):
            at += int(near[0])
            out[at:] = offset
            at += 1
    return out


def read(folder: Path, options: OnlineOptions) -> list[tuple[Stream, Stream]]:
    """Return EEG and markers of each part of a recording.

    Raises:
        ConfigError: pyxdf is not installed.
        DataError: There is no part, it cannot be read, or lacks a stream.
    """
    try:
        import pyxdf
    except ImportError as error:
        raise ConfigError(
            "reading a recording needs pyxdf, which is not installed", cure="pip install 'hrcneuro[xdf]'"
        ) from error
    logging.getLogger("pyxdf").setLevel(logging.CRITICAL)
    paths = sorted((path for path in folder.glob("part*.xdf*") if number_of(path)), key=number_of)
    if not paths:
        raise DataError(f"{folder} holds no part1.xdf", cure="name the folder of a recording: recordings/SUBJECT/START")
    found = []
    for path in paths:
        try:
            streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
        except Exception as error:
            raise DataError(f"{path} cannot be read as XDF: {error}", cure="copy the recording again") from error
        read_ = [_stream(one, path) for one in streams if len(one["time_stamps"])]
        wanted = (Declared(name=options.eeg, type="EEG"), Declared(name=options.markers))
        eeg, marks = ([one for one in read_ if preflight.fits(want, one.description)] for want in wanted)
        for what, those in (("EEG", eeg), ("markers", marks)):
            if len(those) != 1:
                names = ", ".join(f"{one.description.name!r} ({one.description.type})" for one in read_)
                raise DataError(
                    f"{path}: {len(those)} streams may be the {what}; one is needed, of {names or 'none'}",
                    cure="name the streams that are meant: online.eeg, online.markers",
                )
        found.append((eeg[0], marks[0]))
    return found


def logs_beside(recording: Path, parts: Sequence[tuple[Stream, Stream]]) -> list[Path]:
    """Return the logs of the loops whose markers are in a recording, in their order.

    Of loops that ran at the same time it is the one with most of these markers: the others began elsewhere in the EEG.

    Args:
        recording: Its folder; the logs lie beside it.
        parts: From :func:`read`.
    """
    there = {
        (str(row[0]), float(stamp)) for _, marks in parts for stamp, row in zip(marks.stamps, marks.values, strict=True)
    }
    heard = {
        path: there & set(decisions.known(path).scores)
        for path in sorted(recording.absolute().parent.glob(f"*-online*/{decisions.FILE}"))
    }
    taken: list[Path] = []
    for path in sorted(heard, key=lambda path: len(heard[path]), reverse=True):
        if heard[path] and all(heard[path].isdisjoint(heard[other]) for other in taken):
            taken.append(path)
    return sorted(taken)


def _stream(one: dict[str, Any], path: Path) -> Stream:
    info = one["info"]

    def said(name: str) -> str:
        return str((info.get(name) or [""])[0] or "")

    labels, units, types = _channels(info)
    xml = "<info>" + "".join(f"<channel><type>{kind}</type></channel>" for kind in types) + "</info>"
    about = Description(
        said("name"), said("type"), said("channel_format"), float(said("nominal_srate") or 0),
        int(said("channel_count")), labels, units, said("source_id"), f"{path.name}#{info['stream_id']}", xml,
    )  # fmt: skip
    return Stream(about, np.asarray(one["time_stamps"], float), one["time_series"], _offsets(one))


def _channels(info: dict[str, Any]) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    try:
        channels = info["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        return (), (), ()
    label, unit, kind = (
        tuple(str((one.get(name) or [""])[0] or "") for one in channels) for name in ("label", "unit", "type")
    )
    return label, unit, kind


def _offsets(one: dict[str, Any]) -> list[tuple[float, float]]:
    """Return one difference of clocks for each setting of them: the median, from its first measurement on."""
    times, values = (np.asarray(one.get(name, ()), float) for name in ("clock_times", "clock_values"))
    if not len(times):
        return [(float("-inf"), 0.0)]
    edges = [0, *(np.flatnonzero(np.abs(np.diff(values)) > _SET_S) + 1).tolist(), len(values)]
    parts = [slice(a, b) for a, b in pairwise(edges)]
    return [(float(times[p.start]) if p.start else float("-inf"), float(np.median(values[p]))) for p in parts]


def replay(
    parts: Sequence[tuple[Stream, Stream]],
    decoder: FrozenDecoder,
    learner: OnlineLearner,
    options: OnlineOptions,
    *,
    subject: str,
    chunk: int,
    publish: Publish,
    log: Log,
    known: Known | None = None,
    rail_uv: float = 0.0,
) -> list[Online]:
    """Let the loop go over a recording; return its state after each part, the learner going on from part to part.

    Args:
        parts: From :func:`read`.
        decoder, learner, options: As live.
        subject: Whose moves count.
        chunk: Samples that come together.
        publish, log: Take what live goes out on a stream and into the log.
        known: What the live session's log tells; without it zeros are found anew, and nothing is late.
        rail_uv: As live.

    Raises:
        HardwareError: The decoder is for another stream.
    """
    loops: list[Online] = []
    for eeg, marks in parts:
        network = RecordedNetwork(eeg, marks)
        opened = online_streams.served(network.opening(eeg.description), eeg.description.name, decoder, options)
        opened.watch.learn(eeg.stamps[: 2 * round(decoder.sfreq)])
        opened.measure()
        loop = Online(
            network, network.clock, opened, decoder, learner, options, subject=subject, publish=publish, log=log,
            rail_uv=rail_uv, known=known if known is not None else Known(),
        )  # fmt: skip
        for _ in network.play(chunk):
            loop.step()
        loop.finish()
        loops.append(loop)
    return loops
