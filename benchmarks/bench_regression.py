"""Responses of overlapping onsets by regression, against ``mne.stats.linear_regression_raw`` and LSMR.

One subject of the study's size, one scenario: 1000 onsets, nine predictors, 27 channels. The peer makes the
time-expanded design sparse and multiplies it with itself; LSMR solves the same sparse design a channel at a time, here
on three channels, which are counted for all.
"""

from __future__ import annotations

import _measure
import mne
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsmr

from hrcneuro.eeg.regression import deconvolved

ONSETS, CHANNELS, PREDICTORS, TRIED = 1000, 27, 9, 3


def recording(sfreq: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return signal, onsets, predictors (an intercept, flags, and two that vary) and samples of a response."""
    rng = np.random.default_rng(0)
    length = round(1.4 * sfreq)
    onsets = length + np.cumsum(rng.integers(round(0.6 * sfreq), round(1.2 * sfreq), ONSETS))
    flags = rng.random((ONSETS, PREDICTORS - 3)) < np.linspace(0.1, 0.6, PREDICTORS - 3)
    predictors = np.column_stack([np.ones(ONSETS), flags, rng.standard_normal((ONSETS, 2))])
    return rng.standard_normal((CHANNELS, onsets[-1] + 2 * length)), onsets, predictors, length


def design(onsets: np.ndarray, predictors: np.ndarray, length: int, samples: int) -> sparse.csr_array:
    """Return the time-expanded design, a row a sample of the recording."""
    trial, column = np.nonzero(predictors)
    lag = np.arange(length)
    rows = (onsets[trial][:, None] + lag).ravel()
    columns = (column[:, None] * length + lag).ravel()
    values = np.repeat(predictors[trial, column], length)
    shape = (samples, predictors.shape[1] * length)
    return sparse.csr_array((values, (rows, columns)), shape=shape)


def ours(signal: np.ndarray, onsets: np.ndarray, predictors: np.ndarray, length: int) -> np.ndarray:
    epochs = np.stack([signal[:, onset : onset + length] for onset in onsets])
    return deconvolved(epochs, onsets, predictors)


def peer(signal: np.ndarray, onsets: np.ndarray, predictors: np.ndarray, length: int, sfreq: float) -> np.ndarray:
    raw = mne.io.RawArray(signal, mne.create_info(len(signal), sfreq, "eeg"), verbose="error")
    events = np.column_stack([onsets, np.zeros(len(onsets), int), np.ones(len(onsets), int)])
    names = [f"x{i}" for i in range(1, predictors.shape[1])]
    found = mne.stats.linear_regression_raw(
        raw,
        events,
        {"all": 1},
        tmin=0.0,
        tmax=(length - 1) / sfreq,
        covariates=dict(zip(names, predictors.T[1:], strict=True)),
        reject=None,
    )
    return np.stack([found[name].data for name in ("all", *names)])


def by_lsmr(signal: np.ndarray, onsets: np.ndarray, predictors: np.ndarray, length: int) -> np.ndarray:
    matrix = design(onsets, predictors, length, signal.shape[1])
    solved = [lsmr(matrix, channel, atol=1e-8, btol=1e-8, maxiter=2000)[0] for channel in signal]
    return np.stack(solved).reshape(len(signal), -1, length).transpose(1, 0, 2)


def apart(theirs: np.ndarray, own: np.ndarray) -> str:
    """Return the largest difference; the signal's SD is 1."""
    return f"{np.abs(theirs - own).max():.0e} SD of the noise"


def main() -> None:
    chosen = _measure.options(__doc__)
    _measure.heading()
    for sfreq in (256.0, 512.0):
        signal, onsets, predictors, length = recording(sfreq)
        label = f"{ONSETS} onsets, {PREDICTORS} predictors × {length} samples, {CHANNELS} channels"
        theirs, own = peer(signal, onsets, predictors, length, sfreq), ours(signal, onsets, predictors, length)
        times = _measure.in_turns(
            chosen.repeats,
            lambda s=signal, o=onsets, p=predictors, n=length, f=sfreq: peer(s, o, p, n, f),
            lambda s=signal, o=onsets, p=predictors, n=length: ours(s, o, p, n),
            warm=False,
        )
        _measure.row(f"linear_regression_raw: {label}", *times, None, apart(theirs, own))
        few = signal[:TRIED]
        found = by_lsmr(few, onsets, predictors, length)
        (each,) = _measure.in_turns(1, lambda s=few, o=onsets, p=predictors, n=length: by_lsmr(s, o, p, n), warm=False)
        whole = _measure.Seconds(each.wall * CHANNELS / TRIED, each.cpu * CHANNELS / TRIED)
        _measure.row(f"LSMR: {label}", whole, times[1], None, apart(found, own[:, :TRIED]))
        memory = [_measure.peak_mb(work, sfreq) for work in (_peer, _ours)]
        print(f"  memory above the start: {' MB, ours '.join(f'{peak - before:.0f}' for before, peak in memory)} MB")


def _peer(sfreq: float) -> np.ndarray:
    return peer(*recording(sfreq), sfreq)


def _ours(sfreq: float) -> np.ndarray:
    return ours(*recording(sfreq))


if __name__ == "__main__":
    main()
