"""A trial table as the authors' two CSV files, quirks included: ``logs.read_log`` gives the same table back."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.paradigm.conditions import EPISODE
from hrcneuro.paradigm.grid import OPPOSITE, Tile, beyond, inside, move
from hrcneuro.sources import words

if TYPE_CHECKING:
    import pandas as pd

_ORIGIN = {"Origin": "origin"}


def write_log(trials: pd.DataFrame, path: Path) -> None:
    """Write ``subjectNN.csv``: one row a move, in the authors' columns and words."""
    path.write_text(log_head() + "".join(map(log_line, trials.itertuples())), encoding="utf-8", newline="")


def write_metadata(trials: pd.DataFrame, path: Path, *, origin: str = "") -> None:
    """Write ``metadataNN.csv``: one row an episode, with its start, its goal and how many moves went wrong.

    Simulated moves say so in a column of their own, ``origin``, which the authors' files do not have.
    """
    episodes = trials.groupby(list(EPISODE), sort=False, observed=True)
    lines = (_whole_episode(list(moves.itertuples()), origin) for _, moves in episodes)
    path.write_text(metadata_head(origin=origin) + "".join(lines), encoding="utf-8", newline="")


def log_head() -> str:
    """Return the first line of ``subjectNN.csv``."""
    return _line(words.LOG)


def metadata_head(*, origin: str = "") -> str:
    """Return the first line of ``metadataNN.csv``; with a column for the origin where there is one to tell."""
    return _line(words.METADATA | (_ORIGIN if origin else {}))


def log_line(row: Any) -> str:
    """Return a move's line in ``subjectNN.csv``.

    Args:
        row: A row of the trial table, columns as attributes.
    """
    cells = _move(row)
    return _line(cells[short] for short in words.LOG.values())


def metadata_line(where: Any, start: Tile, goal: Tile, moves: Iterable[Any], *, origin: str = "") -> str:
    """Return an episode's line in ``metadataNN.csv``.

    Args:
        where: What has practice, block and episode as attributes.
        start, goal: Ends of its path.
        moves: Its moves so far, rows of the trial table.
        origin: What stands in the column of the origin; none: there is no such column.
    """
    cells = _episode(where, start, goal, list(moves))
    return _line([*(cells[short] for short in words.METADATA.values()), *([origin] if origin else [])])


def same_moves(trials: pd.DataFrame, again: pd.DataFrame) -> list[str]:
    """Return the columns of a log, as read again, that differ from the trial table; the log has no others."""
    columns = [str(name) for name in again if name in trials and name not in ("onset_s", "soa_s")]
    if len(trials) != len(again):
        return columns
    return [name for name in columns if not _plain(trials[name]).equals(_plain(again[name]))]


def _plain(column: pd.Series) -> pd.Series:
    values = column.astype(object)
    return values.where(values.notna(), None).reset_index(drop=True)


def _move(row: Any) -> dict[str, Any]:
    went = row.executed if isinstance(row.executed, str) else _clamped(row)
    return {
        "scenario": _word(words.SCENARIOS, row.scenario),
        "block": block_name(row.practice, row.block),
        "episode": row.episode,
        "trial": row.trial,
        "target": _word(words.TARGETS, row.target),
        "key": _word(words.KEYS, row.intended if row.actor == "human" else ""),
        "logged": _word(words.MOVES, words.mirrored(went, error=row.error, intended=row.intended)),
        "error": _word(words.ERRORS, row.error),
        "row": row.row,
        "col": row.col,
    }


def _clamped(row: Any) -> str:
    """Return a direction in which the grid's edge stops a move; in a corner, where there are two, the authors' log has
    one and our table does not know which."""
    if not row.error:
        return str(row.intended)
    return next(
        way for way in ("W", "E", "N", "S") if way != row.intended and not inside(beyond((row.row, row.col), way))
    )


def _whole_episode(moves: list[Any], origin: str) -> str:
    first, last = moves[0], moves[-1]
    start = first.row, first.col
    if isinstance(first.executed, str):
        start = move(start, OPPOSITE[first.executed])
    return metadata_line(first, start, (last.row, last.col), moves, origin=origin)


def _episode(where: Any, start: Tile, goal: Tile, moves: list[Any]) -> dict[str, Any]:
    human = [row for row in moves if row.actor == "human"]
    wrong = sum(bool(row.error) for row in moves)
    # A wrong key that an error replaced counts once.
    human_wrong = sum(bool(row.error) or bool(row.key_wrong) for row in human)
    agent_wrong = wrong - sum(bool(row.error) for row in human)
    counts = {"agent": (agent_wrong, len(moves) - len(human)), "human": (human_wrong, len(human))}
    counts["total"] = (agent_wrong + human_wrong, len(moves))
    line = {
        "block": block_name(where.practice, where.block),
        "episode": where.episode,
        "goal_row": goal[0],
        "goal_col": goal[1],
    }
    line["start_row"], line["start_col"] = start
    for who, (bad, of) in counts.items():
        line |= {f"{who}_errors": bad, f"{who}_moves": of, f"{who}_correct": (of - bad) / of * 100 if of else 0}
    return line


def block_name(practice: bool, number: int) -> str:
    """Return a block's name in the authors' words: ``Test 1``, ``BLOCK 12``."""
    return f"{'Test' if practice else 'BLOCK'} {number}"


def _word(known: Mapping[str, Any], ours: Any) -> str:
    return next(word for word, meaning in known.items() if meaning == ours)


def _line(cells: Iterable[Any]) -> str:
    out = io.StringIO(newline="")
    csv.writer(out, lineterminator="\n").writerow(cells)
    return out.getvalue()
