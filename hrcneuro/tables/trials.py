"""The trial table, trials.parquet: its schema, and its rows, made of moves or of the markers of any other recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table, write_table
from hrcneuro.paradigm.design import MOVE

TRIALS = Table(
    1,
    "one row a move (any other study: one row an event); columns that a study does not have are null",
    {
        "subject": Column("category", "", "subject"),
        "event": Column("category", "", "marker name; 'move' in the study"),
        "scenario": Column("category", "", "sC: sequential collaboration, iC: intermittent collaboration"),
        "practice": Column("bool", "", "move of a practice block"),
        "block": Column("int", "", "block, 1..12; practice 1..2"),
        "episode": Column("int", "", "episode in the block, from 1"),
        "trial": Column("int", "", "move in the episode, from 0"),
        "actor": Column("category", "", "who moved: human or robot"),
        "intended": Column("category", "", "direction of the key pressed or of the robot's plan"),
        "executed": Column("category", "", "direction of the displacement; null where the grid's edge stopped it"),
        "target": Column("category", "", "direction of the next path tile, eight values"),
        "error": Column("bool", "", "an error replaced the intended move"),
        "row": Column("int", "tiles", "tile after the move, 0..6 from the top"),
        "col": Column("int", "tiles", "tile after the move, 0..6 from the left"),
        "key_wrong": Column("bool", "", "the human pressed a key outside the target direction"),
        "onset_s": Column("float", "s", "onset of the motion, from the recording's first sample"),
        "onset_sample": Column("int", "samples", "nearest sample to the onset; null without a recording"),
        "t_f_s": Column("float", "s", "duration of the motion, where known"),
        "case": Column("category", "", "this move's actor after the previous move's: HH, HR, RR, RH"),
        "condition_before": Column("category", "", "case of the pair in which this move is tr-1"),
        "condition_after": Column("category", "", "case of the pair in which this move is tr"),
        "prev_error": Column("bool", "", "the move before this one in the episode was an error"),
        "turn": Column("bool", "", "the next target direction differs from this one"),
        "soa_s": Column("float", "s", "this onset to the next (study: of the episode)"),
    },
)

ONSETS = Table(
    1,
    "one row a move of a recorded session: when it began, by its marker and by the trigger channel",
    {
        **{name: TRIALS.columns[name] for name in ("subject", "practice", "block", "episode", "trial")},
        "marker_s": Column("float", "s", "by the marker, from the recording's first sample; null where there is none"),
        "trigger_s": Column("float", "s", "the trigger's edge near the marker; null where there is none"),
        "onset_s": Column("float", "s", "what counts: the edge, else the marker and the amplifier's delay"),
        "difference_ms": Column("float", "ms", "edge after marker"),
    },
)


def study_trials(moves: pd.DataFrame, subject: str, sfreq: float | None) -> pd.DataFrame:
    """Return annotated moves as the trial table.

    Args:
        moves: One row a move, see :func:`hrcneuro.paradigm.conditions.annotate`; one whose onset_s is NaN has no marker
            in the recording and gets no sample.
        subject: Whose they are.
        sfreq: Sampling rate of the recording, in Hz; None: there is no recording, and no move has a sample.
    """
    return _complete(moves.assign(subject=subject, event=MOVE), sfreq)


def event_trials(markers: pd.DataFrame, subject: str, sfreq: float) -> pd.DataFrame:
    """Return one row a marker as the trial table; columns of the paradigm that the markers do not have are null.

    Args:
        markers: Columns onset_s and event, in order of time; further columns of the table as text, as
            :mod:`hrcneuro.sources.bids` has them.
        subject: Whose they are.
        sfreq: Sampling rate of the recording, in Hz.
    """
    onsets = markers["onset_s"].to_numpy(float)
    soa = np.append(np.diff(onsets), np.nan)[: len(onsets)]
    known = {name: _of_type(markers[name], one.type) for name, one in TRIALS.columns.items() if name in markers}
    return _complete(pd.DataFrame({"soa_s": soa, **known}).assign(subject=subject), sfreq)


def write_onsets(onsets: pd.DataFrame, out: Path) -> None:
    """Write onsets.parquet into the folder ``out``."""
    write_table(onsets, out / "onsets.parquet", ONSETS)


def write_trials(trials: pd.DataFrame, out: Path) -> None:
    """Write trials.parquet into the folder ``out``."""
    write_table(trials, out / "trials.parquet", TRIALS)


def _of_type(values: pd.Series, kind: str) -> pd.Series:
    """Return words as values of a column's type; what has a type already stays as it is."""
    if values.dtype != object or kind == "category":
        return values
    if kind == "bool":
        return values.map({"true": True, "false": False, None: None})
    return pd.to_numeric(values).astype("Int64" if kind == "int" else float)


def _complete(table: pd.DataFrame, sfreq: float | None) -> pd.DataFrame:
    table = table.reset_index(drop=True)
    samples = pd.array([None] * len(table), dtype="Int64")
    if sfreq is not None:
        known = table["onset_s"].notna().to_numpy()
        samples[known] = np.rint(table.loc[known, "onset_s"].to_numpy(float) * sfreq).astype(np.int64)
    table["onset_sample"] = samples
    for name in TRIALS.columns:
        if name not in table:
            table[name] = None
    return table[list(TRIALS.columns)]
