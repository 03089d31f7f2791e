"""What a decoder teaches in the study's own blocks, with errors, where each makes the own steps: from their log."""

from __future__ import annotations

import numpy as np
import pandas as pd

from hrcneuro.learning.learners import Kind
from hrcneuro.learning.loop import CASES, STEPS, LoopSessions
from hrcneuro.learning.loop_decoders import LoopDecoder
from hrcneuro.learning.online import HUMAN, ROBOT, SUBTASKS, OnlineLearner

_EPISODE = ["block", "episode"]


def learn_open(
    trials: pd.DataFrame, decoder: LoopDecoder, kind: Kind, *, tau: float, rng: np.random.Generator, repetitions: int
) -> LoopSessions:
    """Return what a learner knows after each episode of the blocks of iC; it begins anew in each, as owners do.

    Moves teach as in the closed loop: tr−1 is no error, and the next step leads straight on. ``steps`` of the result
    are zero.

    Args:
        trials: Moves of one subject, see :func:`hrcneuro.paradigm.conditions.annotate`.
        decoder: What is listened to.
        kind: Which learner.
        tau: Temperature of Eq 5.
        rng: Draws the answers.
        repetitions: How often each block is gone through.

    Returns:
        A session a repetition of a block: first all repetitions of the first block.
    """
    moves = trials[(trials["scenario"] == "iC") & ~trials["practice"].astype(bool)]
    parts = [
        _block(block, decoder, kind, tau, rng, int(moves["episode"].max()))
        for _, block in moves.groupby("block", sort=True)
        for _ in range(repetitions)
    ]
    return LoopSessions.joined(parts)


def owned(block: pd.DataFrame) -> frozenset[str]:
    """Return the human's directions of a block of iC: those of straight steps that the human made."""
    straight = block[block["target"].isin(SUBTASKS)]
    return frozenset(straight.loc[straight["actor"] == HUMAN, "target"])


def _block(
    block: pd.DataFrame, decoder: LoopDecoder, kind: Kind, tau: float, rng: np.random.Generator, episodes: int
) -> LoopSessions:
    learner = OnlineLearner(kind, tau=tau, rates=decoder.claimed)
    human = owned(block)
    following = block.groupby(_EPISODE, sort=False)["target"].shift(-1).fillna("")
    rows = block.assign(following=following)
    policies, updates = np.full((episodes, 4), np.nan), np.zeros(episodes, int)
    decisions = np.zeros((len(CASES), 2), int)
    for number, (_, moves) in enumerate(rows.groupby(_EPISODE, sort=True)):
        for move in moves.itertuples(index=False):
            if move.condition_before is None or move.following not in SUBTASKS:
                continue
            by_human, next_human = bool(move.actor == HUMAN), str(move.condition_before)[1] == "H"
            probability = decoder.says_takeover(
                by_human, by_human != next_human, bool(move.turn), bool(move.prev_error)
            )
            uniform = float(rng.random())
            said = uniform < probability
            odds = decoder.log_odds(by_human, probability, uniform)
            before = HUMAN if by_human else ROBOT
            learner.update(str(move.following), before=before, takeover=said, log_odds=odds)
            decisions[2 * by_human + next_human, int(said)] += 1
        policies[number], updates[number:] = list(learner.policy().values()), learner.updates
        learner.end_episode()
    owners = np.tile([one in human for one in SUBTASKS], (episodes, 1))
    steps = np.zeros((episodes, len(STEPS)), int)
    return LoopSessions(*(one[None] for one in (policies, owners, updates, steps, decisions)))
