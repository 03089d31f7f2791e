"""The turns of closed blocks: the robot draws from its policy, when keys open, who makes the next step.

It draws from the policy that the closed loop has published by then; who owns a step, which keys were pressed and who
was waited for are known here, and go to the log alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.person import evoked
from hrcneuro.experiment.turns import EARLY, Turn, Turns
from hrcneuro.paradigm import markers
from hrcneuro.paradigm.closed import HUMAN, ClosedBlock, ClosedEpisode
from hrcneuro.paradigm.episode import ROBOTS_TURN, Episode
from hrcneuro.paradigm.grid import STEPS
from hrcneuro.paradigm.params import TimingParams
from hrcneuro.paradigm.session import DrawnBlock


class Policies(Protocol):
    """What the closed loop says.

    Attributes:
        note: Is told what was taken up of it, and what was not.
        refused: Why a text was not taken up -> how often.
    """

    note: Callable[[str, Mapping[str, Any]], None]
    refused: Counter[str]

    @property
    def policy(self) -> Mapping[str, float] | None:
        """Direction -> probability that the robot leaves it to the person; None in ``shadow``, for the owners'."""

    @property
    def decided(self) -> str:
        """The text of the marker of the last move whose decision has come."""


class ClosedTurns(Turns):
    """The turns of a session of closed blocks."""

    episode: ClosedEpisode  # type: ignore[assignment]
    _block: ClosedBlock | None

    def __init__(
        self,
        subject: str,
        timing: TimingParams,
        *,
        policies: Policies,
        wait_s: float,
        **shape: Any,
    ) -> None:
        """Begin.

        Args:
            subject, timing: As :class:`~hrcneuro.experiment.turns.Turns` has them.
            policies: What the closed loop says; looked at whenever keys open.
            wait_s: So long the robot waits for the person where it has left them a step of its own, seconds.
            shape: The other arguments of :class:`~hrcneuro.experiment.turns.Turns`.
        """
        super().__init__(subject, timing, **shape)
        self._policies, self._left_s = policies, wait_s
        self._ready: tuple[str, float] | None = None  # a simulated person's key, and the time that it takes
        self._before = ""  # the marker of the episode's last move
        self._chosen: dict[str, Any] | None = None
        self._lying: Turn | None = None  # a step of the robot's own that it has left to the person

    def begin_block(self, block: DrawnBlock) -> None:
        """Take the block that is next."""
        assert isinstance(block, ClosedBlock)
        super().begin_block(block)

    def begin_episode(self, episode: Episode | ClosedEpisode, number: int) -> None:
        """Take the episode that is next; ``number`` counts from 1 within the block."""
        super().begin_episode(episode, number)  # type: ignore[arg-type]
        self._ready, self._before, self._chosen = None, "", None

    @property
    def next_actor(self) -> str:
        """Whose turn is next; empty after the last move, and before keys open: nobody knows."""
        if not self._decided and not self.episode.over and self.episode.chosen is None:
            return ""
        return super().next_actor

    def prepare(self, onset: float = math.nan) -> None:
        """Let a simulated person be ready for a step of their own, whether or not the robot will take it.

        Args:
            onset: When the motion before began, seconds; NaN where nothing moves.
        """
        episode = self.episode
        if self._decided or episode.over or self._ready is not None or self._person is None or episode.owner != HUMAN:
            return
        draw = self._the_block.draw
        self._ready = self._person.press(episode, keys=draw.keys), self._person.reaction_s(draw.timing)
        if self._truth:
            self._truths.append(self._truth_of_ready(*self._ready, onset))

    def open(self, now: float, wait_s: float) -> float | None:
        """Let the robot draw; return when the next move goes to the arm, seconds; None where a person's key is awaited.

        Args:
            now: When keys are accepted from.
            wait_s: The robot, and a simulated person, wait so long first.
        """
        if self._decided and self._decided[0] is self._lying and not self._lying.again:
            # A pause came before it was made: the person is waited for anew.
            return now + wait_s + self._left_s
        if self._decided or self.episode.over:
            return super().open(now, wait_s)
        again = self.episode.chosen is not None
        choice = self.episode.choose(self._acted_by(), self._the_closed_block.choices)
        if not again:
            in_time = self._policies.decided == self._before if self._before else None
            self._chosen = {
                "practice": False, "block": self.where["block"], "episode": self._number,
                "trial": len(self.episode.moves), "step": choice.step, "owner": choice.owner, "drawn": choice.drawn,
                "actor": choice.actor, "human": choice.human, "decided": self._policies.decided, "in_time": in_time,
            }  # fmt: skip
        if choice.actor == HUMAN and self._ready is None:
            self._open, self._opened_at = True, now
            return None
        ready, self._ready = self._ready, None
        if choice.actor == HUMAN and ready is not None:
            key, reaction_s = ready
            self._decide(key).reaction_s = reaction_s
            return now + wait_s + reaction_s
        turn = self._decide(choice.way)
        self._lying = turn if choice.left else None
        if self._truth:
            self._truths.append(self._truth_of(turn, math.nan))
        return now + wait_s + self._left_s if choice.left else now

    def chosen(self) -> dict[str, Any] | None:
        """Return what the robot chose as keys opened, for the log, once."""
        chosen, self._chosen = self._chosen, None
        return chosen

    def key(self, key: m.Key) -> str:
        """Take a person's key: return why it is ignored, or an empty text where it decides the move."""
        if self.released and not self.next_actor and not self.episode.over:
            return EARLY
        if self._decided and self.next_actor != HUMAN:
            # Also where the robot waits for the person at a step of its own.
            return ROBOTS_TURN
        return super().key(key)

    def _decide(self, intended: str) -> Turn:
        turn = super()._decide(intended)
        self._before = turn.go.marker
        return turn

    def _acted_by(self) -> Mapping[str, float]:
        policy = self._policies.policy
        if policy is not None:
            return policy
        return {step: float(step in self.episode.owners.human) for step in STEPS}

    def _truth_of_ready(self, key: str, reaction_s: float, onset: float) -> m.Truth:
        """Return what the person's move evokes, should the robot leave it to them."""
        where, episode = self.where, self.episode
        move, ahead = episode.after(key)
        text = markers.of_move(**where, trial=move.trial, actor=HUMAN, next=ahead, closed=True)
        expected = episode.whom(ahead) if ahead else ""
        about = evoked(episode, move, ahead, expected, scenario=where["scenario"], practice=False)
        return m.Truth({"marker": text, **about, **self._key_of(onset, reaction_s)})

    @property
    def _the_closed_block(self) -> ClosedBlock:
        assert self._block is not None
        return self._block
