"""What a decoder teaches in the study's own blocks, with errors, where each makes the own steps: from their log."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from hrcneuro.learning.learners import Kind
from hrcneuro.learning.loop import CASES, STEPS, LoopSessions
from hrcneuro.learning.loop_decoders import LoopDecoder
from hrcneuro.learning.online import HUMAN, SUBTASKS, OnlineLearner


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
    episodes = int(moves["episode"].max())
    parts = []
    for _, block in moves.groupby("block", sort=True):
        events, human = _events(block), owned(block)
        parts += [_learn(events, human, decoder, kind, tau, rng, episodes) for _ in range(repetitions)]
    return LoopSessions.joined(parts)


def owned(block: pd.DataFrame) -> frozenset[str]:
    """Return the human's directions of a block of iC: those of straight steps that the human made."""
    straight = block[block["target"].isin(SUBTASKS)]
    return frozenset(straight.loc[straight["actor"] == HUMAN, "target"])


class _Event(NamedTuple):
    """A move that teaches: the next step, whose the move and the step are, and what went before and lies ahead."""

    step: str
    by_human: bool
    human_next: bool
    turn: bool
    error: bool


def _events(block: pd.DataFrame) -> list[list[_Event]]:
    """Return the moves of a block that teach, by episode."""
    found = []
    for _, moves in block.groupby("episode", sort=True):
        following = moves["target"].shift(-1).fillna("")
        teaching = moves["condition_before"].notna() & following.isin(SUBTASKS)
        columns = (moves.loc[teaching, name] for name in ("condition_before", "turn", "prev_error"))
        found.append(
            [
                _Event(str(step), case[0] == "H", case[1] == "H", bool(turn), bool(error))
                for step, case, turn, error in zip(following[teaching], *columns, strict=True)
            ]
        )
    return found


def _learn(
    events: list[list[_Event]],
    human: frozenset[str],
    decoder: LoopDecoder,
    kind: Kind,
    tau: float,
    rng: np.random.Generator,
    episodes: int,
) -> LoopSessions:
    learner = OnlineLearner(kind, tau=tau, rates=decoder.claimed)
    policies, updates = np.full((episodes, len(SUBTASKS)), np.nan), np.zeros(episodes, int)
    decisions = np.zeros((len(CASES), 2), int)
    for number, taught in enumerate(events):
        for event in taught:
            said = decoder.teach(
                learner, kind, event.step, float(rng.random()), by_human=event.by_human,
                takeover=event.by_human != event.human_next, turn=event.turn, error=event.error,
            )  # fmt: skip
            decisions[2 * event.by_human + event.human_next, int(said)] += 1
        policies[number], updates[number:] = list(learner.policy().values()), learner.updates
        learner.end_episode()
    owners = np.tile([one in human for one in SUBTASKS], (episodes, 1))
    steps = np.zeros((episodes, len(STEPS)), int)
    return LoopSessions(*(one[None] for one in (policies, owners, updates, steps, decisions)))
