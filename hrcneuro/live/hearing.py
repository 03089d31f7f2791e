"""The markers of a session as the closed loop hears them: which stream, which of them count, and when they were."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any

from hrcneuro.live import online_streams
from hrcneuro.live.parameters import Declared
from hrcneuro.live.transport import UNMEASURED_S, Inlet, Lost, Network, Repeats
from hrcneuro.paradigm import markers

_AHEAD_S = 0.5  # clocks whose difference was measured do not differ by so much
_BEFORE_S = 10.0

Heard = tuple[Mapping[str, Any], str, float, float]
"""Tags of a block's or a move's marker, its text, its stamp, and the same on the receiver's clock, seconds."""


class Hearing:
    """The markers' stream.

    Attributes:
        offset: What to add to its stamps, seconds of the receiver's clock; NaN as long as it was not measured.
        ended: Whether a marker has told that none comes any more.
        strange: Why a marker was not heeded -> how many.
    """

    def __init__(
        self,
        network: Network,
        name: str,
        subject: str,
        began: float,
        *,
        strange: Callable[[str, float, str], None],
        tell: Callable[[str], None],
    ) -> None:
        """Listen from now on.

        Args:
            network: Where the stream is found, and found again.
            name: The stream's.
            subject: Whose markers count.
            began: This moment, seconds of the receiver's clock.
            strange: Is told text, stamp and why of each marker that is not heeded.
            tell: Is told what a person should know.
        """
        self._network, self._wanted, self._subject, self._began = network, Declared(name=name), subject, began
        self._strange, self._tell = strange, tell
        self._inlet: Inlet | None = None
        self._opening: Future[Inlet] | None = None
        self._since: float | None = None
        self._repeats = Repeats()
        self.offset, self.ended = float("nan"), False
        self.strange: Counter[str] = Counter()

    @property
    def there(self) -> bool:
        """Whether the stream was found."""
        return self._inlet is not None

    def look(self) -> bool:
        """Find the stream, or its new run; return whether another one is heard from now on.

        Nobody waits for a connection: a later look takes it up.
        """
        if self._opening is None:
            uid = "" if self._inlet is None else self._inlet.description.uid
            found = online_streams.another(self._network, self._wanted, uid)
            self._opening = None if found is None else self._network.opening(found)
        if self._opening is None or not self._opening.done():
            return False
        opening, self._opening = self._opening, None
        try:
            inlet = opening.result()
        except Lost:
            return False
        if self._inlet is not None:
            self._inlet.close()
        self._inlet, self.offset, self._since = inlet, float("nan"), None
        self._measure()
        return True

    def hear(self, now: float) -> Iterator[Heard]:
        """Yield the markers of blocks and moves that came and count; ``now``: seconds of the receiver's clock."""
        if self._inlet is None:
            return
        try:
            self._measure()
            self._since = now if self._since is None else self._since
            if math.isnan(self.offset) and now - self._since < UNMEASURED_S:
                return
            samples = self._inlet.pull()
        except Lost as error:
            self._inlet.close()
            self._inlet = None
            if not self.ended:
                self._tell(f"the markers have ended ({error}); they are looked for")
            return
        for stamp, row in zip(samples.stamps, samples.values, strict=True):
            text = str(row[0])
            if self._repeats.again(float(stamp), text):
                continue
            tags = markers.end_in(text) or markers.block_in(text) or markers.move_in(text)
            if tags is None:
                continue
            when = float(stamp) + (self.offset if self.offset == self.offset else 0.0)
            if why := self._not_ours(tags, when, now):
                self.strange[why] += 1
                self._strange(text, float(stamp), why)
                if self.strange[why] == 1:
                    self._tell(f"a marker is not heeded, it is {why}: {text}")
                continue
            self.ended = markers.is_end(text)
            if self.ended:
                continue
            yield tags, text, float(stamp), when

    def _measure(self) -> None:
        assert self._inlet is not None
        for _, offset in self._inlet.offsets():
            self.offset = offset

    def _not_ours(self, tags: Mapping[str, Any], when: float, now: float) -> str:
        if tags["subject"] != self._subject:
            return "of another subject"
        if not math.isfinite(when):
            return "of no time"
        if when > now + _AHEAD_S:
            return "of the future"
        # Of another session, or its clock is another one.
        return "of the past" if when < min(now, self._began) - _BEFORE_S else ""
