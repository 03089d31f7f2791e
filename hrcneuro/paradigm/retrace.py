"""What a trial table tells between its lines: the marked paths, the owners of tiles and directions, the slips.

Nothing here knows how the table came about; logs and simulations are retraced alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.paradigm.conditions import EPISODE
from hrcneuro.paradigm.grid import OPPOSITE, STEPS, Tile, beyond, distance, inside, move, on_border, region, toward
from hrcneuro.paradigm.owners import TILES
from hrcneuro.paradigm.paths import count_turns, legs, splits

_CLOCKWISE = "".join(STEPS)


@dataclass(frozen=True)
class RetracedStudy:
    """The moves of all subjects with what was retraced, one row a move, an episode, a block."""

    moves: pd.DataFrame
    episodes: pd.DataFrame
    blocks: pd.DataFrame
    subjects: int


def retrace(tables: Mapping[str, pd.DataFrame]) -> RetracedStudy:
    """Return the study retraced from the trial tables of its subjects.

    ``moves`` gains before_row and before_col (the tile from which the move started), off_path (the target contradicts
    the path), jump (the tile does not follow from the executed direction), slip (where an error went: ``left``,
    ``opposite`` or ``right`` of the intended direction, None where a corner hides it) and owner (who owns the target's
    direction in iC: ``human``, ``robot``, ``split``, None where the block does not show it, and in sC).
    ``episodes`` has scenario, arrived and, of each path, its tiles (path), start, goal, distance, steps, turns, moves,
    border, revisits, first_axis (as ``paths.trace`` takes it) and splits (of the axes that are walked in two legs).
    ``blocks`` has scenario, conflicts (rows that contradict a block's owners) and, for sC, human_tiles, robot_tiles
    (the tiles seen) and torn (an area that cannot be in one piece); for iC the human's directions as a string, or None.
    """
    moves = pd.concat([table.assign(subject=name) for name, table in tables.items()], ignore_index=True)
    moves, episodes = _retrace_paths(moves)
    moves["slip"] = pd.Series(map(_slip, *_columns(moves, "intended", "executed", "error", "row", "col")), dtype=object)
    parts, blocks = [], []
    for (subject, practice, block), part in moves.groupby(["subject", "practice", "block"], sort=False):
        scenario = part["scenario"].iloc[0]
        owner, facts = _directions(part) if scenario == "iC" else _areas(part)
        parts.append(owner)
        blocks.append({"subject": subject, "practice": practice, "block": block, "scenario": scenario} | facts)
    moves["owner"] = pd.concat(parts)
    return RetracedStudy(moves, episodes, pd.DataFrame(blocks), len(tables))


def _columns(table: pd.DataFrame, *names: str) -> list[list]:
    return [table[name].tolist() for name in names]


def _retrace_paths(moves: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the moves with before_row, before_col, off_path and jump, and the episodes."""
    before: list[Tile] = []
    off_path: list[bool] = []
    jump: list[bool] = []
    episodes = []
    for key, part in moves.groupby(["subject", *EPISODE], sort=False):
        targets, executed, rows, cols = _columns(part, "target", "executed", "row", "col")
        path, off, starts = _follow(targets, executed, list(zip(rows, cols, strict=True)))
        before += starts
        off_path += off
        ends = zip(starts, executed, rows, cols, strict=True)
        jump += [(row, col) != (move(tile, step) if step in STEPS else tile) for tile, step, row, col in ends]
        facts = {
            "scenario": part["scenario"].iloc[0],
            "start": path[0],
            "goal": path[-1],
            "path": path,
            "distance": distance(path[0], path[-1]),
            "steps": len(path) - 1,
            "turns": count_turns(path),
            "first_axis": next((int(way in "EW") for way, _ in legs(path)), None),
            "splits": splits(path),
            "moves": len(part),
            "border": any(map(on_border, path)),
            "revisits": len(path) - len(set(path)),
            "arrived": (rows[-1], cols[-1]) == path[-1],
        }
        episodes.append(dict(zip(("subject", *EPISODE), key, strict=True)) | facts)
    order = np.concatenate([part.index for _, part in moves.groupby(["subject", *EPISODE], sort=False)])
    traced = pd.DataFrame(
        {
            "before_row": [tile[0] for tile in before],
            "before_col": [tile[1] for tile in before],
            "off_path": off_path,
            "jump": jump,
        },
        index=order,
    )
    return moves.join(traced), pd.DataFrame(episodes)


def _follow(targets: list[str], executed: list, ends: list[Tile]) -> tuple[tuple[Tile, ...], list[bool], list[Tile]]:
    """Return the path, whether each target contradicts it, and the tile on which each move began.

    Standing on a path tile, the next one is the neighbour in the target direction; from then on the target must point
    to that tile until it is reached.
    """
    first = executed[0]
    start = beyond(ends[0], OPPOSITE[first]) if first in STEPS else ends[0]
    path, pending, off = [start], start, []
    starts = [start, *ends[:-1]]
    for tile, target in zip(starts, targets, strict=True):
        if tile == pending:
            pending = beyond(tile, target) if target in STEPS else tile
            path.append(pending)
        off.append(toward(tile, pending) != target)
    return tuple(path), off, starts


def _slip(intended: str, executed: str | None, error: bool, row: int, col: int) -> str | None:
    """Return where an error went, seen from the intended direction; a clamped one must have pointed off the grid."""
    if not error:
        return None
    if executed in STEPS:
        ways = [executed]
    else:
        ways = [way for way in STEPS if way != intended and not inside(beyond((row, col), way))]
    if len(ways) != 1:
        return None
    quarter = (_CLOCKWISE.index(ways[0]) - _CLOCKWISE.index(intended)) % 4
    return (None, "right", "opposite", "left")[quarter]


def _directions(part: pd.DataFrame) -> tuple[pd.Series, dict]:
    """Return who owns each move's target, and the facts of a block of iC."""
    straight = part[part["target"].isin(list(STEPS))]
    seen = {who: set(straight["target"][straight["actor"] == who]) for who in ("human", "robot")}
    human = seen["human"] | (set(STEPS) - seen["robot"] if len(seen["robot"]) == 2 else set())
    robot = seen["robot"] | (set(STEPS) - seen["human"] if len(seen["human"]) == 2 else set())
    conflicts = int(straight["target"].isin(human & robot).sum()) + 2 * (max(len(human), len(robot)) > 2)
    known = {}
    for target in part["target"].unique():
        parts = {"human" if way in human else "robot" if way in robot else "" for way in target}
        known[target] = None if "" in parts else parts.pop() if len(parts) == 1 else "split"
    directions = "".join(way for way in STEPS if way in human) if len(human) == len(robot) == 2 else None
    facts = {"conflicts": conflicts, "directions": directions, "human_tiles": 0, "robot_tiles": 0, "torn": False}
    return part["target"].map(known).astype(object), facts


def _areas(part: pd.DataFrame) -> tuple[pd.Series, dict]:
    """Return None for each move, and the facts of a block of sC."""
    tiles = list(zip(part["before_row"], part["before_col"], strict=True))
    human = {tile for tile, who in zip(tiles, part["actor"], strict=True) if who == "human"}
    robot = {tile for tile, who in zip(tiles, part["actor"], strict=True) if who == "robot"}
    contested = human & robot
    facts = {
        "conflicts": sum(tile in contested for tile in tiles),
        "directions": None,
        "human_tiles": len(human),
        "robot_tiles": len(robot),
        "torn": not (_in_one_piece(human, robot) and _in_one_piece(robot, human)),
    }
    return pd.Series(None, index=part.index, dtype=object), facts


def _in_one_piece(mine: set[Tile], theirs: set[Tile]) -> bool:
    # A tile that nobody entered could belong to either side: an area is torn only if even they cannot join its parts.
    return not mine or mine <= region(min(mine), set(TILES) - theirs)
