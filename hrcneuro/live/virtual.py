"""Streams at virtual pace: who sends and who receives are in one process, and its clock moves when somebody waits."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from xml.etree import ElementTree

import numpy as np

from hrcneuro.live.transport import Description, Inlet, Lost, Samples, connect

_OFFSET_EVERY_S = 5.0
_runs = itertools.count(1)


class VirtualNetwork:
    """The streams, and a clock.

    Attributes:
        now: The time, seconds.
        recovers: Whether a stream with a source id is silent once its sender has ended, as LSL's is, until there is
            another run of it, from which it then comes; else whoever pulls is told.
        on_wait: Called with the time whenever it has moved on.
    """

    def __init__(self, *outlets: VirtualOutlet, now: float = 1000.0) -> None:
        """Begin with these streams."""
        self.outlets, self.now = list(outlets), now
        self.recovers = False
        self.on_wait: list[Callable[[float], object]] = []

    def clock(self) -> float:
        """Return the time, seconds."""
        return self.now

    def wait(self, seconds: float) -> None:
        """Let time pass, and everybody act who wants to."""
        self.now += seconds
        for act in list(self.on_wait):
            act(self.now)

    def visible(self) -> list[Description]:
        """Return the streams that are there."""
        return [one.description for one in self.outlets if one.there]

    def open(self, description: Description) -> VirtualInlet:
        """Return a stream that is received from now on."""
        return VirtualInlet(self, description.handle)

    def opening(self, description: Description) -> Future[Inlet]:
        """Return the same, which takes no time here."""
        return connect(Future(), lambda: self.open(description))


class VirtualOutlet:
    """A stream that is sent: what is pushed waits until it is pulled.

    Attributes:
        description: What it says of itself.
        there: It can be seen.
        offset: What to add to its stamps, seconds of the receiver's clock.
    """

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
        """Let it be there; the arguments are those of :class:`hrcneuro.live.lsl.LslOutlet`."""
        form = "float32" if sfreq else "string"
        about = {
            "name": name, "type": kind, "channel_count": len(labels), "channel_format": form, "source_id": source_id,
            "nominal_srate": sfreq, "version": "1.1",
        }  # fmt: skip
        xml = _xml(about, labels, types or [kind] * len(labels), units, remark)
        self.description = Description(
            name, kind, form, sfreq, len(labels), tuple(labels), tuple(units), source_id, f"virtual {next(_runs)}", xml,
            xml, self,
        )  # fmt: skip
        self.there, self.offset = True, 0.0
        self.inlets: list[VirtualInlet] = []

    def push(self, stamps: np.ndarray | Sequence[float], values: np.ndarray | Sequence[Sequence[str]]) -> None:
        """Send samples, each with its stamp, seconds of the sender's clock."""
        for inlet in self.inlets:
            inlet.waiting.append((np.asarray(stamps, float), values))

    def send(self, text: str, stamp: float) -> None:
        """Send a text with its stamp, seconds."""
        self.push([stamp], [[text]])

    def close(self) -> None:
        """Let it vanish."""
        self.there = False


class VirtualInlet:
    """A stream that is received."""

    def __init__(self, network: VirtualNetwork, outlet: VirtualOutlet) -> None:
        """Begin with what is sent from now on."""
        self.waiting: list[tuple[np.ndarray, np.ndarray | Sequence[Sequence[str]]]] = []
        self.description = outlet.description
        self._network, self._outlet = network, outlet
        self._measured = float("-inf")
        self._reconnected = False
        outlet.inlets.append(self)

    def pull(self) -> Samples:
        """Return what has come. Raises :class:`~hrcneuro.live.transport.Lost`."""
        if self._network.recovers:
            self._recover()
        waiting, self.waiting = self.waiting, []
        texts = self.description.channel_format == "string"
        if not waiting:
            if not self._outlet.there and not (self._network.recovers and self.description.source_id):
                raise Lost("its sender has ended")
            return Samples(np.zeros(0), () if texts else np.zeros((0, self.description.n_channels)))
        stamps = np.concatenate([stamps for stamps, _ in waiting])
        if texts:
            return Samples(stamps, [row for _, rows in waiting for row in rows])
        return Samples(stamps, np.concatenate([np.asarray(rows, np.float32) for _, rows in waiting]))

    def offsets(self) -> list[tuple[float, float]]:
        """Return a new measurement every five seconds."""
        if self._network.now - self._measured < _OFFSET_EVERY_S:
            return []
        self._measured = self._network.now
        return [(self._measured, self._outlet.offset)]

    def _recover(self) -> None:
        """Connect to another run of a stream that is gone, by what liblsl asks for: all but labels, units and rate."""
        if self._outlet.there or not self.description.source_id:
            return
        names = ("name", "type", "channel_format", "n_channels", "source_id")
        wanted = [getattr(self.description, name) for name in names]
        for one in self._network.outlets:
            if one.there and [getattr(one.description, name) for name in names] == wanted:
                self.close()
                self._outlet, self._reconnected = one, True
                one.inlets.append(self)
                return

    def reconnected(self) -> bool:
        """Return whether it comes from another run since the last call."""
        was, self._reconnected = self._reconnected, False
        return was

    def garbled(self) -> int:
        """Return 0: within one process, texts are texts."""
        return 0

    def close(self) -> None:
        """Receive no more."""
        if self in self._outlet.inlets:
            self._outlet.inlets.remove(self)


def _xml(
    about: dict[str, object], labels: Sequence[str], types: Sequence[str], units: Sequence[str], remark: str
) -> str:
    root = ElementTree.Element("info")
    for name, value in about.items():
        ElementTree.SubElement(root, name).text = str(value)
    desc = ElementTree.SubElement(root, "desc")
    channels = ElementTree.SubElement(desc, "channels")
    for at, label in enumerate(labels):
        channel = ElementTree.SubElement(channels, "channel")
        ElementTree.SubElement(channel, "label").text = label
        ElementTree.SubElement(channel, "unit").text = units[at] if units else ""
        ElementTree.SubElement(channel, "type").text = types[at]
    if remark:
        ElementTree.SubElement(desc, "remark").text = remark
    return '<?xml version="1.0"?>' + ElementTree.tostring(root, encoding="unicode")
