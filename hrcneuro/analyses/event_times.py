"""When the events of epochs were, in seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from hrcneuro.eeg.selection import LabelledEpochs


def marked_s(epochs: LabelledEpochs) -> np.ndarray:
    """Return when the epochs' events were, ndarray, shape (n_epochs,), s: as marked, or else by the sample."""
    marked = epochs.table.get("onset_s")
    if marked is not None and marked.notna().all():
        return marked.to_numpy(float)
    return epochs.onsets / epochs.info["sfreq"]
