"""The table of the epoch stage, conditions.parquet: how many epochs of each condition are good."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from hrcneuro.eeg.epochs import REASONS
from hrcneuro.io.tables import Column, Table, write_table

_REASONS = {
    "no onset": "the move has no onset in the recording",
    "outside": "the epoch leaves the recording",
    "boundary": "the epoch crosses a discontinuity",
    "marked": "the epoch touches a stretch that was marked bad",
    "amplitude": "|amplitude| above the limit",
}


def _column(reason: str) -> str:
    return reason.replace(" ", "_")


CONDITIONS = Table(
    1,
    "one row a scenario × case × position; an epoch is counted at both of its positions",
    {
        "scenario": Column("category", "", "sC, iC; all in a study without scenarios"),
        "case": Column("category", "", "HH, HR, RR, RH; the event's name in another study"),
        "position": Column("category", "", "before: the move is tr-1; after: it is tr; event in another study"),
        "kept": Column("int", "epochs", "good epochs"),
        "rejected": Column("int", "epochs", "rejected epochs, for the reasons in the columns that follow"),
        **{_column(reason): Column("int", "epochs", f"rejected: {_REASONS[reason]}") for reason in REASONS},
    },
)


def write_conditions(counts: pd.DataFrame, out: Path) -> None:
    """Write conditions.parquet into the folder ``out``, from the rows of :func:`hrcneuro.eeg.epochs.tally`."""
    columns = {reason: _column(reason) for reason in REASONS}
    write_table(counts.rename(columns=columns), out / "conditions.parquet", CONDITIONS)
