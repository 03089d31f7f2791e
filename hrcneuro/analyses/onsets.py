"""Where the trial table's onsets lie in the clean recording: what epoch cuts around, and what erp knows beyond that."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hrcneuro.contract import Inputs
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import mne
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.regression import OtherOnsets
    from hrcneuro.eeg.resample import Ratio
    from hrcneuro.eeg.selection import LabelledEpochs


def ratio(inputs: Inputs, raw: mne.io.BaseRaw) -> Ratio:
    """Return how the clean recording's samples follow from those that the trial table counts.

    Raises:
        DataError: The recording has not the length that preprocess wrote down.
    """
    from hrcneuro.eeg.resample import Ratio
    from hrcneuro.io.tables import read_table

    timing = read_table(inputs.path("preprocess", "timing.parquet")).to_dict("records")[0]
    if raw.n_times != timing["n_samples"]:
        raise DataError(
            f"the clean recording has {raw.n_times} samples, timing.parquet says {timing['n_samples']}",
            cure=f"rerun it: hrcneuro preprocess {inputs.unit} --force",
        )
    return Ratio(float(timing["source_sfreq"]), int(timing["up"]), int(timing["down"]))


def samples(trials: pd.DataFrame, rates: Ratio) -> np.ndarray:
    """Return the clean signal's sample of each onset, -1 where a trial has none, ndarray, shape (n_trials,)."""
    import numpy as np

    known = trials["onset_sample"].notna().to_numpy()
    onsets = np.full(len(trials), -1, np.int64)
    onsets[known] = rates.nearest(trials.loc[known, "onset_sample"].to_numpy(np.int64))
    return onsets


def borders(raw: mne.io.BaseRaw, rates: Ratio) -> list[int]:
    """Return the first sample of each new stretch of the clean signal."""
    from hrcneuro.eeg import breaks

    return [rates.first(s) for s in breaks.borders(raw.annotations.onset, raw.annotations.description, rates.source)]


def without_epoch(inputs: Inputs, trials: LabelledEpochs) -> tuple[OtherOnsets, pd.DataFrame]:
    """Return the onsets in the recording that have no epoch, moves of no condition and rejected trials, and their rows.

    Args:
        inputs: With the trial table, and the clean recording and its timing.
        trials: The epochs.
    """
    import numpy as np

    from hrcneuro.eeg.regression import OtherOnsets
    from hrcneuro.io.fif import read_raw
    from hrcneuro.io.tables import read_table

    raw = read_raw(inputs.path("preprocess", "{unit}_clean_raw.fif"))
    rates = ratio(inputs, raw)
    table = read_table(inputs.path("acquire", "trials.parquet"))
    table = table[~table["onset_sample"].isin(trials.table["onset_sample"])]
    others = samples(table, rates)
    recorded = (others >= 0) & (others < raw.n_times)
    others, table = others[recorded], table[recorded].reset_index(drop=True)
    edges = np.array([0, *(b for b in borders(raw, rates) if 0 < b < raw.n_times), raw.n_times])
    stretch = np.searchsorted(edges, others, side="right")
    first = others + round(trials.times[0] * trials.info["sfreq"])
    spans = np.stack([edges[stretch - 1] - first, edges[stretch] - first], axis=1)
    return OtherOnsets(others, spans.clip(0, len(trials.times))), table
