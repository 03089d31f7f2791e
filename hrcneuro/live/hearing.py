"""The markers of a session as the closed loop hears them: which stream, which of them count, and when they were."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from hrcneuro.live import online_streams
from hrcneuro.live.parameters import Declared
from hrcneuro.live.text_stream import TextStream
from hrcneuro.live.transport import Lost, Network
from hrcneuro.paradigm import markers

_AHEAD_S = 0.5  # clocks whose difference was measured do not differ by so much
_BEFORE_S = 10.0

Heard = tuple[Mapping[str, Any], str, float, float]
"""Tags of a block's or a move's marker, its text, its stamp, and the same on the receiver's clock, seconds."""


class Hearing:
    """The markers' stream.

    Attributes:
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
        self._stream = TextStream(network)
        self.ended = self._several = False
        self.strange: Counter[str] = Counter()

    @property
    def there(self) -> bool:
        """Whether the stream was found."""
        return bool(self._stream.uid)

    @property
    def offset(self) -> float:
        """What to add to its stamps, seconds of the receiver's clock; NaN as long as it was not measured."""
        return self._stream.offset

    def clock_was_set(self) -> bool:
        """Return whether its sender's clock has been set since the last call."""
        return self._stream.clock_was_set()

    def look(self, now: float) -> bool:
        """Find the stream, or its new run; return whether another one is heard from now on.

        Nobody waits for a connection: a later look takes it up.
        """
        self._say_of_several()
        found = online_streams.another(self._network, self._wanted, self._stream.uid)
        if found is not None:
            self._stream.connect(found, now)
        return self._stream.connected(now)

    def hear(self, now: float) -> Iterator[Heard]:
        """Yield the markers of blocks and moves that came and count; ``now``: seconds of the receiver's clock."""
        try:
            texts = self._stream.texts(now)
        except Lost as error:
            if not self.ended:
                self._tell(f"the markers have ended ({error}); they are looked for")
            return
        for stamp, text, when in texts:
            tags = markers.end_in(text) or markers.block_in(text) or markers.move_in(text)
            if tags is None:
                continue
            if why := self._not_ours(tags, when, now):
                self.strange[why] += 1
                self._strange(text, stamp, why)
                if self.strange[why] == 1:
                    self._tell(f"a marker is not heeded, it is {why}: {text}")
                continue
            self.ended = markers.is_end(text)
            if self.ended:
                continue
            yield tags, text, stamp, when

    def _say_of_several(self) -> None:
        """Tell, once, that more than one stream has the markers' name: while none is heard, none of them is."""
        number = 0 if self.there else len(online_streams.fitting(self._network, self._wanted))
        if number > 1 and not self._several:
            self._tell(f"{number} streams are named {self._wanted.name!r}, and none is heard: end all but one")
        self._several = number > 1

    def _not_ours(self, tags: Mapping[str, Any], when: float, now: float) -> str:
        if tags["subject"] != self._subject:
            return "of another subject"
        if not math.isfinite(when):
            return "without a time"
        if when > now + _AHEAD_S:
            return "of the future"
        # Of another session, or its clock is another one.
        return "of the past" if when < min(now, self._began) - _BEFORE_S else ""
