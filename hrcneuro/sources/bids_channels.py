"""What a BIDS data set says of channels before a recording is read: are units known, do runs go together."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.sources.bids_tables import NO_WORD, Row, read_rows
from hrcneuro.sources.formats.announced import announced_channels
from hrcneuro.sources.kinds import kind_of_type
from hrcneuro.sources.units import is_known_unit, says_nothing, voltage_unit

_NUMBER = re.compile(r"\d+(\.\d*)?")
_VOLTAGES = ("eeg", "eog", "ecg", "emg")
# Types of BIDS that are misc here, whatever their unit.
_OF_NO_VOLTAGE = ("adc", "dac", "fiterr", "hlu", "other", "pd", "ref", "sysclock")


def channel_rows(table: Path) -> list[Row]:
    """Return the rows of channels.tsv; refuse a unit that is no voltage of EEG, or that nobody knows."""
    rows = read_rows(table)
    for row in rows:
        unit, kind = row.get("units", "n/a"), row.get("type", "n/a")
        if unit.lower() in NO_WORD or voltage_unit(unit):
            continue
        known, what = kind_of_type(kind), f"{table.name} gives"
        if known in _VOLTAGES:
            raise DataError(
                f"{what} {kind} channel {row.get('name')} the unit {unit!r}, which is no voltage",
                cure="write V, mV, µV or nV there, or n/a: then the recording's own unit counts",
            )
        if known is None and kind.lower() not in _OF_NO_VOLTAGE and not (is_known_unit(unit) or says_nothing(unit)):
            raise DataError(
                f"{what} channel {row.get('name')} of {f'type {kind!r}' if kind.lower() not in NO_WORD else 'no type'} "
                f"the unit {unit!r}, which is not known",
                cure="write V, mV, µV or nV there, or n/a: then the recording's own unit counts; of a channel that is "
                "no voltage, write its type (MISC)",
            )
    return rows


def announced_rows(recording: Path) -> list[Row]:
    """Return what a recording's header says of its channels as channels.tsv would; nothing where it says nothing."""
    found = announced_channels(recording) or {}
    return [{"name": name, "sampling_frequency": f"{rate:g}"} for name, rate in found.items()]


_MEANT: dict[str, Callable[[str], object]] = {
    "name": str,
    "type": lambda word: kind_of_type(word) or word.lower(),
    "units": lambda word: voltage_unit(word) or word,
    "sampling_frequency": lambda word: float(word) if _NUMBER.fullmatch(word) else word,
}
"""Column of channels.tsv -> what a cell of it means: 256 and 256.0, uV and µV are the same."""


def _alike(one: str | None, two: str | None, meant: Callable[[str], object]) -> bool:
    """Return whether two cells say the same, or one says nothing; a channel that is absent is no cell."""
    if one is None or two is None:
        return one is two
    return one.lower() in NO_WORD or two.lower() in NO_WORD or meant(one) == meant(two)


def refuse_unequal(tables: Sequence[tuple[Path, list[Row]]]) -> None:
    """Refuse recordings of which one has other channels, or at another rate, than the first.

    Args:
        tables: A file for each recording, and the rows on channels that it has.
    """
    for table, rows in tables[1:]:
        first, of_first = tables[0]
        for about, meant in _MEANT.items():
            one, two = ({row.get("name", ""): row.get(about, "n/a") for row in each} for each in (of_first, rows))
            unlike = sorted(name for name in one | two if not _alike(one.get(name), two.get(name), meant))
            if unlike:
                what = f"{unlike[0]}: {one.get(unlike[0], 'absent')} and {two.get(unlike[0], 'absent')}"
                raise DataError(
                    f"{first.name} and {table.name} do not go together: {len(unlike)} channels differ in {about}, the "
                    f"first is {what}",
                    cure="name those that do in acquire.sessions or acquire.runs, or correct the tables",
                )
