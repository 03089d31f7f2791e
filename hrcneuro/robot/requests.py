"""What an arm is asked for, one thing at a time, and what it answers; times are seconds from the session's start.

A source of requests is asked in every cycle at rest, and must not wait. A plan known ahead, :class:`Replay`, is one
such source; an experiment, in which a person decides what comes next, is another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, isfinite

from hrcneuro.paradigm.grid import CENTRE
from hrcneuro.robot.events import Approach, Finish
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove


@dataclass(frozen=True)
class Make:
    """Make a move, no earlier than ``not_before``."""

    index: int
    move: PlannedMove
    not_before: float = -inf


Request = Approach | Make | Finish

Source = Callable[[float, bool], Request | None]
"""Is asked for the next request with the time of the cycle to come and whether the arm still moves.

While it moves, within the radius of a move's goal, only a move takes over without rest, where it can; what else is
returned waits until the arm rests. None: nothing yet.
"""


@dataclass(frozen=True)
class Stays:
    """A move that the grid's edge stops has begun: the arm stays for its duration, and no onset is marked."""

    index: int
    when: float


class Replay:
    """Asks for the moves of a log at the log's pace."""

    def __init__(self, moves: Sequence[PlannedMove], pace: Pace) -> None:
        """Begin over the grid's centre.

        Args:
            moves: In order.
            pace: The rest before an episode, the longest gap, and whether moves flow into each other.
        """
        self._moves, self._pace = moves, pace
        self._next, self._tile, self._placed = 0, CENTRE, False
        self._due, self._begun, self._gap = -inf, -inf, -inf

    def __call__(self, now: float, moving: bool) -> Request | None:
        """Return what the log has next, once it is due."""
        if self._next == len(self._moves):
            return None if moving else Finish()
        move = self._moves[self._next]
        if moving:
            flows = self._pace.start_next == "in_radius" and not move.first and not move.dwells
            return self._make(move, now) if flows and now >= self._begun + self._gap - 1e-9 else None
        if move.first and not self._placed:
            if self._tile != move.start:
                self._tile = move.start
                return Approach(move.start)
            self._placed, self._due = True, now + self._pace.pause_s
        return self._make(move, now) if now >= self._due - 1e-9 else None

    def executed(self, began: float) -> None:
        """Count the gap to the next move from when the last one ``began``."""
        self._due = began + self._gap

    def _make(self, move: PlannedMove, now: float) -> Make:
        self._begun = now
        self._gap = min(move.gap, self._pace.longest_gap_s) if isfinite(move.gap) else -inf
        self._next, self._tile, self._placed = self._next + 1, move.end, False
        return Make(self._next - 1, move)
