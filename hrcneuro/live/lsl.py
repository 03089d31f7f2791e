"""Streams over the lab streaming layer (LSL), by mne-lsl."""

from __future__ import annotations

import contextlib
import threading
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from concurrent.futures import Future
from types import TracebackType
from typing import Any

import numpy as np

from hrcneuro.live.liblsl import library
from hrcneuro.live.transport import Description, Inlet, Lost, Samples, connect

_OPEN_S = 5.0
_LOOK_S = 1.0
_OFFSET_EVERY_S, _OFFSET_AGAIN_S = 5.0, 0.2
_AT_ONCE_S, _LEAVE_S = 1e-3, 0.5
_MOST_BYTES = 500_000  # of one pull; what is left is pulled at once
_MOST_TEXTS = 10_000
_WAITS_S = 30  # so long samples wait for a recorder that is held up
# Of a stream's own description: where it runs, which is nobody's business who is given the recording.
_WHERE = ("hostname", "v4address", "v4data_port", "v4service_port", "v6address", "v6data_port", "v6service_port")


def _without_place(xml: str) -> str:
    root = ET.fromstring(xml)
    for tag in _WHERE:
        for one in root.findall(tag):
            root.remove(one)
    return ET.tostring(root, encoding="unicode")


def described(info: Any) -> Description:
    """Return what a stream of mne-lsl says of itself."""
    names, units = (list(map(str, got or ())) for got in (info.get_channel_names(), info.get_channel_units()))
    xml = info.as_xml
    root = ET.fromstring(xml)
    return Description(
        name=info.name,
        type=info.stype,
        channel_format=root.findtext("channel_format") or "",
        sfreq=float(info.sfreq),
        n_channels=int(info.n_channels),
        labels=tuple(names),
        units=tuple(units),
        source_id=info.source_id,
        uid=info.uid,
        xml=xml,
        bare_xml=_without_place(xml),
        handle=info,
    )


class LslInlet:
    """A stream that is received."""

    def __init__(self, lsl: Any, description: Description) -> None:
        """Connect.

        Raises:
            Lost: It is seen, and no connection comes about, or its description cannot be read.
        """
        # liblsl itself finds a stream again by its source id, and what had come by then is not lost.
        try:
            recover = bool(description.source_id)
            self._inlet = lsl.StreamInlet(description.handle, max_buffered=_WAITS_S, recover=recover)
            self._inlet.open_stream(timeout=_OPEN_S)
            # Only now are labels and units there.
            self.description = described(self._inlet.get_sinfo(timeout=_OPEN_S))
        except (TimeoutError, RuntimeError) as error:
            raise Lost(
                f"it is seen, and no connection to it comes about within {_OPEN_S:g} s: does a firewall stand between?"
            ) from error
        except Exception as error:
            # What others send must not end a recording: a description with a control character is no XML.
            raise Lost(
                f"it is seen, and what it says of itself cannot be read ({type(error).__name__}: {error})"
            ) from error
        self._clock = lsl.local_clock
        self._measured: list[tuple[float, float]] = []
        self._garbled = 0
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._attend, name="clock offsets", daemon=True)
        self._thread.start()

    def pull(self) -> Samples:
        """Return all samples that have come and were not pulled yet; never waits."""
        try:
            return self._texts() if self.description.channel_format == "string" else self._numbers()
        except RuntimeError as error:
            raise Lost(str(error).rstrip(".")) from error

    def _numbers(self) -> Samples:
        pieces = []
        most = max(64, _MOST_BYTES // (8 * self.description.n_channels))
        while True:
            values, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=most)
            # Copies: mne-lsl fills the same memory with the next pull.
            pieces.append((np.array(stamps, float), np.array(values)))
            if len(stamps) < most:
                break
        return Samples(np.concatenate([one for one, _ in pieces]), np.concatenate([one for _, one in pieces]))

    def _texts(self) -> Samples:
        stamps, texts = [], []
        for _ in range(_MOST_TEXTS):
            # One by one: a text that cannot be read must not cost those that came with it.
            try:
                text, stamp = self._inlet.pull_sample(timeout=0.0)
            except UnicodeDecodeError:
                self._garbled += 1
                continue
            if stamp is None:
                break
            stamps.append(float(stamp))
            texts.append(list(text))
        return Samples(np.array(stamps, float), texts)

    def offsets(self) -> list[tuple[float, float]]:
        """Return the measurements since the last call."""
        taken, self._measured = self._measured, []
        return taken

    def reconnected(self) -> bool:
        """Return whether liblsl has connected it to another run of its stream since the last call."""
        # liblsl says so (lsl_was_clock_reset) once it has found the other run and before it asks it for samples, if the
        # clocks had been compared by then. It looks for the same name, type, format and number of channels, and for
        # nothing of what the description says beyond that.
        return bool(self._inlet.was_clock_reset)

    def garbled(self) -> int:
        """Return how many texts since the last call were not in UTF-8."""
        count, self._garbled = self._garbled, 0
        return count

    def close(self) -> None:
        """Receive no more; nobody waits for it: of a stream that is gone, liblsl takes seconds to let go."""
        self._closed.set()

    def leave(self, seconds: float) -> None:
        """Wait so long, at most, until liblsl has let go of what was closed."""
        if self._closed.is_set():
            self._thread.join(seconds)

    def _attend(self) -> None:
        self._measure()
        with contextlib.suppress(TimeoutError, RuntimeError):
            self._inlet.close_stream()
        # The last reference: liblsl's threads are waited for here.
        del self._inlet

    def _measure(self) -> None:
        wait = 0.0
        while not self._closed.wait(wait):
            # What was not answered is asked again soon: until the first answer, no time of the sender's is known.
            # liblsl measures by itself; who asks is not to wait for that, since nothing can be pulled meanwhile.
            wait = _OFFSET_AGAIN_S
            with contextlib.suppress(TimeoutError, RuntimeError):
                offset = float(self._inlet.time_correction(timeout=_AT_ONCE_S))
                self._measured.append((float(self._clock()), offset))
                wait = _OFFSET_EVERY_S


class LslOutlet:
    """A stream that is sent; samples carry the stamps that they are given."""

    def __init__(
        self,
        name: str,
        kind: str,
        labels: Sequence[str],
        *,
        sfreq: float,
        source_id: str,
        types: Sequence[str] = (),
        units: Sequence[str] = (),
        remark: str = "",
    ) -> None:
        """Let it be there.

        Args:
            name, kind: By which it is found.
            labels: Of its channels.
            sfreq: Nominal rate, Hz; 0 for texts at irregular times.
            source_id: By which it is found again after an interruption.
            types, units: Of its channels.
            remark: A sentence that goes with it into every recording.

        Raises:
            HardwareError: mne-lsl is absent.
        """
        lsl = library("streams go out through")
        about = lsl.StreamInfo(name, kind, len(labels), sfreq, "float32" if sfreq else "string", source_id)
        about.set_channel_names(list(labels))
        if types:
            about.set_channel_types(list(types))
        if units:
            about.set_channel_units(list(units))
        if remark:
            about.desc.append_child_value("remark", remark)
        self._outlet: Any = lsl.StreamOutlet(about)
        self.clock = lsl.local_clock

    def push(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Send samples, shape (n_samples, n_channels), each with its stamp, seconds."""
        self._outlet.push_chunk(np.ascontiguousarray(values, np.float32), timestamp=np.asarray(stamps, float))

    def send(self, text: str, stamp: float) -> None:
        """Send a text with its stamp, seconds."""
        self._outlet.push_sample([text], timestamp=stamp)

    def close(self) -> None:
        """Let it vanish."""
        self._outlet = None


class LslNetwork:
    """All LSL streams of this machine's network; a context manager that looks for streams as long as it is open."""

    def __init__(self) -> None:
        """Begin to look; after ``look_s`` seconds all streams that are there are visible.

        Raises:
            HardwareError: mne-lsl is absent.
        """
        self._lsl = library("streams come through")
        self.clock = self._lsl.local_clock
        self._seen: list[Description] = []
        self._inlets: list[LslInlet] = []
        self._looked = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._look, name="streams", daemon=True)
        self._thread.start()

    def __enter__(self) -> LslNetwork:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._closed.set()
        self._thread.join(2 * _LOOK_S)
        # What still runs in liblsl when the process ends may break it.
        for inlet in self._inlets:
            inlet.leave(_LEAVE_S)

    def visible(self) -> list[Description]:
        """Return the streams that were there a second ago."""
        self._looked.wait(2 * _LOOK_S)
        return self._seen

    def open(self, description: Description) -> LslInlet:
        """Return a stream that is received from now on. Raises :class:`Lost` where it does not answer."""
        inlet = LslInlet(self._lsl, description)
        self._inlets.append(inlet)
        return inlet

    def opening(self, description: Description) -> Future[Inlet]:
        """Return what :meth:`open` will: a thread of its own waits for the connection."""
        future: Future[Inlet] = Future()
        args = future, lambda: self.open(description)
        threading.Thread(target=connect, args=args, name="connecting", daemon=True).start()
        return future

    def _look(self) -> None:
        while not self._closed.is_set():
            with contextlib.suppress(RuntimeError):
                found = self._lsl.resolve_streams(timeout=_LOOK_S)
                self._seen = [one for info in found if (one := _readable(info)) is not None]
                self._looked.set()


def _readable(info: Any) -> Description | None:
    """Return what a stream says of itself; None for one whose description is no XML: nobody can record it."""
    try:
        return described(info)
    except (ET.ParseError, UnicodeError):
        return None
