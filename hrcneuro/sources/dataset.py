"""The authors' repository as it stands: recording and log of one subject, brought together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.errors import DataError
from hrcneuro.sources import experiments, spreadsheets
from hrcneuro.sources.events import separate
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.layout import dataset_files
from hrcneuro.sources.logs import read_log
from hrcneuro.sources.matching import Match, histogram, listed, match_onsets
from hrcneuro.sources.origin import with_log
from hrcneuro.sources.recording import Recording


def read_eeg(folder: str, subject: str) -> Recording:
    """Return a subject's recording.

    Raises:
        DataError: A file is missing, truncated, a Git LFS pointer or unreadable.
    """
    return read_recording(dataset_files(folder, subject)["set"])


def read_moves(folder: str, subject: str, recording: Recording) -> pd.DataFrame:
    """Return the annotated moves of a subject's log; where it cannot be used, the message shows the markers, too.

    Raises:
        DataError: The log is missing, truncated or contradicts its metadata.
    """
    try:
        return read_log(Path(folder).expanduser(), subject)
    except DataError as error:
        rows = _rows(dataset_files(folder, subject)["log"])
        text = f"{error.problem}\n  markers: {listed(histogram(recording.markers))}\n  log rows: {listed(rows)}"
        raise DataError(text, cure=error.cure) from error


def match(
    recording: Recording,
    trials: pd.DataFrame,
    subject: str,
    *,
    onset_event: str = "",
    begun: Sequence[experiments.Onset] = (),
) -> Match:
    """Return the onset of every row of the log; equal markers a sample or less apart are one.

    ``begun``: as :func:`hrcneuro.sources.experiments.onsets_of` gives it.

    Raises:
        DataError, ConfigError: Markers and log cannot be used together; the message says where they differ.
    """
    markers = separate(recording.markers, recording, least_gap_s=0.0, twins="keep")
    found = match_onsets(markers, trials, event=onset_event, subject=subject, begun=begun)
    recording.notes += found.notes
    return found


def place(trials: pd.DataFrame, onsets_s: np.ndarray) -> pd.DataFrame:
    """Return the log with the onsets of its moves, annotated anew for the time from onset to onset."""
    from hrcneuro.paradigm.conditions import annotate

    return annotate(trials.assign(onset_s=onsets_s))


def read_study(folder: str, subject: str, *, onset_event: str = "") -> tuple[Recording, pd.DataFrame]:
    """Return recording and trials of a subject; each trial carries the onset of its marker.

    Raises:
        DataError, ConfigError: Files, markers or log cannot be used together; the message says where they differ.
    """
    recording = read_eeg(folder, subject)
    trials = read_moves(folder, subject, recording)
    files = dataset_files(folder, subject)
    recording.origins = with_log(recording.origins, files)
    recording.notes += experiments.notes_of(files["log"])
    begun = experiments.onsets_of(files["log"])
    return recording, place(trials, match(recording, trials, subject, onset_event=onset_event, begun=begun).onsets_s)


def _rows(path: Path) -> dict[str, int]:
    """Return the rows of a log a block, whatever else may be wrong with it."""
    counts: dict[str, int] = {}
    for row in spreadsheets.rows(path):
        name = row.get("Block") or "(no block)"
        counts[name] = counts.get(name, 0) + 1
    return counts
