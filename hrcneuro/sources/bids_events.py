"""Which column of a BIDS data set's tables of events names them: one for all recordings that are joined.

No numeric library: every plan asks this, so that a table without a usable name or time is known before anything runs.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.bids_tables import NO_NUMBER, NO_WORD, cells_of

COLUMNS = ("trial_type", "value")
"""Columns that name events where no option says which, the first that is there."""
_REMEMBERED = 4096


@dataclass(frozen=True)
class Look:
    """What a plan needs to know of a table of events.

    Attributes:
        name: Of the file.
        columns: In their order.
        rows: How many.
        naming: Columns with a word in at least one row that has an onset.
    """

    name: str
    columns: tuple[str, ...]
    rows: int
    naming: frozenset[str]


def seconds(text: str, table: Path) -> float:
    """Return a time in s, NaN where a table says n/a.

    Raises:
        DataError: It is no number.
    """
    if text.lower() in NO_NUMBER:
        return float("nan")
    try:
        return float(text)
    except ValueError as error:
        raise DataError(f"{table.name}: {text!r} is no time in s", cure="correct onset and duration") from error


def naming_column(tables: Sequence[Path], wanted: str = "") -> str:
    """Return the column that names the events of all these tables, which are of one subject.

    Args:
        tables: A table for each recording.
        wanted: The column that the study names; empty: trial_type, else value.

    Raises:
        ConfigError: A table does not have the column, another column would name its events, or it takes different
            columns for different tables.
        DataError: A table is none, or no row of any has an onset and a name.
    """
    seen = [look(table) for table in dict.fromkeys(tables)]
    filled = [one for one in seen if one.rows]
    columns = [_column(one, wanted) for one in filled]
    if differing := next((i for i, column in enumerate(columns) if column != columns[0]), 0):
        # trial_type comes first wherever it is there, so a table named by value does not have it.
        _refuse_two(filled[0], columns[0], filled[differing], columns[differing], filled)
    column = columns[0] if columns else wanted or COLUMNS[0]
    silent = [one for one in filled if column not in one.naming]
    # Who names a column may have recordings that have no words in it.
    for one in silent if not wanted or len(silent) == len(filled) else ():
        for other in (name for name in COLUMNS if name in one.naming):
            raise ConfigError(
                f"{one.name}: {column} names none of its {one.rows} rows, and {other} does",
                cure=_take(other, filled),
            )
    if len(silent) == len(filled):
        names = ", ".join(one.name for one in seen)
        raise DataError(
            f"{names} holds no events that have an onset and a name", cure="write the events there, a row each"
        )
    return column


def look(table: Path) -> Look:
    """Return what a plan needs to know of a table of events; remembered while the file stays as it is.

    Raises:
        DataError: It is no table, has no onsets, or one of its times is no number.
    """
    stat = table.stat()
    return _look(table, stat.st_mtime_ns, stat.st_size)


@functools.lru_cache(_REMEMBERED)
def _look(table: Path, _changed_ns: int, _size: int) -> Look:
    header, lines = cells_of(table)
    if "onset" not in header:
        raise DataError(
            f"{table.name} has no column 'onset'{did_you_mean('onset', header)}; its columns are {', '.join(header)}",
            cure="write it as BIDS has it: onset and duration in s, and a column that names the events",
        )
    places = [header.index(name) for name in ("onset", "duration") if name in header]
    # Most columns have a word in the first row: what is left to look for is soon little.
    silent = dict(enumerate(header))
    for line in lines:
        onset, *_ = [seconds(line[at].strip() if at < len(line) else "n/a", table) for at in places]
        if onset == onset and silent:
            words = [at for at in silent if at < len(line) and line[at].strip().lower() not in NO_WORD]
            silent = {at: name for at, name in silent.items() if at not in words}
    naming = frozenset(header) - frozenset(silent.values())
    return Look(table.name, tuple(header), len(lines), naming)


def _column(one: Look, wanted: str) -> str:
    """Return the column that names a table's events where there is no other table."""
    column = wanted or next((name for name in COLUMNS if name in one.columns), "")
    if column in one.columns:
        return column
    hint = did_you_mean(wanted, one.columns)
    what = f"has no column {wanted!r}{hint}" if wanted else f"has neither {' nor '.join(COLUMNS)}"
    raise ConfigError(
        f"{one.name} {what}; its columns are {', '.join(one.columns)}",
        cure="say which one names the events: acquire.event_column = 'COLUMN'",
    )


def _refuse_two(first: Look, column: str, other: Look, its_column: str, filled: Sequence[Look]) -> None:
    spare = its_column if its_column != COLUMNS[0] else column
    raise ConfigError(
        f"{first.name} names its events by {column}, {other.name} by {its_column}: trials of one kind would have two "
        "names",
        cure=_take(spare, filled),
    )


def _take(column: str, tables: Sequence[Look]) -> str:
    """Return the cure by another column, where all tables are named by it."""
    if lacking := [one.name for one in tables if column not in one.naming]:
        return (
            f"acquire.event_column = {column!r} would name them, but {', '.join(lacking[:3])} has no words there: fill "
            "it in, or choose recordings by acquire.sessions or acquire.runs"
        )
    return f"say which one names all events: acquire.event_column = {column!r}"
