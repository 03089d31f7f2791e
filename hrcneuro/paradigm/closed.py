"""Closed blocks: before each step the robot draws from its policy whether to make it, or to leave it to the person.

They are blocks of iC without injected errors. The person holds two directions, which the robot does not know.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from hrcneuro.paradigm.episode import ROBOTS_KEY, ROBOTS_TURN, Way
from hrcneuro.paradigm.grid import Tile, move, toward
from hrcneuro.paradigm.owners import Directions, draw_directions
from hrcneuro.paradigm.params import ClosedParams
from hrcneuro.paradigm.partners import ROBOT_CHOICE, Human, Move
from hrcneuro.paradigm.paths import draw_path
from hrcneuro.paradigm.session import Block, DrawnBlock, Generators

HUMAN, ROBOT = "human", "robot"


@dataclass(frozen=True)
class Choice:
    """What was decided of a step when keys opened.

    Attributes:
        step: The direction of the pending tile, of eight.
        owner: Whose step it is by the person's choice; on a diagonal the robot's.
        drawn: ``human`` where the robot left it to the person, ``robot`` where not; empty on a diagonal.
        human: The policy's probability that it is left to the person; 0 on a diagonal.
        way: Where the robot goes, if it goes.
    """

    step: str
    owner: str
    drawn: str
    human: float
    way: str

    @property
    def actor(self) -> str:
        """Who will act: the person only where the robot left them a step of their own."""
        return HUMAN if self.drawn == HUMAN and self.owner == HUMAN else ROBOT

    @property
    def taken(self) -> bool:
        """Whether the robot takes a step that is the person's."""
        return self.drawn == ROBOT and self.owner == HUMAN

    @property
    def left(self) -> bool:
        """Whether the robot leaves a step lying that is its own; it makes it after a while."""
        return self.drawn == HUMAN and self.owner == ROBOT


class ClosedEpisode(Way):
    """An episode of a closed block.

    Attributes:
        chosen: What was decided of the step that is next; None before keys open.
        habits: What the person has come to expect; None where they expect that each does the own steps.
    """

    owners: Directions

    def __init__(self, path: tuple[Tile, ...], owners: Directions, *, habits: Habits | None = None) -> None:
        """Begin on the first tile."""
        super().__init__(path, owners)
        self.chosen: Choice | None = None
        self.habits = habits

    @property
    def owner(self) -> str:
        """Whose the pending step is by the person's choice; on a diagonal the robot's."""
        return self._owner(self.target)

    @property
    def expected(self) -> str:
        """Whom the person expects to act next."""
        return self.whom(self.target)

    def whom(self, target: str) -> str:
        """Return whom the person expects to make a step in a direction, of eight."""
        owner = self._owner(target)
        return owner if self.habits is None else self.habits.expected(target, owner)

    def _owner(self, target: str) -> str:
        return HUMAN if target in self.owners.human else ROBOT

    @property
    def actor(self) -> str:
        """Who acts next; before keys open nobody knows, and it is whom the person expects."""
        return self.chosen.actor if self.chosen is not None else self.expected

    def choose(self, policy: Mapping[str, float], rng: np.random.Generator) -> Choice:
        """Let the robot draw who makes the pending step: once a step; asked again, it answers the same.

        On a diagonal, to which only a wrong key leads, the robot takes the component that it is surer to be its own;
        where both are alike, the one that it has in the study's logs.

        Args:
            policy: Direction -> probability that the robot leaves it to the person.
            rng: Draws once.
        """
        if self.chosen is None:
            step, drawn, human, way = self.target, "", 0.0, self.target
            uniform = float(rng.random())
            if len(step) == 2:
                first, second = (policy[one] for one in step)
                way = ROBOT_CHOICE[step] if first == second else step[int(second < first)]
            else:
                human = policy[step]
                drawn = HUMAN if uniform < human else ROBOT
            self.chosen = Choice(step, self.owner, drawn, human, way)
        return self.chosen

    def refusal(self, key: str) -> str:
        """Return why a key (N, E, S, W) does not count now; an empty text where it does."""
        if self.actor != HUMAN:
            return ROBOTS_TURN
        return "" if key in self.owners.human else ROBOTS_KEY

    def after(self, intended: str) -> tuple[Move, str]:
        """Return the person's move with a key, and the target behind it (empty at the goal), without doing it."""
        there = move(self.tile, intended)
        pending = self._pending + (there == self.path[self._pending])
        target = "" if pending == len(self.path) else toward(there, self.path[pending])
        return self._as_move(HUMAN, intended, there), target

    def act(self, intended: str) -> Move:
        """Let whoever was chosen move in a direction; return what comes of it, which is done from now on.

        Raises:
            ValueError: The episode is over, nobody was chosen, or the direction is none of the actor's.
            EndlessEpisodeError: So many moves went wrong that the goal is out of reach.
        """
        if self.over or self.chosen is None:
            raise ValueError("the episode is over" if self.over else "nobody was chosen: keys are not open")
        chosen = self.chosen
        if intended not in (self.owners.human if chosen.actor == HUMAN else {chosen.way}):
            raise ValueError(f"{intended!r} is no direction that the {chosen.actor} commands here")
        if self.habits is not None and chosen.drawn:
            self.habits.saw(chosen.step, chosen.drawn, chosen.owner)
        done = self._do(chosen.actor, intended, move(self.tile, intended))
        self.chosen = None
        return done


class Habits:
    """What a person comes to expect of each direction, from what the robot does: it drifts toward the policy.

    Ehrlich & Cheng (2018, ref. 62 of the paper) saw their people adapt, too.
    """

    def __init__(self, rate: float = 0.1) -> None:
        """Expect what the own choice says; ``rate`` is the weight of the newest step."""
        self._rate = rate
        # Direction and owner, who may be drawn anew, -> how much speaks for the other one by now, 0 to 1.
        self._otherwise: dict[tuple[str, str], float] = {}

    def expected(self, step: str, owner: str) -> str:
        """Return whom the person expects to make a step: its owner, unless more speaks for the other by now."""
        if self._otherwise.get((step, owner), 0.0) <= 0.5:
            return owner
        return ROBOT if owner == HUMAN else HUMAN

    def saw(self, step: str, drawn: str, owner: str) -> None:
        """Take that the robot left a step to the person, or did not; ``owner``: whose it is."""
        before = self._otherwise.get((step, owner), 0.0)
        self._otherwise[step, owner] = before + self._rate * ((drawn != owner) - before)


@dataclass(frozen=True)
class ClosedBlock(DrawnBlock):
    """A closed block; ``choices`` draws from the policy."""

    choices: np.random.Generator
    habits: Habits | None = None

    @property
    def closed(self) -> bool:
        """Whether the robot draws who acts."""
        return True

    def episodes(self) -> Iterator[ClosedEpisode]:  # type: ignore[override]
        """Yield the episodes in order, each at its beginning; each must be over before the next is asked for."""
        assert isinstance(self.owners, Directions)
        for _ in range(self.block.episodes):
            yield ClosedEpisode(draw_path(self.draw.paths), self.owners, habits=self.habits)


def draw_closed(params: ClosedParams, *, rng: np.random.Generator) -> list[ClosedBlock]:
    """Return the blocks of a session of closed blocks; ``rng`` is fresh, and its seed decides all that is drawn."""
    sources = rng.spawn(params.blocks)
    habits = Habits() if params.adapts else None
    drawn: list[ClosedBlock] = []
    for number, source in enumerate(sources, start=1):
        *usual, choices = source.spawn(6)
        draw = Generators(*usual)
        owners = draw_directions(draw.owners) if params.reassign or not drawn else drawn[0].owners
        block = Block(practice=False, number=number, scenario="iC", episodes=params.episodes_per_block)
        drawn.append(ClosedBlock(block, owners, 0.0, draw, choices, habits))
    return drawn


def play_closed(
    episode: ClosedEpisode,
    human: Human,
    policy: Mapping[str, float],
    *,
    keys: np.random.Generator,
    choices: np.random.Generator,
) -> Iterator[tuple[Choice, Move]]:
    """Yield each step of an episode that a simulated human and the robot play to its end, as soon as it is made.

    ``policy`` is looked at anew for each step: whoever learns may change it between two.

    Raises:
        EndlessEpisodeError: So many keys go wrong that the goal is out of reach.
    """
    while not episode.over:
        # The key is drawn whether or not the robot takes the step: a person is ready for the own ones.
        key = human.press(episode.owners, episode.target, episode.moves, rng=keys) if episode.owner == HUMAN else ""
        chosen = episode.choose(policy, choices)
        yield chosen, episode.act(key if chosen.actor == HUMAN else chosen.way)
