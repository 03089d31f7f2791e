"""How long a run will still take, by what earlier runs have recorded of each task and what this one has seen so far."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping

from hrcneuro.contract import GROUP
from hrcneuro.pipeline.measured import Place


class Forecast:
    """Foresees the end of a run; who runs it says what has settled."""

    def __init__(self, places: Iterable[Place], known: Mapping[Place, float], *, workers: int) -> None:
        self._open = set(places)
        self._known = dict(known)
        self._workers = workers

    def settle(self, place: Place, seconds: float | None = None) -> None:
        """Take in that a task has settled; ``seconds`` where it ran now."""
        self._open.discard(place)
        if seconds is not None:
            self._known[place] = seconds

    def left(self, running: Mapping[Place, float]) -> float | None:
        """Return how many seconds are left; None while of some kind of task nothing is known: it would be a guess.

        Args:
            running: Task -> for how many seconds it has been running.
        """
        rest = []
        for place in self._open:
            expected = self._expected(place)
            if expected is None:
                return None
            rest.append(max(0.0, expected - running.get(place, 0.0)))
        # No run ends before its longest task does, however many workers there are.
        return max(sum(rest) / self._workers, max(rest)) if rest else None

    def _expected(self, place: Place) -> float | None:
        """Return how long a task will take: as last time, or as others of its kind did."""
        if place in self._known:
            return self._known[place]
        name, unit = place
        alike = [s for (other, one), s in self._known.items() if other == name and (one == GROUP) == (unit == GROUP)]
        return statistics.median(alike) if alike else None
