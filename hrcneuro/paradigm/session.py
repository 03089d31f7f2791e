"""A whole session of one simulated subject (paper §2.4): practice, then main blocks, iC and sC in turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
import pandas as pd

from hrcneuro.paradigm.conditions import annotate
from hrcneuro.paradigm.design import MOVE
from hrcneuro.paradigm.episode import play
from hrcneuro.paradigm.owners import draw_areas, draw_directions
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


def protocol(params: SessionParams) -> Iterator[Block]:
    """Yield the blocks in their order: Test 1 (iC) and Test 2 (sC), then main blocks, odd ones iC, even ones sC."""
    if params.practice_episodes:
        yield Block(True, 1, "iC", params.practice_episodes)
        yield Block(True, 2, "sC", params.practice_episodes)
    for number in range(1, params.blocks + 1):
        yield Block(False, number, "iC" if number % 2 else "sC", params.episodes_per_block)


def simulate_session(
    params: SessionParams, *, rng: np.random.Generator, timing: TimingParams = TimingParams()
) -> pd.DataFrame:
    """Return one row a move of a simulated subject: the trial table without subject and onset_sample, with t_f_s.

    Owners are drawn anew for each block, paths for each episode.

    Args:
        params: Protocol and partners.
        rng: The subject's generator.
        timing: When moves begin.

    Raises:
        ValueError: An episode does not reach its goal, or the durations do not fit their range.
    """
    human = _human(params, rng)
    rows = []
    for block in protocol(params):
        owners = draw_directions(rng) if block.scenario == "iC" else draw_areas(rng)
        error_rate = params.practice_error_rate if block.practice else params.error_rate
        where = {"scenario": block.scenario, "practice": block.practice, "block": block.number}
        for episode in range(1, block.episodes + 1):
            moves = play(draw_path(rng), owners, human, error_rate=error_rate, rng=rng)
            rows += [where | {"episode": episode} | asdict(move) for move in moves]
    trials = pd.DataFrame(rows).assign(event=MOVE)
    trials["executed"] = trials["executed"].astype(object).where(trials["executed"].notna(), None)
    return annotate(assign_onsets(trials, rng=rng, params=timing))


def _human(params: SessionParams, rng: np.random.Generator) -> Human:
    habits = {"wrong_key": params.wrong_key_rate, "undo": params.undo_rate}
    return replace(draw_human(rng), **{name: rate for name, rate in habits.items() if rate is not None})
