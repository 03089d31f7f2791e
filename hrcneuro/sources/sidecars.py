"""BIDS's tables beside a recording that is read by itself: they are not read, and this says so where they would count.

``acquire.source = "bids"`` reads them (:mod:`hrcneuro.sources.bids`).
"""

from __future__ import annotations

import csv
from pathlib import Path

from hrcneuro.errors import DataError


def sidecar_notes(path: Path) -> list[str]:
    """Return what the tables of events and channels beside a recording hold that is not read."""
    notes = []
    if events := _table(path, "events"):
        notes.append(f"{events.name} lies beside the recording and is not read: {len(_rows(events))} events")
    if channels := _table(path, "channels"):
        rows = _rows(channels)
        bad = [row.get("name") or "" for row in rows if (row.get("status") or "").lower() == "bad"]
        marked = f"; it marks as bad: {', '.join(bad)} (acquire.bads)" if bad else ""
        notes.append(f"{channels.name} lies beside the recording and is not read: types, units, bad channels{marked}")
    return notes


def refuse_events_elsewhere(path: Path) -> None:
    """Refuse a recording that has no events of its own where a table beside it has them.

    Raises:
        DataError: There is such a table.
    """
    events = _table(path, "events")
    if events is None:
        return
    raise DataError(
        f"{path.name} has no events of its own; {events.name} beside it has {len(_rows(events))}, and is not read",
        cure="acquire.source = 'bids' reads it: set acquire.path to the root of the data set",
    )


def _table(path: Path, kind: str) -> Path | None:
    """Return ``…_events.tsv`` or ``…_channels.tsv`` that goes with ``…_eeg.edf``."""
    stem = path.name.partition(".")[0]
    for base in (stem.removesuffix("_eeg"), stem):
        table = path.with_name(f"{base}_{kind}.tsv")
        if table.is_file():
            return table
    return None


def _rows(table: Path) -> list[dict[str, str]]:
    with table.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))
