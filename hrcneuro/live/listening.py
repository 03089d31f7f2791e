"""The streams of a running session that a simulated person sees: its markers, and the truth."""

from __future__ import annotations

import contextlib

from hrcneuro.live.person import Person
from hrcneuro.live.text_stream import TextStream
from hrcneuro.live.transport import MOVES, TRUTH, Clock, Lost, Network

_LOOK_EVERY_S = 0.5


class Listening:
    """Brings what is said on them to the person."""

    def __init__(self, network: Network, clock: Clock, person: Person) -> None:
        """Listen to a network's streams; ``clock`` is the receiver's."""
        self._network, self._clock, self._person = network, clock, person
        # Truth first: a marker that came with it must find it.
        self._streams = {name: TextStream(network) for name in (TRUTH, MOVES)}
        self._looked = float("-inf")

    def step(self) -> None:
        """Take what was said."""
        now = self._clock()
        if now - self._looked > _LOOK_EVERY_S:
            self._looked = now
            self._find(now)
        for name, stream in self._streams.items():
            stream.connected(now)
            with contextlib.suppress(Lost):
                for stamp, text, when in stream.texts(now):
                    if name == TRUTH:
                        self._person.knows(text, when - stamp)
                    else:
                        self._person.hears(text, when)

    def _find(self, now: float) -> None:
        """Listen to the run of each stream that is there: a session that is begun anew is another run of it."""
        there = self._network.visible()
        for name, stream in self._streams.items():
            runs = [one for one in there if one.name == name]
            if runs and stream.uid not in {one.uid for one in runs}:
                stream.connect(runs[-1], now)
