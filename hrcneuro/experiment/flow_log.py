"""The flow's log on the disk; where the disk is full, the session pauses, and nothing is lost."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.errors import StageError
from hrcneuro.experiment.log import Log
from hrcneuro.experiment.turns import Turn
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.session import DrawnBlock


class FlowLog:
    """Writes down what the flow tells.

    Attributes:
        trouble: Is told why nothing can be written, and what to do.
    """

    def __init__(self, log: Log, *, each_move: bool) -> None:
        """Write into ``log``; the trial table appears anew with each move, else with each episode."""
        self._log, self._each_move = log, each_move
        self.trouble: Callable[[str, str], None] = lambda problem, cure: None

    def block(self, block: DrawnBlock, when: float) -> None:
        """A block begins."""
        self._try(lambda: self._log.block(block.block, block.owners, when))

    def episode(self, number: int, path: Sequence[Tile], when: float) -> None:
        """An episode begins."""
        self._try(lambda: self._log.episode(number, path, when))

    def onset(self, turn: Turn) -> None:
        """A motion has begun."""
        self._try(lambda: self._log.onset(turn.move.trial, turn.onset))

    def move(self, turn: Turn, when: float) -> None:
        """A move has ended."""
        more: dict[str, Any] = {} if math.isnan(turn.marked) else {"marker_stamp": round(turn.marked, 6)}
        more |= {"again": True} if turn.again else {}
        self._try(
            lambda: self._log.move(turn.move, onset=turn.onset, t_f=turn.go.t_f, radius=turn.radius, ended=when, **more)
        )
        if self._each_move or turn.last:
            self._try(self._log.flush_table)

    def key(self, direction: str, ignored: str, when: float) -> None:
        """A key went down."""
        self._try(lambda: self._log.key(direction, when, accepted=not ignored, why=ignored))

    def event(self, kind: str, when: float, **about: Any) -> None:
        """Something else happened."""
        if kind == "goes on":
            # What could not be written before is no news where it can be now.
            self._try(self._log.flush_table)
        if kind == "remark":
            self._try(lambda: self._log.note(about["text"], when))
        else:
            self._try(lambda: self._log.event(kind, when, **about))

    def _try(self, write: Callable[[], object]) -> None:
        try:
            write()
        except StageError as error:
            self.trouble(error.problem, error.cure)
