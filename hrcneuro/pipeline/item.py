"""What became of a task: the row that commands print, log and put into the report."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hrcneuro.errors import HrcError


class State(enum.StrEnum):
    """Where a task stands."""

    WAITING = "waiting"  # for what it stands on
    RUNNING = "running"
    WOULD_RUN = "would-run"  # it is stale, and nothing runs now
    HIT = "hit"
    RAN = "ran"
    FAILED = "failed"
    BLOCKED = "blocked"  # what it stands on failed

    @property
    def done(self) -> bool:
        """Whether the task's files are there and up to date."""
        return self in (State.HIT, State.RAN)

    @property
    def settled(self) -> bool:
        """Whether nothing more will happen to the task."""
        return self not in (State.WAITING, State.RUNNING)


class Word(enum.StrEnum):
    """What a person is told of a task: the same words of a plan, of a status and of what has run."""

    FRESH = "fresh"
    STALE = "stale"
    NEVER_RUN = "never run"
    FAILED = "failed"
    RAN = "ran"  # just now


_WORDS = {State.HIT: Word.FRESH, State.RAN: Word.RAN, State.FAILED: Word.FAILED}


@dataclass
class Item:
    """A task's row.

    Attributes:
        stage: The stage, or ``erp.figures`` for the pictures of the stage erp.
        unit: A subject, a part, or ``group``.
        draws: Whether it makes pictures.
        key: Of its entry in the cache; empty while it is not known.
        state: Where it stands.
        why: The causes of its being stale.
        before: Whether it has ever run, and results point at what it made then.
        seconds: How long it ran.
        pulled: Whether it came from the second cache just now.
        artifacts: File name -> path.
        summary: What the stage says of its result in a few numbers.
        error, trace: What it failed of, and where.
        lost: Why it had to be sent to a worker again, each time.
    """

    stage: str
    unit: str
    draws: bool = False
    key: str = ""
    state: State = State.WAITING
    why: list[str] = field(default_factory=list)
    before: bool = False
    seconds: float = 0.0
    pulled: bool = False
    artifacts: dict[str, str] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    error: HrcError | None = None
    trace: str = ""
    lost: tuple[str, ...] = ()

    @property
    def word(self) -> Word:
        """The task's state in a person's words: what waits for others is stale, or has never run."""
        return _WORDS.get(self.state, Word.STALE if self.before else Word.NEVER_RUN)

    def fail(self, error: HrcError) -> None:
        """Note what the task failed of."""
        self.state, self.error, self.why = State.FAILED, error, [error.problem]
