"""The streams of a running session that a simulated person sees: its markers, and the truth."""

from __future__ import annotations

import contextlib

from hrcneuro.live.markers import NAME as MARKERS
from hrcneuro.live.person import Person
from hrcneuro.live.transport import TRUTH, Clock, Inlet, Lost, Network

_LOOK_EVERY_S = 0.5


class Listening:
    """Brings what is said on them to the person."""

    def __init__(self, network: Network, clock: Clock, person: Person) -> None:
        """Listen to a network's streams; ``clock`` is the receiver's."""
        self._network, self._clock, self._person = network, clock, person
        self._inlets: dict[str, Inlet] = {}
        self._offset: dict[str, float] = {}
        self._looked = float("-inf")

    def step(self) -> None:
        """Take what was said."""
        now = self._clock()
        if now - self._looked > _LOOK_EVERY_S:
            self._looked = now
            self._find()
        # Truth first: a marker that came with it must find it.
        for name in (TRUTH, MARKERS):
            if name in self._inlets:
                self._take(name)

    def _find(self) -> None:
        for one in self._network.visible():
            if one.name in (TRUTH, MARKERS) and one.name not in self._inlets:
                with contextlib.suppress(Lost):
                    self._inlets[one.name] = self._network.open(one)

    def _take(self, name: str) -> None:
        inlet = self._inlets[name]
        try:
            samples = inlet.pull()
            for _, offset in inlet.offsets():
                self._offset[name] = offset
        except Lost:
            self._inlets.pop(name).close()
            return
        offset = self._offset.get(name, 0.0)
        for stamp, row in zip(samples.stamps, samples.values, strict=True):
            if name == TRUTH:
                self._person.knows(str(row[0]), offset)
            else:
                self._person.hears(str(row[0]), float(stamp) + offset)
