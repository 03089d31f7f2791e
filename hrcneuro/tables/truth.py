"""What was planted in a synthetic recording: truth_NAME.parquet a kind, and the subject's own values, truth.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table, write_table

_ROWS = {
    "trials": "one row a move: what it evokes",
    "bad_channels": "one row a spell of a bad channel",
    "jolts": "one row a jolt of the whole cap",
    "blinks": "one row a blink",
    "saccades": "one row a saccade",
    "topographies": "one row a channel: gain of each source, mastoid reference",
    "sources": "one row a moment: course of each source",
}
_UNITS = {"_s": ("s", "time"), "_uv": ("uV", "amplitude at the peak channel"), "_ms": ("ms", "time")}
_TYPES = {"b": "bool", "i": "int", "u": "int", "f": "float", "O": "category", "U": "category", "T": "category"}


def write_truth(truth: dict[str, Any], out: Path) -> None:
    """Write ``truth.json`` and a ``truth_NAME.parquet`` for each table into the folder ``out``.

    Args:
        truth: Name -> data frame or plain value, see :class:`hrcneuro.eeg.synthetic.Synthetic`.
        out: The folder.
    """
    single = {name: value for name, value in truth.items() if not isinstance(value, pd.DataFrame)}
    (out / "truth.json").write_text(json.dumps(single, indent=1, sort_keys=True, default=_plain) + "\n")
    for name, table in sorted(truth.items()):
        if isinstance(table, pd.DataFrame):
            data = table if table.index.name is None else table.reset_index()
            write_table(data, out / f"truth_{name}.parquet", _schema(name, data))


def _schema(name: str, data: pd.DataFrame) -> Table:
    """Return a schema of the table's own columns: units are told by the ends of their names."""
    columns = {}
    for column in data:
        unit, text = next((both for end, both in _UNITS.items() if str(column).endswith(end)), ("", ""))
        if name == "sources" and not unit:
            unit, text = "uV", "course at the source's peak channel"
        elif name == "topographies" and not text:
            text = "gain at the channel, 1 at the peak"
        kind = data[column].dtype
        precision = "float32" if kind == np.float32 else _TYPES[getattr(kind, "kind", "O")]
        columns[str(column)] = Column(precision, unit, text or str(column).replace("_", " "))
    return Table(1, _ROWS.get(name, f"planted {name}"), columns)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)
