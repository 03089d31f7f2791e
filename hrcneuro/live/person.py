"""A simulated person at the amplifier: it sees the moves that a session's markers tell of, and does its own.

What it anticipates comes on :data:`~hrcneuro.live.transport.TRUTH`, a stream that nothing else of this product reads:
a text a move, JSON, with ``marker`` (the text of the move's marker) and what :mod:`hrcneuro.eeg.synthetic` asks of a
move. Of its own move it says so ahead, with ``key_s`` (seconds of the sender's clock, when the motion begins), since
the response of the hand's area begins before the motion.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from typing import Any, Protocol

from hrcneuro.eeg.synthetic.responses import COMPONENTS
from hrcneuro.live.amplifier import Amplifier
from hrcneuro.paradigm.markers import move_in

MOTOR = "motor"
_MOVE = "move/"
_KEPT = 64


class Brain(Protocol):
    """What moves evoke something in."""

    def evoke(self, onset: float, move: Mapping[str, Any], *, only: tuple[str, ...]) -> None:
        """Let a move evoke what it does; ``onset`` in samples."""


class Person:
    """Brings markers and truth to a brain, and markers to the trigger channel.

    Attributes:
        late: Markers that came when their sample had left; the trigger's edge is then up to that much late.
        unknown: Moves of which no truth had come: they evoke what any move does.
    """

    def __init__(self, amplifier: Amplifier, brain: Brain | None) -> None:
        """Begin; without a ``brain`` only the trigger channel answers."""
        self._amplifier, self._brain = amplifier, brain
        self._truth: deque[tuple[str, dict[str, Any]]] = deque(maxlen=_KEPT)
        self.late = self.unknown = 0

    def hears(self, text: str, stamp: float) -> None:
        """Take a marker, with its stamp, seconds of the amplifier's clock."""
        if not text.startswith(_MOVE):
            return
        wanted = self._amplifier.seen_at(stamp)
        self.late += self._amplifier.trigger(stamp) != wanted
        if self._brain is None:
            return
        move = next((move for marker, move in self._truth if marker == text), None)
        self.unknown += move is None
        announced = move is not None and "key_s" in move
        only = tuple(name for name in COMPONENTS if not (announced and name == MOTOR))
        self._brain.evoke(self._amplifier.sample_at(stamp), move or _of_marker(text), only=only)

    def knows(self, text: str, offset: float = 0.0) -> None:
        """Take what is said on the truth stream; ``offset`` brings its times onto the amplifier's clock, seconds."""
        try:
            move = json.loads(text)
            marker = str(move["marker"])
        except (ValueError, TypeError, KeyError):
            return
        self._truth.append((marker, move))
        if self._brain is not None and "key_s" in move:
            onset = self._amplifier.sample_at(float(move["key_s"]) + offset)
            self._brain.evoke(onset, move, only=(MOTOR,))


def _of_marker(text: str) -> dict[str, Any]:
    """Return what a marker alone tells of a move: in which scenario it is."""
    move = move_in(text)
    return {"scenario": move["scenario"]} if move else {}
