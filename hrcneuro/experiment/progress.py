"""How far a session has come, as its log tells: what a session that goes on must know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from hrcneuro.errors import ConfigError, DataError
from hrcneuro.experiment.rows import Counters, Episode, Row
from hrcneuro.paradigm.session import Block
from hrcneuro.sources import experiments

Place = tuple[bool, int]  # of a block: practice, and its number


@dataclass
class Progress:
    """How far a session has come.

    Attributes:
        finished: Blocks that came to their end, as (practice, number).
        broken: Blocks of which there are moves, and not all: they are not begun again.
        episodes: All episodes that were begun, in order, with their moves; of those without any only the last one.
        counters: What was counted.
        options: With what the session was begun; empty where it was not.
        parts: How often it was begun or resumed.
        began: Time of day of its begin, ISO 8601.
        last_s: The latest time of any line, seconds of the session.
        complete: It came to its end.
        notes: What was mended of the log, a sentence each.
    """

    finished: set[Place] = field(default_factory=set)
    broken: set[Place] = field(default_factory=set)
    episodes: list[Episode] = field(default_factory=list)
    counters: Counters = field(default_factory=Counters)
    options: dict[str, Any] = field(default_factory=dict)
    parts: int = 0
    began: str = ""
    last_s: float = 0.0
    complete: bool = False
    notes: list[str] = field(default_factory=list)
    _sizes: dict[Place, int] = field(default_factory=dict)

    @property
    def rows(self) -> list[Row]:
        """All finished moves, in order."""
        return [row for episode in self.episodes for row in episode.rows]

    def done(self, block: Block) -> bool:
        """Return whether a block has moves already, so that the session goes on behind it."""
        return (block.practice, block.number) in self.finished | self.broken

    def take(self, entry: Mapping[str, Any]) -> None:
        """Learn from a line of ``experiment.jsonl``."""
        kind = entry["kind"]
        self.last_s = max(self.last_s, entry["s"])
        self.counters.take(entry)
        if kind == experiments.SESSION:
            self.parts += 1
            self.options = self.options or entry["options"]
            self.began = self.began or entry["at"]
        elif kind == experiments.BLOCK:
            self._sizes[entry["practice"], entry["block"]] = entry["episodes"]
        elif kind == experiments.EPISODE:
            self.drop_empty()
            self.episodes.append(Episode.of(entry))
        elif kind == experiments.MOVE:
            self._take_move(Row.of(entry))
        elif kind == experiments.END:
            self.complete = self.complete or entry["complete"]

    def drop_empty(self) -> None:
        """Forget the last episode if it has no move: nobody has played it."""
        if self.episodes and not self.episodes[-1].rows:
            self.episodes.pop()

    def _take_move(self, row: Row) -> None:
        episode, block = self.episodes[-1], (row.practice, row.block)
        episode.take(row)
        if episode.arrived and row.episode == self._sizes[block]:
            self.broken.discard(block)
            self.finished.add(block)
        else:
            self.broken.add(block)

    def passed(self, now: datetime) -> float:
        """Return the session's time at a time of day; it never runs backwards, even where the clock was set back."""
        return max(self.last_s, (now - datetime.fromisoformat(self.began)).total_seconds())

    def refuse_other(self, options: Mapping[str, Any]) -> None:
        """Refuse to go on with other options than the session was begun with.

        Raises:
            ConfigError: They differ; all that do are named.
        """
        before, now = _flat(self.options), _flat(options)
        differ = [name for name in sorted(before | now) if before.get(name) != now.get(name)]
        if differ:
            listed = "; ".join(f"{n} is {now.get(n)!r}, and was {before.get(n)!r}" for n in differ)
            raise ConfigError(
                f"the session was begun with other options: {listed}",
                cure="set them as they were, or begin another session under another subject's name",
            )


def of_entries(entries: list[experiments.Entry]) -> Progress:
    """Return how far a session has come, by the lines of its ``experiment.jsonl``.

    Raises:
        DataError: A line lacks what a line of its kind has, or they are out of order.
    """
    progress = Progress()
    for number, entry in enumerate(entries, start=1):
        try:
            progress.take(entry)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise DataError(
                f"{experiments.FILE}, line {number} ({entry.get('kind')}) cannot be understood: "
                f"{type(error).__name__}: {error}",
                cure="restore the file from a copy",
            ) from error
    progress.drop_empty()
    return progress


def _flat(options: Mapping[str, Any], head: str = "") -> dict[str, Any]:
    """Return options of options under dotted names."""
    flat: dict[str, Any] = {}
    for name, value in options.items():
        flat |= _flat(value, f"{head}{name}.") if isinstance(value, Mapping) else {f"{head}{name}": value}
    return flat
