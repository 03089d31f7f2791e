"""Mean wavelet magnitudes of one subject, 1500 epochs × 27 channels × 717 samples, 15 frequencies, against MNE's.

MNE refuses the 2 Hz wavelet on epochs this short, so the peer's are padded with zeros as ours are, without being timed.
Its wavelets are 5 SD long where Cohen's are one second; its gain is corrected before results are compared.
"""

from __future__ import annotations

import _measure
import mne
import numpy as np
from mne.time_frequency import morlet, tfr_array_morlet

from hrcneuro.eeg import morlet as plain
from hrcneuro.eeg.morlet_means import mean_magnitudes

SFREQ, STEP, CHUNK = 512.0, 2, 50
FREQUENCIES = tuple(float(f) for f in range(2, 31, 2))
WAVELETS = plain.Wavelets(FREQUENCIES, plain.linear_cycles(FREQUENCIES, first=2, last=10), SFREQ)
PAD = 256
TARGETS = {"power": 15, "magnitude": 30}
MEMORY_LIMIT_MB = 512


def epochs(n: int = 1500) -> np.ndarray:
    rng = np.random.default_rng(0)
    data = rng.standard_normal((n, 27, 717))
    return np.cumsum(data, axis=-1) + 10 * data


def members(n: int) -> np.ndarray:
    """Return 8 conditions (4 at tr−1, 4 at tr) of all trials and in each of two scenarios, shape (24, trials)."""
    rng = np.random.default_rng(1)
    before, after = (rng.choice(4, n, p=[0.4, 0.1, 0.36, 0.14]) for _ in range(2))
    cases = np.concatenate([np.arange(4)[:, None] == before, np.arange(4)[:, None] == after])
    scenario = rng.random(n) < 0.5
    return np.concatenate([cases, cases & scenario, cases & ~scenario])


def ours(data: np.ndarray) -> np.ndarray:
    return mean_magnitudes(data, members(len(data)), WAVELETS, step=STEP)


def _mne(padded: np.ndarray, output: str) -> np.ndarray:
    with mne.utils.use_log_level("error"):
        return tfr_array_morlet(
            padded,
            SFREQ,
            np.array(FREQUENCIES),
            np.array(WAVELETS.cycles),
            zero_mean=False,
            output=output,
            decim=STEP,
            n_jobs=1,
        )


def peer_power(padded: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Return the mean power of the four conditions at tr−1: one call a condition."""
    return np.stack([_mne(padded[mask], "avg_power") for mask in masks[:4]])


def peer_magnitude(padded: np.ndarray, masks: np.ndarray) -> np.ndarray:
    """Return the mean magnitude of all conditions, in chunks: whole, the complex maps take 8 GB."""
    total = 0.0
    for start in range(0, len(padded), CHUNK):
        size = np.abs(_mne(padded[start : start + CHUNK], "complex"))
        total = total + np.tensordot(masks[:, start : start + CHUNK].astype(float), size, 1)
    gain = np.array(
        [
            np.abs(np.fft.fft(w, 1 << 16)).max()
            for w in morlet(SFREQ, np.array(FREQUENCIES), np.array(WAVELETS.cycles), zero_mean=False)
        ]
    )
    return 2 * total[..., PAD // STEP : -(PAD // STEP)] / gain[:, None] / masks.sum(axis=1)[:, None, None, None]


def main() -> None:
    chosen = _measure.options(__doc__)
    n = 300 if chosen.quick else 1500
    data, masks = epochs(n), members(n)
    padded = np.pad(data, ((0, 0), (0, 0), (PAD, PAD)))
    results = {}
    power, magnitude, us = _measure.in_turns(
        chosen.repeats,
        lambda: peer_power(padded, masks),
        lambda: results.update(peer=peer_magnitude(padded, masks)),
        lambda: results.update(ours=ours(data)),
        warm=False,
    )
    few = slice(0, 40)
    exact = plain.mean_magnitudes(data[few], masks[:1, few], WAVELETS, step=STEP)
    gap = np.abs(mean_magnitudes(data[few], masks[:1, few], WAVELETS, step=STEP) - exact).max() / exact.max()
    versus = np.abs(results["ours"] - results["peer"]).max() / results["peer"].max()
    _measure.heading()
    label = f"ERSP, {n} × 27 × 717, 15 frequencies; MNE"
    _measure.row(
        f"{label} mean power, 4 conditions", power, us, TARGETS["power"], f"exact convolution {gap:.0e} relative"
    )
    _measure.row(
        f"{label} magnitudes, 24 conditions", magnitude, us, TARGETS["magnitude"], f"MNE {versus:.0e} relative"
    )
    before, peak = _measure.peak_mb(ours, prepare=epochs)
    print(f"  memory above the epochs: {peak - before:.0f} MB (limit {MEMORY_LIMIT_MB})")


if __name__ == "__main__":
    main()
