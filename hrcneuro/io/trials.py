"""A subject's epochs as erp, ersp and decode read them: samples in microvolt, with the trial table."""

from __future__ import annotations

import numpy as np

from hrcneuro.contract import Inputs
from hrcneuro.eeg.selection import LabelledEpochs
from hrcneuro.errors import DataError
from hrcneuro.io.fif import read_eeg_epochs


def read_trials(inputs: Inputs, dtype: type[np.floating] = np.float64) -> LabelledEpochs:
    """Return the subject's epochs, in double precision unless another one is asked for.

    Raises:
        DataError: There is no epoch, EEG channel or trial table, or a value is not finite.
    """
    path = inputs.path("epoch", "{unit}_epo.fif")
    epochs, info, data = read_eeg_epochs(path, dtype)
    cure = f"look at the upstream stages: hrcneuro epoch {inputs.unit} --force"
    if epochs.metadata is None or not len(epochs):
        raise DataError(f"{path.name} holds {len(epochs)} epochs and no trial table", cure=cure)
    if not data.shape[1]:
        raise DataError(f"{path.name} holds no EEG channel", cure=cure)
    for trial, epoch in enumerate(data):
        # A sum is finite only if all of its terms are: one fast pass.
        if not np.isfinite(epoch.sum()):
            channel = info["ch_names"][int(np.argmin(np.isfinite(epoch).all(axis=-1)))]
            raise DataError(
                f"{path.name}: epoch {trial} holds values that are not finite on channel {channel}",
                cure=f"{cure}; a channel can be named as bad (acquire.bads)",
            )
    table = epochs.metadata.reset_index(drop=True)
    return LabelledEpochs(data, epochs.events[:, 0], epochs.times.copy(), info, table)
