"""The subject's epochs as the analyses take them: read, and refused where no analysis could use them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hrcneuro.contract import Inputs
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import numpy as np

    from hrcneuro.eeg.selection import Trials


def read_trials(inputs: Inputs, dtype: type[np.floating] | None = None) -> Trials:
    """Return the subject's good epochs: EEG in microvolts, and the trial table beside it.

    Args:
        inputs: With the subject's ``*_epo.fif`` of the stage epoch.
        dtype: Precision of the samples, ``float64`` where none is named.

    Raises:
        DataError: There is no epoch, EEG channel or trial table, or a value is not finite.
    """
    import numpy as np

    from hrcneuro.eeg.selection import Trials
    from hrcneuro.io.fif import read_eeg_epochs

    path = inputs.path("epoch", "{unit}_epo.fif")
    epochs, info, data = read_eeg_epochs(path, dtype or np.float64)
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
    return Trials(data, epochs.events[:, 0], epochs.times.copy(), info, epochs.metadata.reset_index(drop=True))
