"""A whole session of one subject (paper §2.4): practice, then main blocks, iC and sC in turn.

Each block draws from generators of its own: paths, owners, errors, a simulated human's keys, and timing. So the same
seed and the same keys give the same session, a session that is broken off goes on as it would have, and nobody's
reaction time changes what goes wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
import pandas as pd

from hrcneuro.paradigm.conditions import annotate
from hrcneuro.paradigm.design import MOVE
from hrcneuro.paradigm.episode import Episode, play
from hrcneuro.paradigm.owners import COLOURS, Owners, draw_areas, draw_directions
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.partners import Human, draw_human
from hrcneuro.paradigm.paths import draw_path
from hrcneuro.paradigm.timing import assign_onsets


@dataclass(frozen=True)
class Block:
    """A block of the protocol: practice 1..2, or main 1..12, in one scenario."""

    practice: bool
    number: int
    scenario: str
    episodes: int


@dataclass(frozen=True)
class Generators:
    """What draws in a block, each independent of the others."""

    paths: np.random.Generator
    owners: np.random.Generator
    errors: np.random.Generator
    keys: np.random.Generator  # of a simulated human
    timing: np.random.Generator


@dataclass(frozen=True)
class DrawnBlock:
    """A block with who is responsible for what, and with what its episodes draw from.

    Attributes:
        block: Which one.
        owners: Drawn anew for each block; the person's colour in sC is the other one in the next block of sC.
        error_rate: Probability that a move after no error goes wrong.
        draw: The generators.
    """

    block: Block
    owners: Owners
    error_rate: float
    draw: Generators

    @property
    def closed(self) -> bool:
        """Whether the robot draws from a policy who acts; in the study it never does."""
        return False

    def episodes(self) -> Iterator[Episode]:
        """Yield the episodes in order, each at its beginning; each must be over before the next is asked for."""
        for _ in range(self.block.episodes):
            path = draw_path(self.draw.paths)
            yield Episode(path, self.owners, error_rate=self.error_rate, errors=self.draw.errors)


def protocol(params: SessionParams) -> Iterator[Block]:
    """Yield the blocks in their order: Test 1 (iC) and Test 2 (sC), then main blocks, odd ones iC, even ones sC."""
    if params.practice_episodes:
        yield Block(True, 1, "iC", params.practice_episodes)
        yield Block(True, 2, "sC", params.practice_episodes)
    for number in range(1, params.blocks + 1):
        yield Block(False, number, "iC" if number % 2 else "sC", params.episodes_per_block)


def draw_session(params: SessionParams, *, rng: np.random.Generator) -> tuple[Human, list[DrawnBlock]]:
    """Return a simulated human's habits, and the blocks of a session.

    Args:
        params: Protocol and partners.
        rng: The subject's generator, fresh: the generators are spawned from its seed, and it draws nothing itself.
    """
    blocks = list(protocol(params))
    own, *theirs = rng.spawn(1 + len(blocks))
    human = draw_habits(params, own)
    first = int(own.integers(2))
    drawn, areas = [], 0
    for block, source in zip(blocks, theirs, strict=True):
        draw = Generators(*source.spawn(5))
        if block.scenario == "iC":
            owners: Owners = draw_directions(draw.owners)
        else:
            owners = replace(draw_areas(draw.owners), human_colour=COLOURS[(first + areas) % 2])
            areas += 1
        rate = params.practice_error_rate if block.practice else params.error_rate
        drawn.append(DrawnBlock(block, owners, rate, draw))
    return human, drawn


def simulate_session(
    params: SessionParams, *, rng: np.random.Generator, timing: TimingParams = TimingParams()
) -> pd.DataFrame:
    """Return one row a move of a simulated subject: the trial table without subject and onset_sample, with t_f_s.

    Owners are drawn anew for each block, paths for each episode.

    Args:
        params: Protocol and partners.
        rng: The subject's generator, fresh.
        timing: When moves begin.

    Raises:
        EndlessEpisodeError: An episode does not reach its goal.
        ValueError: The durations do not fit their range.
    """
    human, blocks = draw_session(params, rng=rng)
    rows = []
    for drawn in blocks:
        block = drawn.block
        where = {"scenario": block.scenario, "practice": block.practice, "block": block.number}
        for number, episode in enumerate(drawn.episodes(), start=1):
            moves = play(episode, human, keys=drawn.draw.keys)
            rows += [where | {"episode": number} | asdict(move) for move in moves]
    trials = pd.DataFrame(rows).assign(event=MOVE)
    trials["executed"] = trials["executed"].astype(object).where(trials["executed"].notna(), None)
    return annotate(assign_onsets(trials, rng=blocks[0].draw.timing, params=timing))


def draw_habits(params: SessionParams, rng: np.random.Generator) -> Human:
    """Return a simulated human's habits; ``rng`` is the first generator that the subject's spawns."""
    habits = {"wrong_key": params.wrong_key_rate, "undo": params.undo_rate}
    return replace(draw_human(rng), **{name: rate for name, rate in habits.items() if rate is not None})
