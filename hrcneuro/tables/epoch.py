"""The tables of the epoch stage: how many epochs of each condition are good, and what became of every trial."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
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


DROP_LOG = Table(
    1,
    "one row a trial of which an epoch was wanted, in the order of the recording",
    {
        "epoch": Column("int", "", "row of the trial in the epochs file; null where it was rejected"),
        "onset_s": Column("float", "s", "onset in the recording; null where the trial has none"),
        "block": Column("int", "", "the trial's key: block; null in a study without blocks"),
        "episode": Column("int", "", "the trial's key: episode"),
        "trial": Column("int", "", "the trial's key: trial in the episode"),
        "tag": Column("category", "", "name of the epoch: scenario and cases, or the event"),
        "reason": Column("category", "", f"why it was rejected: {', '.join(REASONS)}; null where it is good"),
        "peak_uv": Column("float", "µV", "its largest |amplitude|; null where it leaves the recording"),
        "channel": Column("category", "", "EEG channel of that amplitude"),
    },
)


def write_drop_log(
    trials: pd.DataFrame,
    tags: Sequence[str],
    reasons: np.ndarray,
    peaks: tuple[np.ndarray, np.ndarray],
    names: Sequence[str],
    out: Path,
) -> None:
    """Write drop_log.parquet into the folder ``out``.

    Args:
        trials: The trial table of the epochs that were wanted.
        tags: Their names.
        reasons: ndarray, shape (n_trials,), see :func:`hrcneuro.eeg.epochs.judge`.
        peaks: Largest |amplitude|, µV, and its channel's row, -1 for none; each ndarray, shape (n_trials,).
        names: The channels.
        out: The folder.
    """
    kept = reasons == ""
    keys = {name: trials[name].to_numpy() if name in trials else None for name in ("block", "episode", "trial")}
    rows = pd.DataFrame(
        {
            "epoch": pd.array(np.where(kept, np.cumsum(kept) - 1, -1), dtype="Int64"),
            "onset_s": trials["onset_s"].to_numpy() if "onset_s" in trials else np.nan,
            **keys,
            "tag": tags,
            "reason": [why or None for why in reasons],
            "peak_uv": peaks[0],
            "channel": [names[row] if row >= 0 else None for row in peaks[1]],
        }
    )
    rows.loc[~kept, "epoch"] = pd.NA
    write_table(rows, out / "drop_log.parquet", DROP_LOG)
