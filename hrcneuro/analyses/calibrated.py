"""What calibrate reads of a subject: channels, trials and their features, through the same code as a stream."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hrcneuro.analyses import electrodes
from hrcneuro.decoding import offline
from hrcneuro.decoding.crossval import distinct
from hrcneuro.decoding.frozen import FrozenDecoder, windows
from hrcneuro.eeg import breaks
from hrcneuro.eeg.causal import State, design
from hrcneuro.eeg.params import CausalOptions
from hrcneuro.eeg.spatial import Channels, cleaning_matrix
from hrcneuro.errors import DataError
from hrcneuro.paradigm.design import CUES
from hrcneuro.tables.quality import weights

if TYPE_CHECKING:
    import mne

_PIECE = 10_000  # samples that are read at a time
_REASONS = {State.BROKEN: "boundary", State.GONE: "outside", State.COMING: "outside"}


@dataclass(frozen=True)
class Seen:
    """The trials that a decoder may learn from, in the order of the recording.

    Attributes:
        table: Their rows of the trial table, with the columns zero and first_sample, samples, and peak_uv, µV.
        features: ndarray, shape (n_trials, n_features), µV.
        dropped: The other trials, with the column reason.
    """

    table: pd.DataFrame
    features: np.ndarray
    dropped: pd.DataFrame

    @property
    def reasons(self) -> dict[str, int]:
        """Reason -> how many trials were dropped for it."""
        return dict(sorted(Counter(self.dropped["reason"]).items()))


def channels(raw: mne.io.BaseRaw, quality: pd.DataFrame, splines: str) -> Channels:
    """Return the EEG and EOG channels of a recording with what preprocess has found of them.

    Args:
        raw: The recording, as MNE has it.
        quality: quality.parquet of the same recording.
        splines: Which splines are to make its bad channels.

    Raises:
        DataError: It is of another recording.
    """
    import mne

    picks = mne.pick_types(raw.info, eeg=True, eog=True, exclude=())
    names = [raw.ch_names[i] for i in picks]
    kinds = [mne.channel_type(raw.info, i) for i in picks]
    eeg, eog = ([row for row, kind in enumerate(kinds) if kind == wanted] for wanted in ("eeg", "eog"))
    shares = weights(quality)
    of_raw = [names[row] for row in eeg], [names[row] for row in eog]
    if (list(quality["channel"]), list(shares)) != of_raw:
        raise DataError(
            f"quality.parquet of preprocess tells of {', '.join([*quality['channel'], *shares])}; the recording has "
            f"{', '.join([*of_raw[0], *of_raw[1]])}",
            cure="make it anew: hrcneuro preprocess SUBJECT --force",
        )
    interpolated = quality["interpolated"].to_numpy(bool)
    return Channels(
        names,
        eeg,
        eog,
        electrodes.positions(raw, [picks[row] for row in eeg], splines),
        np.column_stack([np.zeros((len(eeg), 0)), *shares.values()]),
        bad=quality["reason"].notna().to_numpy(),
        interpolated=interpolated,
        dropped=quality["rms_after_uv"].isna().to_numpy(),
    )


def bare(options: CausalOptions, raw: mne.io.BaseRaw, channels: Channels) -> FrozenDecoder:
    """Return a decoder that has filter, matrix and windows, and no problem yet.

    Args:
        options: Filter, splines, reference and limit.
        raw: The recording, whose rate it takes.
        channels: Of :func:`channels`.

    Raises:
        BandError, EmptyWindowError: The recording is too slow for the filter, or for the windows.
        NoPositionError, LoneChannelError: Its channels cannot be interpolated, or have no average.
    """
    sfreq = float(raw.info["sfreq"])
    return FrozenDecoder(
        channels=tuple(channels.names),
        sfreq=sfreq,
        band_hz=(options.l_freq, options.h_freq),
        filter=design(sfreq, options.l_freq, options.h_freq),
        matrix=cleaning_matrix(channels, splines=options.interpolation, average=options.reference == "average"),
        kept=channels.kept,
        windows=windows(sfreq),
        reject_uv=options.reject_uv,
        problems={},
    )


def chunks(raw: mne.io.BaseRaw, rows: Sequence[int]) -> Iterator[np.ndarray]:
    """Yield a recording in pieces, each ndarray, shape (n_rows, n_times), µV.

    Args:
        raw: The recording, as MNE has it.
        rows: Of its channels.
    """
    for start in range(0, raw.n_times, _PIECE):
        yield 1e6 * raw.get_data(picks=list(rows), start=start, stop=min(start + _PIECE, raw.n_times))


def see(raw: mne.io.BaseRaw, decoder: FrozenDecoder, trials: pd.DataFrame) -> Seen:
    """Return the features of a recording's trials, and which of them cannot be used.

    Args:
        raw: The recording, as MNE has it.
        decoder: Filter, matrix and windows; it needs no problems.
        trials: Rows of the trial table.
    """
    rows = [raw.ch_names.index(name) for name in decoder.channels]
    trials = trials.sort_values("onset_s", kind="stable").reset_index(drop=True)
    zeros = trials["onset_s"].to_numpy(float) * decoder.sfreq
    reasons = np.full(len(trials), "", dtype=object)
    reasons[np.isnan(zeros) | trials["onset_sample"].isna().to_numpy()] = "no onset"
    reasons[(reasons == "") & _marked(raw, zeros, decoder)] = "marked"
    known = np.flatnonzero(reasons == "")
    marks = raw.annotations
    edges = breaks.borders(marks.onset, marks.description, decoder.sfreq)
    features = np.full((len(trials), len(decoder.kept) * len(decoder.windows)), np.nan)
    peaks = np.full(len(trials), np.nan)
    for which, epoch in offline.epochs(decoder, chunks(raw, rows), zeros[known], breaks=edges):
        at = known[which]
        if isinstance(epoch, State):
            reasons[at] = _REASONS[epoch]
            continue
        features[at], peaks[at] = decoder.features(epoch)
        reasons[at] = "amplitude" if peaks[at] > decoder.reject_uv else ""
    kept = np.flatnonzero(reasons == "")
    own = distinct(trials.loc[kept, "onset_s"].to_numpy(float))
    reasons[kept[~own]] = "twin"
    kept = kept[own]
    firsts = [decoder.first(zero) for zero in zeros[kept]]
    table = trials.iloc[kept].assign(zero=zeros[kept], first_sample=firsts, peak_uv=peaks[kept])
    out = trials.assign(reason=reasons)[reasons != ""]
    return Seen(table.reset_index(drop=True), features[kept], out.reset_index(drop=True))


def _marked(raw: mne.io.BaseRaw, zeros: np.ndarray, decoder: FrozenDecoder) -> np.ndarray:
    """Return which epochs touch a stretch that is marked bad, ndarray, shape (n_trials,), bool."""
    marks = raw.annotations
    firsts = np.where(np.isnan(zeros), -1, np.floor(np.nan_to_num(zeros) + 0.5))
    touched = np.zeros(len(zeros), bool)
    for start, stop in breaks.marked(marks.onset, marks.duration, marks.description, decoder.sfreq):
        touched |= (firsts < stop) & (start < firsts + decoder.n_times)
    return touched


def cues_of(rows: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return cue -> ndarray, shape (n_trials,), bool, of those that every trial has a value of."""
    return {cue: rows[cue].to_numpy(bool) for cue in CUES if cue in rows and rows[cue].notna().all()}


def blocks_of(rows: pd.DataFrame) -> np.ndarray | None:
    """Return the block of each trial, ndarray, shape (n_trials,), int; None where they have none."""
    return rows["block"].to_numpy(int) if "block" in rows and rows["block"].notna().all() else None


def actor_of(rows: pd.DataFrame) -> str:
    """Return who makes all of these moves; empty where it is not one."""
    if "actor" not in rows or rows["actor"].isna().any() or rows["actor"].nunique() != 1:
        return ""
    return str(rows["actor"].iloc[0])
