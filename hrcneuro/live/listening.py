"""The streams of a running session that a simulated person sees: its markers, and the truth."""

from __future__ import annotations

import contextlib
from concurrent.futures import Future

from hrcneuro.live.person import Person
from hrcneuro.live.transport import MOVES, TRUTH, UNMEASURED_S, Clock, Inlet, Lost, Network, Repeats

_LOOK_EVERY_S = 0.5


class Listening:
    """Brings what is said on them to the person."""

    def __init__(self, network: Network, clock: Clock, person: Person) -> None:
        """Listen to a network's streams; ``clock`` is the receiver's."""
        self._network, self._clock, self._person = network, clock, person
        self._inlets: dict[str, Inlet] = {}
        self._opening: dict[str, Future[Inlet]] = {}
        self._offset: dict[str, float] = {}
        self._since: dict[str, float] = {}
        self._repeats = {name: Repeats() for name in (TRUTH, MOVES)}
        self._looked = float("-inf")

    def step(self) -> None:
        """Take what was said."""
        now = self._clock()
        if now - self._looked > _LOOK_EVERY_S:
            self._looked = now
            self._find()
        # Truth first: a marker that came with it must find it.
        for name in (TRUTH, MOVES):
            if name in self._opening and self._opening[name].done():
                self._begin(name, self._opening.pop(name), now)
            if name in self._inlets:
                self._take(name, now)

    def _find(self) -> None:
        """Listen to the run of each stream that is there: a session that is begun anew is another run of it."""
        there = self._network.visible()
        for name in (TRUTH, MOVES):
            runs = [one for one in there if one.name == name]
            inlet = self._inlets.get(name)
            same = inlet is not None and inlet.description.uid in {one.uid for one in runs}
            if runs and not same and name not in self._opening:
                # Whoever steps sends samples, too: a connection is not waited for.
                self._opening[name] = self._network.opening(runs[-1])

    def _begin(self, name: str, opening: Future[Inlet], now: float) -> None:
        with contextlib.suppress(Lost):
            opened = opening.result()
            if name in self._inlets:
                self._take(name, now)
            if name in self._inlets:
                self._inlets[name].close()
            self._inlets[name], self._since[name] = opened, now
            self._offset.pop(name, None)

    def _take(self, name: str, now: float) -> None:
        inlet = self._inlets[name]
        try:
            for _, offset in inlet.offsets():
                self._offset[name] = offset
            if name not in self._offset and now - self._since[name] < UNMEASURED_S:
                return
            samples = inlet.pull()
        except Lost:
            self._inlets.pop(name).close()
            return
        offset = self._offset.get(name, 0.0)
        for stamp, row in zip(samples.stamps, samples.values, strict=True):
            said = float(stamp), str(row[0])
            if self._repeats[name].again(*said):
                continue
            if name == TRUTH:
                self._person.knows(said[1], offset)
            else:
                self._person.hears(said[1], said[0] + offset)
