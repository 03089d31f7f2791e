"""The trial table: its schema, and how trials of the study or markers of any other recording become it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table
from hrcneuro.sources.recording import onset_samples

if TYPE_CHECKING:
    from pathlib import Path

MOVE = "move"

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


def study_trials(moves: pd.DataFrame, subject: str, sfreq: float) -> pd.DataFrame:
    """Return annotated moves as the trial table; a move whose onset_s is NaN has no marker and no sample."""
    return _complete(moves.assign(subject=subject, event=MOVE), sfreq)


def event_trials(markers: pd.DataFrame, subject: str, sfreq: float) -> pd.DataFrame:
    """Return one row a marker (columns onset_s, event); the columns of the paradigm are null."""
    onsets = markers["onset_s"].to_numpy(float)
    soa = np.append(np.diff(onsets), np.nan)[: len(onsets)]
    return _complete(markers.assign(subject=subject, soa_s=soa), sfreq)


def write(trials: pd.DataFrame, path: Path) -> None:
    """Write the trial table."""
    from hrcneuro.io.tables import write_table

    write_table(trials, path, TRIALS)


def _complete(table: pd.DataFrame, sfreq: float) -> pd.DataFrame:
    table = table.reset_index(drop=True)
    known = table["onset_s"].notna().to_numpy()
    samples = pd.array([None] * len(table), dtype="Int64")
    samples[known] = onset_samples(table.loc[known, "onset_s"].to_numpy(float), sfreq)
    table["onset_sample"] = samples
    for name in TRIALS.columns:
        if name not in table:
            table[name] = None
    return table[list(TRIALS.columns)]
