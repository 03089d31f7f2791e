"""Tables of BIDS: tabs between cells, a row of names first, n/a for what is not known."""

from __future__ import annotations

import csv
from pathlib import Path

from hrcneuro.errors import DataError

NO_WORD = ("", "n/a")
"""Cells of a table, in small letters, that say nothing."""
NO_NUMBER = (*NO_WORD, "nan")
"""Cells of a column of numbers that say nothing."""
Row = dict[str, str]


def read_rows(table: Path) -> list[Row]:
    """Return the rows of a table of BIDS.

    Raises:
        DataError: A row has more cells than there are columns, or the table has none.
    """
    header, lines = cells_of(table)
    # What a line lacks is n/a.
    rest = ["n/a"] * len(header)
    return [dict(zip(header, map(str.strip, [*line, *rest]), strict=False)) for line in lines]


def cells_of(table: Path) -> tuple[list[str], list[list[str]]]:
    """Return a table's header and its lines, cell by cell.

    Raises:
        DataError: As :func:`read_rows`.
    """
    with table.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        header, *lines = list(csv.reader(file, delimiter="\t")) or [[]]
    lines = [line for line in lines if line]
    if not header or any(len(line) > len(header) for line in lines):
        raise DataError(f"{table.name} is no table with tabs between its columns", cure="write it as BIDS has it")
    return header, lines
