"""Whose turn it is within an episode, which keys count, and what becomes of a turn until the arm has done it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.person import SimulatedPerson, evoking
from hrcneuro.paradigm import markers
from hrcneuro.paradigm.episode import ROBOTS_TURN, Episode
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.params import TimingParams
from hrcneuro.paradigm.partners import Move
from hrcneuro.paradigm.session import DrawnBlock
from hrcneuro.paradigm.timing import IN_RADIUS, travel

EARLY, NOTHING_DUE = "too early", "no move is due"
"""Why a key is ignored: the tool is not within its radius yet (paper §2.3.1); the path is not shown."""


@dataclass
class Turn:
    """A move of the session, from its decision to its end.

    Attributes:
        move: What the rules made of the key or of the robot's plan.
        go: What the arm is asked for.
        where: Its ``subject``, ``scenario``, ``block``, ``episode`` and ``practice``.
        reaction_s: Of a simulated person, after keys are accepted.
        onset: When its motion began, seconds; NaN until it does.
        radius: When the tool came within its radius, seconds; NaN until it does.
        marked: The stamp of its marker on LSL's clock; NaN without one.
        again: It is made once more, since the arm was stopped in it.
        last: It ends the episode.
    """

    move: Move
    go: m.Go
    where: dict[str, Any]
    reaction_s: float = 0.0
    onset: float = math.nan
    radius: float = math.nan
    marked: float = math.nan
    again: bool = False
    last: bool = False


class Turns:
    """The turns of a session.

    Attributes:
        subject: Whose session it is.
        n_blocks: How many blocks are left of it at its start.
        simulated: The person is simulated.
        episode: The one under way.
        tile: Where the tool stands, or stood before it moved on.
    """

    episode: Episode

    def __init__(
        self,
        subject: str,
        timing: TimingParams,
        *,
        n_blocks: int,
        n_moves: int = 0,
        person: SimulatedPerson | None = None,
        truth: bool = False,
        code: int = 1,
    ) -> None:
        """Begin.

        Args:
            subject: Whose session it is.
            timing: How long motions take.
            n_blocks: How many blocks are left.
            n_moves: How many moves the session has had already.
            person: Who presses; none: a person at the window.
            truth: A simulated amplifier is told what the simulated person expects.
            code: On the trigger port at each onset.
        """
        self.subject, self.n_blocks, self.simulated = subject, n_blocks, person is not None
        self.tile: Tile = (0, 0)
        self._timing, self._person, self._truth, self._code = timing, person, truth, code
        self._count, self._number = n_moves, 0
        self._decided: deque[Turn] = deque()
        self._asked: deque[Turn] = deque()  # of the arm, and not ended; two while one is in its radius
        self._open, self._opened_at = False, math.nan
        self._block: DrawnBlock | None = None
        self._truths: list[m.Truth] = []

    def begin_block(self, block: DrawnBlock) -> None:
        """Take the block that is next."""
        self._block = block

    def begin_episode(self, episode: Episode, number: int) -> None:
        """Take the episode that is next; ``number`` counts from 1 within the block."""
        self.episode, self._number, self.tile = episode, number, episode.path[0]
        self._decided.clear()
        self._asked.clear()
        self._open = False

    @property
    def where(self) -> dict[str, Any]:
        """The episode under way: ``subject``, ``scenario``, ``block``, ``episode``, ``practice``."""
        block = self._the_block.block
        return {
            "subject": self.subject,
            "scenario": block.scenario,
            "block": block.number,
            "episode": self._number,
            "practice": block.practice,
        }

    @property
    def next_actor(self) -> str:
        """Whose turn is next, ``human`` or ``robot``; empty after the last move."""
        if self._decided:
            return self._decided[0].move.actor
        return "" if self.episode.over else self.episode.actor

    @property
    def released(self) -> bool:
        """Whether the arm has a move that it has not ended."""
        return bool(self._asked)

    @property
    def done(self) -> bool:
        """Whether nothing of the episode is left to be released."""
        return self.episode.over and not self._decided

    def stretch(self) -> float:
        """Return by what a pause is longer, 1 to 1.5, at random."""
        return float(self._the_block.draw.timing.uniform(1.0, 1.5))

    def prepare(self, onset: float = math.nan) -> None:
        """Decide the next move where that needs no person.

        Args:
            onset: When the motion before began, seconds; NaN where nothing moves.
        """
        if self._decided or self.episode.over:
            return
        if self.episode.actor == "robot":
            turn = self._decide(self.episode.plan())
        elif self._person is not None:
            draw = self._the_block.draw
            turn = self._decide(self._person.press(self.episode, keys=draw.keys))
            turn.reaction_s = self._person.reaction_s(draw.timing)
        else:
            return
        if self._truth:
            self._truths.append(self._truth_of(turn, onset))

    def truths(self) -> list[m.Truth]:
        """Return what a simulated person's amplifier is to be told, since the last call."""
        truths, self._truths = self._truths, []
        return truths

    def chosen(self) -> dict[str, Any] | None:
        """Return what the robot chose as keys opened, for the log, once; None in the study, where nothing is chosen."""
        return None

    def open(self, now: float, wait_s: float) -> float | None:
        """Open the turn: return when the next move goes to the arm, seconds; None where a person's key is awaited.

        Args:
            now: When keys are accepted from.
            wait_s: The robot, and a simulated person, wait so long first.
        """
        if not self._decided:
            self._open, self._opened_at = not self.episode.over, now
            return None
        turn = self._decided[0]
        robots = turn.move.actor == "robot" or turn.again
        return now if robots else now + wait_s + turn.reaction_s

    def close(self) -> None:
        """Accept no key until the turn is opened again."""
        self._open = False

    def key(self, key: m.Key) -> str:
        """Take a person's key: return why it is ignored, or an empty text where it decides the move."""
        if not self._open and not self.released:
            return NOTHING_DUE
        if self.next_actor != "human":
            return ROBOTS_TURN if self.next_actor else NOTHING_DUE
        # What opened the turn may have been heard before a key that went down earlier.
        if not self._open or self._decided or key.when < self._opened_at:
            return EARLY
        if refusal := self.episode.refusal(key.name):
            return refusal
        self._decide(key.name)
        return ""

    @property
    def pressed(self) -> str:
        """The key that a simulated person presses now."""
        return self._decided[0].move.intended

    def release(self, not_before: float = 0.0) -> m.Go:
        """Return what the arm is asked for, with the move that is next."""
        self._open = False
        turn = self._decided.popleft()
        turn.go = replace(turn.go, not_before=not_before)
        self._asked.append(turn)
        return turn.go

    def onset(self, report: m.Onset) -> Turn:
        """Take when the motion of a released move began."""
        turn = next(turn for turn in self._asked if turn.go.index == report.index)
        turn.onset, turn.marked = report.when, report.marked
        return turn

    def in_radius(self, report: m.InRadius) -> None:
        """Take when the tool came within the radius of a released move."""
        next(turn for turn in self._asked if turn.go.index == report.index).radius = report.when

    def executed(self, report: m.Executed) -> Turn:
        """Take the end of a move."""
        turn = self._asked.popleft()
        self.tile = turn.go.end
        return turn

    def take_back(self) -> Tile:
        """Put what the arm did not end at the front again; return the tile where the tool must stand for it."""
        for turn in reversed(self._asked):
            turn.again = True
            self._decided.appendleft(turn)
        self._asked.clear()
        return self._decided[0].go.start if self._decided else self.tile

    def _decide(self, intended: str) -> Turn:
        start = self.episode.tile
        move = self.episode.act(intended)
        t_f = float(travel(1, rng=self._the_block.draw.timing, params=self._timing)[0])
        ahead = "" if self.episode.over else self.episode.target
        text = markers.of_move(
            **self.where, trial=move.trial, actor=move.actor, next=ahead, closed=self._the_block.closed
        )
        go = m.Go(self._count, start, (move.row, move.col), t_f, text, self._code)
        self._count += 1
        turn = Turn(move, go, self.where, last=self.episode.over)
        self._decided.append(turn)
        return turn

    def _truth_of(self, turn: Turn, onset: float) -> m.Truth:
        where = turn.where
        about = evoking(self.episode, turn.move, scenario=where["scenario"], practice=where["practice"])
        if turn.move.actor == "human":
            about |= self._key_of(onset, turn.reaction_s)
        return m.Truth({"marker": turn.go.marker, **about})

    def _key_of(self, onset: float, reaction_s: float) -> dict[str, float]:
        """Return when the person's own motion will begin, ``key_s``; nothing where no motion is under way before it."""
        if not self._asked or math.isnan(onset):
            return {}
        t_f = self._asked[-1].go.t_f
        return {"key_s": onset + max(t_f, IN_RADIUS * t_f + reaction_s)}

    @property
    def _the_block(self) -> DrawnBlock:
        assert self._block is not None
        return self._block
