"""A session's moves as its log has them, one row a move, and what is counted of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hrcneuro.paradigm.closed import HUMAN, ROBOT
from hrcneuro.paradigm.partners import Move
from hrcneuro.sources import authors_log, experiments

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Row(Move):
    """A move in its place: what the trial table has of it.

    Attributes:
        scenario, practice, block, episode: Where it belongs.
        onset_s: When it began, seconds of the session.
        t_f_s: How long it took, seconds.
    """

    scenario: str
    practice: bool
    block: int
    episode: int
    onset_s: float
    t_f_s: float

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Row:
        """Return the row in a line of ``experiment.jsonl``."""
        return cls(**{name: entry[name] for name in cls.__dataclass_fields__})


def is_taken(choice: Mapping[str, Any]) -> bool:
    """Return whether the robot takes a step that is the person's; ``choice``: what it chose as keys opened."""
    return choice["owner"] == HUMAN and choice["drawn"] == ROBOT


def is_left(choice: Mapping[str, Any]) -> bool:
    """Return whether the robot leaves a step of its own to the person first; ``choice`` as in :func:`is_taken`."""
    return choice["owner"] == ROBOT and choice["drawn"] == HUMAN


@dataclass
class Counters:
    """What was counted, over all parts of a session.

    Attributes:
        moves: Finished moves.
        errors: Of these, those that an error replaced.
        wrong_keys: Of these, those whose key was outside the target direction.
        keys: Keys that were accepted.
        ignored: Why keys were ignored -> how many.
        taken: Steps of the person's that the robot took, in closed blocks.
        left: Steps of the robot's own that it left to the person first.
    """

    moves: int = 0
    errors: int = 0
    wrong_keys: int = 0
    keys: int = 0
    ignored: dict[str, int] = field(default_factory=dict)
    taken: int = 0
    left: int = 0

    def take(self, entry: Mapping[str, Any]) -> None:
        """Count a line of ``experiment.jsonl``."""
        if entry["kind"] == experiments.MOVE:
            self.moves += 1
            self.errors += bool(entry["error"])
            self.wrong_keys += bool(entry["key_wrong"])
        elif entry["kind"] == experiments.CHOICE:
            self.taken += is_taken(entry)
            self.left += is_left(entry)
        elif entry["kind"] == experiments.KEY and entry["accepted"]:
            self.keys += 1
        elif entry["kind"] == experiments.KEY:
            self.ignored[entry["why"]] = self.ignored.get(entry["why"], 0) + 1


@dataclass
class Episode:
    """An episode that was begun: its path, and its moves so far.

    Attributes:
        practice, block, episode: Where it belongs.
        path: Tiles from start to goal.
        rows: Its moves.
    """

    practice: bool
    block: int
    episode: int
    path: Sequence[tuple[int, int]]
    rows: list[Row] = field(default_factory=list)
    _pending: int = 1

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Episode:
        """Return the episode in a line of ``experiment.jsonl``."""
        path = tuple((row, col) for row, col in entry["path"])
        return cls(entry["practice"], entry["block"], entry["episode"], path)

    @property
    def arrived(self) -> bool:
        """Whether it came to its goal."""
        return self._pending == len(self.path)

    def take(self, row: Row) -> None:
        """Add a move."""
        self.rows.append(row)
        self._pending += not self.arrived and (row.row, row.col) == tuple(self.path[self._pending])

    def line(self, origin: str) -> str:
        """Return its line in ``metadataNN.csv``."""
        return authors_log.metadata_line(self, self.path[0], self.path[-1], self.rows, origin=origin)


def trial_table(rows: Sequence[Row], subject: str) -> pd.DataFrame:
    """Return the moves as the trial table; onsets are seconds of the session, and no move has a sample."""
    import pandas as pd

    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.tables.trials import study_trials

    moves = pd.DataFrame(list(map(vars, rows)), columns=list(Row.__dataclass_fields__))
    return study_trials(annotate(moves), subject, sfreq=None)
