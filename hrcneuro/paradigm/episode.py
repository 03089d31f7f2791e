"""The rules of an episode, step by step: whose turn it is, which keys count, errors, and how far the path is done.

It knows no clock, no file and no window: a simulated subject plays it through (:func:`play`), and a person plays it on
the arm.
"""

from __future__ import annotations

import numpy as np

from hrcneuro.paradigm.grid import STEPS, Tile, displacement, move, toward
from hrcneuro.paradigm.owners import Owners, actor_of, allowed
from hrcneuro.paradigm.partners import Human, Move, robot_plan

MOST_MOVES = 5000
"""An episode that is longer will not end: the longest in the logs has 72 moves."""

ROBOTS_TURN, ROBOTS_KEY = "the robot's turn", "a direction of the robot's"
"""Why a key does not count."""


class EndlessEpisodeError(ValueError):
    """So many moves go wrong that an episode does not reach its goal."""


class Way:
    """The path of an episode under way: where the end-effector stands, and which tile is next.

    The pending tile of the path advances only when the end-effector stands on it.

    Attributes:
        path: Its tiles, start and goal included.
        owners: Who is responsible for what.
        moves: What was done so far.
        tile: Where the end-effector stands.
    """

    def __init__(self, path: tuple[Tile, ...], owners: Owners) -> None:
        """Begin on the first tile."""
        self.path, self.owners = path, owners
        self.moves: list[Move] = []
        self.tile = path[0]
        self._pending = 1

    @property
    def over(self) -> bool:
        """Whether the goal is reached."""
        return self._pending == len(self.path)

    @property
    def target(self) -> str:
        """The direction of the pending tile, of eight."""
        return toward(self.tile, self.path[self._pending])

    def _do(self, actor: str, intended: str, there: Tile, *, error: bool = False) -> Move:
        """Let a move be done that ends on a tile.

        Raises:
            EndlessEpisodeError: So many moves went wrong that the goal is out of reach.
        """
        done = self._as_move(actor, intended, there, error=error)
        self.moves.append(done)
        self.tile = there
        self._pending += there == self.path[self._pending]
        if len(self.moves) == MOST_MOVES:
            raise EndlessEpisodeError(f"an episode did not reach its goal within {MOST_MOVES} moves")
        return done

    def _as_move(self, actor: str, intended: str, there: Tile, *, error: bool = False) -> Move:
        """Return the move from where the end-effector stands to a tile, without doing it."""
        target = self.target
        wrong = actor == "human" and intended not in target
        executed = displacement(self.tile, there)
        return Move(len(self.moves), actor, intended, executed, target, error, *there, key_wrong=wrong)


class Episode(Way):
    """An episode of the study: who acts is decided by the owners, and moves may go wrong.

    A move, human's or robot's, is replaced by one of the three other directions with ``error_rate``, unless the move
    before it was replaced.
    """

    def __init__(self, path: tuple[Tile, ...], owners: Owners, *, error_rate: float, errors: np.random.Generator):
        """Begin on the first tile; ``errors`` draws twice for each move, so that what goes wrong depends on no key."""
        super().__init__(path, owners)
        self._error_rate, self._errors = error_rate, errors

    @property
    def actor(self) -> str:
        """Whose turn it is, ``human`` or ``robot``."""
        return actor_of(self.owners, self.tile, self.target)

    @property
    def expected(self) -> str:
        """Whom the person expects to act next: whose turn it is."""
        return self.actor

    def plan(self) -> str:
        """Return the direction that the robot intends, where it is its turn."""
        return robot_plan(self.owners, self.target)

    def refusal(self, key: str) -> str:
        """Return why a key (N, E, S, W) does not count now; an empty text where it does."""
        if self.actor != "human":
            return ROBOTS_TURN
        return "" if key in allowed(self.owners, "human") else ROBOTS_KEY

    def act(self, intended: str) -> Move:
        """Let the partner whose turn it is move in a direction; return what comes of it, which is done from now on.

        Raises:
            ValueError: The episode is over, or the partner may not command this direction.
            EndlessEpisodeError: So many moves went wrong that the goal is out of reach.
        """
        if self.over:
            raise ValueError("the episode is over")
        actor = self.actor
        if intended not in allowed(self.owners, actor):
            raise ValueError(f"{intended!r} is no direction that the {actor} commands here")
        goes_wrong, other = self._errors.random() < self._error_rate, int(self._errors.integers(3))
        error = bool(goes_wrong) and not (self.moves and self.moves[-1].error)
        there = move(self.tile, _others(intended)[other] if error else intended)
        try:
            return self._do(actor, intended, there, error=error)
        except EndlessEpisodeError as endless:
            raise EndlessEpisodeError(f"{endless}: error rate {self._error_rate:g}") from None


def play(episode: Episode, human: Human, *, keys: np.random.Generator) -> list[Move]:
    """Return the moves of an episode that a simulated human and the robot play to its end.

    Args:
        episode: At its beginning.
        human: Its habits.
        keys: Draws what the human presses.

    Raises:
        EndlessEpisodeError: So many moves go wrong that the goal is out of reach.
    """
    try:
        while not episode.over:
            if episode.actor == "human":
                episode.act(human.press(episode.owners, episode.target, episode.moves, rng=keys))
            else:
                episode.act(episode.plan())
    except EndlessEpisodeError as error:
        raise EndlessEpisodeError(f"{error}, wrong keys {human.wrong_key:g}") from None
    return episode.moves


def _others(direction: str) -> list[str]:
    return [other for other in STEPS if other != direction]
