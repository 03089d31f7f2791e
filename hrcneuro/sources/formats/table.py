"""A recording as a table: a CSV file with a row a sample, such as Muse, OpenBCI and Emotiv leave.

A table states neither units nor, most often, a sampling rate, and no maker names columns alike. So the study's options
say what the columns are; nothing is guessed.
"""

from __future__ import annotations

import csv
import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.eeg import stamps as timestamps
from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.parameters import HIGHEST_HZ, LOWEST_HZ
from hrcneuro.sources.recording import Recording, markers_of

_COMMENTS = ("%", "#")
_EMPTY = ("", "nan", "n/a", "na")
# Times in packets waver, and may step back a little; what steps back farther was begun anew.
_SET_BACK_S = 0.05


def read(
    path: Path,
    *,
    columns: Sequence[str] = (),
    table_rate: float = 0.0,
    time_column: str = "",
    marker_column: str = "",
    unit: str = "",
    rate_tolerance: float = 0.01,
) -> Recording:
    """Return the columns of a table as a recording, and its markers.

    Args:
        path: Text with a row of names, then a row a sample; comments before it begin with % or #.
        columns: Those that are channels, in their order.
        table_rate: Sampling rate in Hz; 0: the one by the column of times.
        time_column: Times in s; gaps in it are breaks, and so is each place where its clock starts again.
        marker_column: Markers: numbers are a trigger channel of that name, each text is a marker.
        unit: Unit of the numbers.
        rate_tolerance: By how much, as a share, the measured rate may differ from the stated one.

    Raises:
        ConfigError: An option is missing, or names a column that is not there or that another option names.
        DataError: The table is cut, holds no sample, did not come at the stated rate, or at one that no EEG has.
    """
    notes: list[str] = []
    _refuse_twice(columns, time_column, marker_column)
    table = _read(path, sorted({*columns, time_column, marker_column} - {""}), notes)
    _check_options(path, columns, unit, table_rate, time_column)
    sfreq, parts = _timed(path, table, table_rate, time_column, rate_tolerance, notes)
    data = np.stack([_numbers(table[name], path) for name in columns])
    names, kinds, units = list(columns), ["eeg"] * len(columns), ["V"] * len(columns)
    markers = markers_of([], [])
    if marker_column:
        cells = table[marker_column].str.strip()
        cells = cells.where(~cells.str.lower().isin(_EMPTY), "")
        codes = pd.to_numeric(cells.replace("", "0"), errors="coerce")
        if codes.notna().all():
            data = np.concatenate([data, codes.to_numpy(float)[None]])
            names, kinds, units = [*names, marker_column], [*kinds, "stim"], [*units, ""]
        else:
            rows = np.flatnonzero((cells != "") & (cells != "0"))
            markers = markers_of(rows / sfreq, cells.iloc[rows].tolist())
    recording = Recording(data, names, kinds, sfreq, markers, units=units, notes=notes)
    recording.breaks_s = [start / sfreq for start, _ in parts[1:]]
    return recording


def _read(path: Path, wanted: Sequence[str], notes: list[str]) -> pd.DataFrame:
    """Return the table as text, with the columns that are wanted among its own."""
    skipped, names, separator = _names(path)
    if missing := [name for name in wanted if name not in names]:
        hints = ", ".join(f"{name!r}{did_you_mean(name, names)}" for name in missing)
        raise ConfigError(
            f"{path.name} has no column {hints}; its columns are {', '.join(names)}",
            cure="correct acquire.columns, acquire.time_column and acquire.marker_column",
        )
    if not wanted:
        _no_columns(path, names)
    try:
        with warnings.catch_warnings():
            # Of rows longer than the first one, which pandas would cut.
            warnings.simplefilter("error", pd.errors.ParserWarning)
            table = pd.read_csv(
                path, sep=separator, skiprows=skipped, names=names, dtype=str, skipinitialspace=True, header=None,
                keep_default_na=False, encoding="utf-8-sig", encoding_errors="replace", index_col=False,
            )  # fmt: skip
    except (pd.errors.ParserError, pd.errors.ParserWarning, pd.errors.EmptyDataError, ValueError) as error:
        raise DataError(f"{path.name} cannot be read as a table: {error}", cure="export the table again") from error
    if _last_cells(path, separator) < len(names):
        notes.append(f"{path.name} ends within a row, which is left out")
        return table.iloc[:-1]
    return table


def _last_cells(path: Path, separator: str) -> int:
    """Return how many cells the last row has: a recorder that is ended leaves a part of one."""
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 100_000, 0))
        last = file.read().decode("utf-8", errors="replace").rstrip().rpartition("\n")[2]
    return len(next(csv.reader([last], delimiter=separator), []))


def _names(path: Path) -> tuple[int, list[str], str]:
    """Return how many lines come before the samples, the names of the columns, and what stands between two."""
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        for number, line in enumerate(file):
            if not line.strip() or line.startswith(_COMMENTS):
                continue
            separator = max(",;\t", key=line.count)
            names = [name.strip() for name in next(csv.reader([line], delimiter=separator))]
            if len({*names}) < len(names) or all(_is_number(name) for name in names):
                raise DataError(
                    f"{path.name}: its first row, {line.strip()[:60]!r}, does not name the columns, each by itself",
                    cure="put a row of names before the samples",
                )
            return number + 1, names, separator
    raise DataError(f"{path.name} is empty", cure="export the table again")


def _check_options(path: Path, columns: Sequence[str], unit: str, rate: float, time_column: str) -> None:
    if not columns:
        _no_columns(path, _names(path)[1])
    if not unit:
        raise ConfigError(
            f"{path.name} is a table, which states no unit, and acquire.unit is empty",
            cure="set acquire.unit: allowed are V, mV, uV, nV",
        )
    if not rate and not time_column:
        raise ConfigError(
            f"{path.name} is a table, which states no sampling rate",
            cure="set acquire.table_rate (Hz), or acquire.time_column: the column of times in s",
        )


def _refuse_twice(columns: Sequence[str], time_column: str, marker_column: str) -> None:
    """Refuse a column that options name twice: it would be two channels, or a signal and something else."""
    named = [*(("acquire.columns", name) for name in columns), ("acquire.time_column", time_column)]
    named += [("acquire.marker_column", marker_column)]
    first: dict[str, str] = {}
    for option, name in named:
        if name and name in first:
            both = f"{first[name]} and {option} name" if first[name] != option else f"{option} names twice"
            raise ConfigError(
                f"{both} the column {name!r}: a column is one channel, the times, or the markers",
                cure=f"leave it out of {option if first[name] == option else 'one of them'}",
            )
        first[name] = option


def _no_columns(path: Path, names: Sequence[str]) -> None:
    raise ConfigError(
        f"acquire.columns is empty: which columns of {path.name} are channels? They are {', '.join(names)}",
        cure="set acquire.columns, such as " + str(list(names[1:4])),
    )


def _timed(
    path: Path, table: pd.DataFrame, rate: float, time_column: str, tolerance: float, notes: list[str]
) -> tuple[float, list[tuple[int, int]]]:
    """Return the sampling rate, and the stretches of rows without a gap."""
    if len(table) < 2:
        raise DataError(f"{path.name} holds {len(table)} samples", cure="export the table again")
    if not time_column:
        return rate, [(0, len(table))]
    times = _numbers(table[time_column], path)
    forward = np.isfinite(times).all() and np.median(np.diff(times)) > 0
    runs = _runs(times)
    usual = _usual_rate(times, runs) if forward else 0.0
    if not usual:
        raise DataError(
            f"{path.name}: the times in {time_column!r} do not go forward, or are no numbers",
            cure="leave acquire.time_column out and set acquire.table_rate",
        )
    parts = [
        (first + start, first + stop)
        for first, last in runs
        for start, stop in timestamps.segments(times[first:last], rate or usual)
    ]
    measured = timestamps.steady(times, parts)[1]
    if rate and abs(measured / rate - 1) > tolerance:
        raise DataError(
            f"{path.name}: acquire.table_rate is {rate:g} Hz, the rows came at {measured:.3f} Hz, "
            f"{100 * abs(measured / rate - 1):.1f} % off; allowed: {100 * tolerance:g} % (acquire.rate_tolerance)",
            cure="correct acquire.table_rate; times must be in s",
        )
    if not rate and not LOWEST_HZ <= measured <= HIGHEST_HZ:
        raise DataError(
            f"{path.name}: by {time_column!r} its rows came at {measured:.4g} Hz; "
            f"allowed: {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz",
            cure="the times must be in s: convert the column, or leave acquire.time_column out and set "
            "acquire.table_rate",
        )
    notes.append(f"{len(table)} rows at {rate or measured:.6g} Hz (measured {measured:.3f} Hz)")
    _tell_breaks(times, parts, notes)
    return rate or measured, parts


def _tell_breaks(times: np.ndarray, parts: Sequence[tuple[int, int]], notes: list[str]) -> None:
    """Say where rows are missing, and where the clock starts again; rows keep the file's order, whatever it says."""
    steps = [(start, float(times[start] - times[start - 1])) for start, _ in parts[1:]]
    if lost := [step for _, step in steps if step > 0]:
        notes.append(f"gaps without rows: {len(lost)}, {sum(lost):.2f} s in all; each is a break")
    if again := [start for start, step in steps if step <= 0]:
        listed = ", ".join(f"{at + 1} ({times[at - 1]:.2f} s, then {times[at]:.2f} s)" for at in again[:6])
        more = f" … ({len(again)})" if len(again) > 6 else ""
        notes.append(f"the clock starts again at row {listed}{more}: rows stay in the file's order, with a break there")


def _runs(times: np.ndarray) -> list[tuple[int, int]]:
    """Return the stretches of rows (first, one past the last) in which the clock is not set back."""
    starts = [0, *(int(at) + 1 for at in np.flatnonzero(np.diff(times) < -_SET_BACK_S)), len(times)]
    return list(pairwise(starts))


def _usual_rate(times: np.ndarray, runs: Sequence[tuple[int, int]]) -> float:
    """Return the usual rate of the longest run in Hz; 0 where its times do not go forward."""
    first, last = max(runs, key=lambda run: run[1] - run[0])
    # Times that come in packets are equal within one: the middle of long stretches is not.
    stretch = max((last - first) // 10, 1)
    period = float(np.median(times[first + stretch : last] - times[first : last - stretch])) if last - first > 1 else 0
    return stretch / period if period > 0 else 0.0


def _numbers(column: pd.Series, path: Path) -> np.ndarray:
    """Return a column as numbers; an empty cell is none, and text is refused."""
    numbers = pd.to_numeric(column, errors="coerce")
    text = numbers.isna() & ~column.str.strip().str.lower().isin(_EMPTY)
    if text.any():
        row = int(np.argmax(text.to_numpy()))
        raise DataError(
            f"{path.name}: column {column.name!r} has {int(text.sum())} cells that are no numbers, the first "
            f"{column.iloc[row]!r} in sample {row}",
            cure="check that acquire.columns names signals; a decimal comma must become a point",
        )
    return numbers.to_numpy(float)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
