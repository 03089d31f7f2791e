"""What the robot intended in a move of which the log tells only what came of it; it follows from who owns what."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from hrcneuro.paradigm.owners import DIRECTION_PAIRS, Areas, Directions, Owners, actor_of
from hrcneuro.paradigm.partners import robot_plan
from hrcneuro.sources import words

if TYPE_CHECKING:
    import pandas as pd


def robot_plans(
    log: pd.DataFrame, human: pd.Series, executed: list[str], known: Mapping[str, frozenset[str]]
) -> pd.Series:
    """Return what the robot intended: in an error the log tells only what came of it, but its rule is known.

    Args:
        log: The moves, in the trial table's words; ``logged`` is the direction as the log has it.
        human: Which moves are the human's.
        executed: Direction of each displacement, empty for none.
        known: Block of iC -> the human's two directions, where something else than the moves tells them.
    """
    plans = log["logged"].where(~log["error"].astype(bool), "")
    moves = log.assign(actor=human.map({True: "human", False: "robot"}), step=executed)
    everywhere = Areas(frozenset())
    for name, block in moves.groupby("block", sort=False):
        owners: Owners = everywhere
        if block["scenario"].iloc[0] == "iC":
            owners = _directions(block, known.get(str(name)))
        todo = block.index[~human[block.index] & (plans[block.index] == "")]
        plans[todo] = [robot_plan(owners, target) for target in log["target"][todo]]
    return plans


def _directions(block: pd.DataFrame, known: frozenset[str] | None) -> Directions:
    """Return the human's two directions in a block of iC: the first pair that every move agrees with.

    A whole block leaves no choice; in a few moves, some direction may not occur: a pair that is known is tried first.
    Where no pair fits, the log contradicts itself, and the straight targets on which the human acted stand for it.
    """
    rows = list(zip(*(block[c] for c in ("actor", "target", "error", "logged", "step")), strict=True))
    for pair in (*([known] if known in DIRECTION_PAIRS else []), *DIRECTION_PAIRS):
        if all(_agrees(Directions(pair), *row) for row in rows):
            return Directions(pair)
    straight = (block["target"].str.len() == 1) & (block["actor"] == "human")
    return Directions(frozenset(block["target"][straight]))


def _agrees(owners: Directions, actor: str, target: str, error: bool, logged: str, step: str) -> bool:
    """Return whether a move of iC can have happened under these owners."""
    if actor != actor_of(owners, (0, 0), target):
        return False
    if actor == "human":
        return True
    plan = robot_plan(owners, target)
    went = words.mirrored(logged, error=error, intended=plan)
    return error == (went != plan) and step in ("", went)
