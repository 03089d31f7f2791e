"""Streams at virtual pace with what tests vary: clocks that differ, streams that cannot be reached or vanish."""

from concurrent.futures import Future
from dataclasses import replace

import numpy as np

from hrcneuro.live.transport import Lost
from hrcneuro.live.virtual import VirtualNetwork as Network
from hrcneuro.live.virtual import VirtualOutlet


class Sender(VirtualOutlet):
    """A stream: what is pushed lies there until an inlet pulls it."""

    def __init__(self, name="amp", kind="EEG", labels=("a", "b"), sfreq=100.0, unit="microvolts", source_id="one"):
        texts = kind == "Markers"
        super().__init__(
            name, kind, ("marker",) if texts else labels, sfreq=0.0 if texts else sfreq, source_id=source_id,
            units=("",) if texts else (unit,) * len(labels),
        )  # fmt: skip
        self.connects, self.compared_until = True, float("inf")
        # As LSL has it: the machine's name stands in the whole description only.
        xml = self.description.xml.replace("<desc>", "<hostname>lab</hostname><desc>")
        self.description = replace(self.description, xml=xml, handle=self)

    def end(self):
        self.close()


class VirtualNetwork(Network):
    """Senders, some of which are seen and cannot be reached."""

    def open(self, description):
        if not description.handle.connects:
            raise Lost("it is seen, and no connection to it comes about within 5 s")
        inlet = super().open(description)
        measure = inlet.offsets
        inlet.offsets = lambda: measure() if self.now <= description.handle.compared_until else []
        return inlet


class Amplifier:
    """Pushes regular samples at the pace of a network's clock: channel 0 counts, the others are noise."""

    def __init__(self, network, sender, *, rate=None, scale=10.0, ahead=0.0):
        self.network, self.sender, self.scale = network, sender, scale
        self.sfreq = rate or sender.description.sfreq
        self.began, self.sent, self.skip, self.ahead = network.now, 0, set(), ahead
        self.rng = np.random.default_rng(1)
        network.on_wait.append(self)

    def __call__(self, now):
        due = int((now - self.began) * self.sfreq) - self.sent
        if due < 1 or not self.sender.there:
            return
        numbers = np.arange(self.sent, self.sent + due)
        self.sent += due
        values = self.scale * self.rng.standard_normal((due, self.sender.description.n_channels))
        if self.scale:
            values[:, 0] = numbers
        keep = np.array([n not in self.skip for n in numbers])
        stamps = self.began + self.ahead + numbers / self.sfreq
        self.sender.push(stamps[keep], values[keep])


class SlowNetwork(Network):
    """A connection is received from at once, and stands only once :meth:`connect` is called: as LSL's do."""

    def __init__(self, *outlets):
        super().__init__(*outlets)
        self.connecting = []

    def opening(self, description):
        future = Future()
        self.connecting.append((future, self.open(description)))
        return future

    def connect(self):
        for future, inlet in self.connecting:
            future.set_result(inlet)
        self.connecting = []
