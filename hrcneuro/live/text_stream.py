"""A stream of texts as it is received: markers, the truth, decisions. Whoever asks it never waits for a connection."""

from __future__ import annotations

import contextlib
import math
from concurrent.futures import Future
from dataclasses import dataclass

from hrcneuro.live.transport import UNMEASURED_S, Description, Inlet, Lost, Network, Repeats, abandon

Text = tuple[float, str, float]
"""Its stamp, the text, and when that was on the receiver's clock (where it is not known, the stamp itself), seconds."""


_SET_S = 0.05
"""Two measurements of one clock, some seconds apart, never differ by so much: it was set meanwhile."""


@dataclass(frozen=True)
class _Opening:
    """A connection that comes about: to which run, since when (s), and what it brings."""

    uid: str
    since: float
    inlet: Future[Inlet]


class TextStream:
    """One run of a stream at a time; a sender that is begun anew is another run of it.

    Attributes:
        offset: What to add to its stamps, seconds of the receiver's clock; NaN as long as it was not measured.
    """

    def __init__(self, network: Network, *, timed: bool = True) -> None:
        """Receive nothing yet; ``timed``: texts wait for the first measurement of the clocks' difference."""
        self._network, self._timed = network, timed
        self._inlet: Inlet | None = None
        self._opening: _Opening | None = None
        self._since = float("-inf")
        self._rest: list[Text] = []
        self._repeats = Repeats()
        self._set = False
        self.offset = float("nan")

    @property
    def uid(self) -> str:
        """Of the run that is received; empty where none is."""
        return "" if self._inlet is None else self._inlet.description.uid

    @property
    def connecting(self) -> str:
        """Of the run that is being connected to; empty where none is."""
        return "" if self._opening is None else self._opening.uid

    def connecting_for(self, now: float) -> float:
        """Return how long a connection has been coming about, s; infinite where none is."""
        return math.inf if self._opening is None else now - self._opening.since

    def connect(self, to: Description, now: float) -> None:
        """Begin to connect to a run, and no more to another one."""
        if to.uid in (self.uid, self.connecting):
            return
        self.abandon()
        self._opening = _Opening(to.uid, now, self._network.opening(to))

    def connected(self, now: float) -> bool:
        """Return whether a connection has come about since the last call; its run is received from now on."""
        if self._opening is None or not self._opening.inlet.done():
            return False
        opening, self._opening = self._opening, None
        try:
            inlet = opening.inlet.result()
        except Lost:
            return False
        # What the run before had said by then counts, with the difference of its clock.
        with contextlib.suppress(Lost):
            self._rest += self._pulled(math.inf)
        self.leave()
        self._inlet, self._since, self.offset = inlet, now, float("nan")
        self._measure()
        return True

    def texts(self, now: float) -> list[Text]:
        """Return what has come, each text once, and nothing before the clocks were compared, for a while at least.

        Raises:
            Lost: The run has ended; it is received no more.
        """
        rest, self._rest = self._rest, []
        try:
            return rest + self._pulled(now)
        except Lost:
            self._rest = rest
            self.leave()
            raise

    def clock_was_set(self) -> bool:
        """Return whether the sender's clock has been set since the last call, by how the measurements differ."""
        was, self._set = self._set, False
        return was

    def abandon(self) -> None:
        """Connect no more to what is not received yet."""
        if self._opening is not None:
            abandon(self._opening.inlet)
            self._opening = None

    def close(self) -> None:
        """Receive no more."""
        self.abandon()
        self.leave()

    def leave(self) -> None:
        """Receive the present run no more."""
        if self._inlet is not None:
            self._inlet.close()
            self._inlet = None

    def _measure(self) -> None:
        if self._inlet is not None:
            for _, offset in self._inlet.offsets():
                self._set |= abs(offset - self.offset) > _SET_S
                self.offset = offset

    def _pulled(self, now: float) -> list[Text]:
        if self._inlet is None:
            return []
        self._measure()
        unmeasured = math.isnan(self.offset)
        if self._timed and unmeasured and now - self._since < UNMEASURED_S:
            return []
        samples, offset = self._inlet.pull(), 0.0 if unmeasured else self.offset
        said = ((float(stamp), str(row[0])) for stamp, row in zip(samples.stamps, samples.values, strict=True))
        return [(stamp, text, stamp + offset) for stamp, text in said if not self._repeats.again(stamp, text)]
