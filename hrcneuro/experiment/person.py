"""The simulated person at the keys: the habits of the logs, and reaction times on the session's clock."""

from __future__ import annotations

from typing import Any

import numpy as np

from hrcneuro.paradigm.episode import Episode
from hrcneuro.paradigm.params import TimingParams
from hrcneuro.paradigm.partners import Human, Move
from hrcneuro.paradigm.timing import reactions


class SimulatedPerson:
    """Decides as :func:`hrcneuro.paradigm.session.simulate_session` has it, from the same generator."""

    def __init__(self, human: Human, timing: TimingParams) -> None:
        """Take a subject's habits, and how quickly people react."""
        self._human, self._timing = human, timing

    def press(self, episode: Episode, *, keys: np.random.Generator) -> str:
        """Return the key pressed next, as a direction; to be asked once a turn."""
        return self._human.press(episode.owners, episode.target, episode.moves, rng=keys)

    def reaction_s(self, rng: np.random.Generator) -> float:
        """Return how long after keys are accepted the key falls, seconds."""
        return max(float(reactions(1, rng=rng, params=self._timing)[0]), 0.0)


def evoking(episode: Episode, move: Move, *, scenario: str, practice: bool) -> dict[str, Any]:
    """Return what a move that the episode has just been told evokes in a person who knows what comes, plain values.

    Whose turn it is next is known already, though neither has moved.
    """
    before = episode.moves[move.trial - 1] if move.trial else None
    pair = None
    if not (episode.over or move.error or practice):
        pair = move.actor[0].upper() + episode.actor[0].upper()
    return {
        "actor": move.actor,
        "error": move.error,
        "prev_error": before is not None and before.error,
        "condition_before": pair,
        "turn": not episode.over and episode.target != move.target,
        "scenario": scenario,
    }
