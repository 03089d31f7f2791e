"""One episode: from the first tile of the path to the last, move by move, with injected errors."""

from __future__ import annotations

import numpy as np

from hrcneuro.paradigm.grid import STEPS, Tile, displacement, move, toward
from hrcneuro.paradigm.owners import Owners, actor_of
from hrcneuro.paradigm.partners import Human, Move, robot_plan

MOST_MOVES = 5000
"""An episode that is longer will not end: the longest in the logs has 72 moves."""


class EndlessEpisodeError(ValueError):
    """So many moves go wrong that an episode does not reach its goal."""


def play(
    path: tuple[Tile, ...], owners: Owners, human: Human, *, error_rate: float, rng: np.random.Generator
) -> list[Move]:
    """Return the moves of an episode, the last of which ends on the path's last tile.

    The pending tile of the path advances only when the end-effector stands on it. A move, human's or robot's, is
    replaced by one of the three other directions with ``error_rate``, unless the move before it was replaced.

    Raises:
        EndlessEpisodeError: So many moves go wrong that the goal is out of reach.
    """
    moves: list[Move] = []
    tile, pending = path[0], 1
    while pending < len(path):
        target = toward(tile, path[pending])
        actor = actor_of(owners, tile, target)
        intended = human.press(owners, target, moves, rng=rng) if actor == "human" else robot_plan(owners, target)
        spared = bool(moves) and moves[-1].error
        error = not spared and bool(rng.random() < error_rate)
        there = move(tile, _other(intended, rng) if error else intended)
        wrong = actor == "human" and intended not in target
        executed = displacement(tile, there)
        moves.append(Move(len(moves), actor, intended, executed, target, error, *there, key_wrong=wrong))
        tile = there
        pending += tile == path[pending]
        if len(moves) == MOST_MOVES:
            raise EndlessEpisodeError(
                f"an episode did not reach its goal within {MOST_MOVES} moves: error rate {error_rate:g}, "
                f"wrong keys {human.wrong_key:g}"
            )
    return moves


def _other(direction: str, rng: np.random.Generator) -> str:
    return [other for other in STEPS if other != direction][rng.integers(3)]
