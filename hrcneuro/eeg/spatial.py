"""Everything that cleaning does across channels as one matrix: eyes, bad channels, reference, choice of channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.eeg import interpolation
from hrcneuro.eeg.refusals import LoneChannelError, NoPositionError


@dataclass(frozen=True)
class Channels:
    """The channels of a recording, and what is known of them.

    Attributes:
        names: Of all rows, in the recording's order.
        eeg, eog: Rows of the EEG and of the EOG channels.
        positions: ndarray, shape (n_eeg, 3), around the centre of the interpolation's sphere, NaN where unknown.
        eog_weights: ndarray, shape (n_eeg, n_eog): what of each EOG channel is subtracted.
        bad: ndarray, shape (n_eeg,), bool: nothing is interpolated from these.
        interpolated, dropped: ndarray, shape (n_eeg,), bool: made from the others; left out.
    """

    names: Sequence[str]
    eeg: Sequence[int]
    eog: Sequence[int]
    positions: np.ndarray
    eog_weights: np.ndarray
    bad: np.ndarray
    interpolated: np.ndarray
    dropped: np.ndarray

    @property
    def kept(self) -> tuple[str, ...]:
        """Names of the EEG channels that are not dropped."""
        return tuple(self.names[row] for row, out in zip(self.eeg, self.dropped, strict=True) if not out)


def cleaning_matrix(channels: Channels, *, splines: str, average: bool) -> np.ndarray:
    """Return the matrix that cleans a sample: ndarray, shape (n_kept, n_channels), on the recording's own rows.

    It does what the chain does after its filter (paper 2.3.3): EOG regressed out, bad channels from their neighbours,
    channels without a place left out, common average. The means that the chain subtracts on the way are constants, so
    features that remove the mean of an epoch do not see them.

    Args:
        channels: The recording's.
        splines: How bad channels are made: ``eeglab`` or ``perrin``.
        average: Whether the common average is the reference.

    Raises:
        NoPositionError: A channel that is to be interpolated has no position, or no good one has.
        LoneChannelError: The average would be over one channel.
    """
    eeg, eog = np.asarray(channels.eeg, int), np.asarray(channels.eog, int)
    matrix = np.zeros((len(eeg), len(channels.names)))
    matrix[np.arange(len(eeg)), eeg] = 1.0
    matrix[:, eog] = -channels.eog_weights
    placed = np.isfinite(channels.positions).all(axis=1)
    source, target = np.flatnonzero(~channels.bad & placed), np.flatnonzero(channels.interpolated)
    if len(target):
        lost = [channels.names[eeg[row]] for row in target if not placed[row]]
        if lost or not len(source):
            raise NoPositionError(f"bad channels without a position, or without good neighbours: {', '.join(lost)}")
        at = channels.positions
        matrix[target] = interpolation.weights(at[source], at[target], method=splines) @ matrix[source]
    matrix = matrix[~channels.dropped]
    if average:
        if len(matrix) < 2:
            raise LoneChannelError(f"the average over {len(matrix)} EEG channel is that channel: nothing would be left")
        matrix -= matrix.mean(axis=0)
    return matrix
