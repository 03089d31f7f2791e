"""A trial table as the authors' two CSV files, quirks included: ``logs.read_log`` gives the same table back."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from hrcneuro.paradigm.conditions import EPISODE
from hrcneuro.paradigm.grid import OPPOSITE, beyond, inside, move
from hrcneuro.sources import words


def write_log(trials: pd.DataFrame, path: Path) -> None:
    """Write ``subjectNN.csv``: one row a move, in the authors' columns and words."""
    _write(path, words.LOG, (_move(row) for row in trials.itertuples()))


def write_metadata(trials: pd.DataFrame, path: Path, *, origin: str = "") -> None:
    """Write ``metadataNN.csv``: one row an episode, with its start, its goal and how many moves went wrong.

    Simulated moves say so in a column of their own, ``origin``, which the authors' files do not have.
    """
    episodes = trials.groupby(list(EPISODE), sort=False, observed=True)
    columns = words.METADATA | ({"Origin": "origin"} if origin else {})
    _write(path, columns, ({**_episode(moves), "origin": origin} for _, moves in episodes))


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
        "block": _block(row),
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


def _episode(moves: pd.DataFrame) -> dict[str, Any]:
    first, last = moves.iloc[0], moves.iloc[-1]
    start = first["row"], first["col"]
    if isinstance(first["executed"], str):
        start = move(start, OPPOSITE[first["executed"]])
    human = moves["actor"] == "human"
    error = moves["error"].astype(bool)
    slips = moves["key_wrong"].astype(bool) & ~error
    counts = {
        "agent": (int((error & ~human).sum()), int((~human).sum())),
        "human": (int((error & human).sum() + slips.sum()), int(human.sum())),
    }
    counts["total"] = tuple(map(sum, zip(*counts.values(), strict=True)))  # type: ignore[assignment]
    line = {"block": _block(first), "episode": first["episode"], "goal_row": last["row"], "goal_col": last["col"]}
    line["start_row"], line["start_col"] = start
    for who, (wrong, of) in counts.items():
        line |= {f"{who}_errors": wrong, f"{who}_moves": of, f"{who}_correct": (of - wrong) / of * 100 if of else 0}
    return line


def _block(row: Any) -> str:
    return f"{'Test' if row.practice else 'BLOCK'} {row.block}"


def _word(known: Mapping[str, Any], ours: Any) -> str:
    return next(word for word, meaning in known.items() if meaning == ours)


def _write(path: Path, columns: Mapping[str, str], rows: Iterable[Mapping[str, Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        out.writerows([row[short] for short in columns.values()] for row in rows)
