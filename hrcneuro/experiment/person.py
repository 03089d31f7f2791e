"""The simulated person at the keys: the habits of the logs, and reaction times on the session's clock."""

from __future__ import annotations

from typing import Any

import numpy as np

from hrcneuro.paradigm.closed import ClosedEpisode
from hrcneuro.paradigm.episode import Episode, Way
from hrcneuro.paradigm.params import TimingParams
from hrcneuro.paradigm.partners import Human, Move
from hrcneuro.paradigm.timing import reactions


class SimulatedPerson:
    """Decides as :func:`hrcneuro.paradigm.session.simulate_session` has it, from the same generator."""

    def __init__(self, human: Human, timing: TimingParams) -> None:
        """Take a subject's habits, and how quickly people react."""
        self._human, self._timing = human, timing

    def press(self, episode: Episode | ClosedEpisode, *, keys: np.random.Generator) -> str:
        """Return the key pressed next, as a direction; to be asked once a turn."""
        return self._human.press(episode.owners, episode.target, episode.moves, rng=keys)

    def reaction_s(self, rng: np.random.Generator) -> float:
        """Return how long after keys are accepted the key falls, seconds."""
        return max(float(reactions(1, rng=rng, params=self._timing)[0]), 0.0)


def evoking(episode: Episode | ClosedEpisode, move: Move, *, scenario: str, practice: bool) -> dict[str, Any]:
    """Return what a move that the episode has just been told evokes in a person who knows what comes, plain values.

    Whose turn it is next is known already, though neither has moved.
    """
    ahead = "" if episode.over else episode.target
    return evoked(episode, move, ahead, "" if episode.over else episode.expected, scenario=scenario, practice=practice)


def evoked(episode: Way, move: Move, ahead: str, expected: str, *, scenario: str, practice: bool) -> dict[str, Any]:
    """Return the same of any move of an episode.

    Args:
        episode: With the moves before it.
        move: The move.
        ahead: The target behind it; empty at the goal.
        expected: Whom the person expects to act next; empty at the goal.
        scenario, practice: Where it belongs.
    """
    before = episode.moves[move.trial - 1] if move.trial else None
    pair = None
    if ahead and not (move.error or practice):
        pair = move.actor[0].upper() + expected[0].upper()
    return {
        "actor": move.actor,
        "error": move.error,
        "prev_error": before is not None and before.error,
        "condition_before": pair,
        "turn": bool(ahead) and ahead != move.target,
        "scenario": scenario,
    }
