"""One subject from raw FIF to decoding as a careful user of MNE and scikit-learn writes it: ``FILE RAW TRIALS OUT``.

Not a benchmark by itself: ``bench_subject.py`` runs it. It writes two averages to OUT, so that results can be compared.
"""

from __future__ import annotations

import sys
import time

import mne
import numpy as np
import pandas as pd
from mne.preprocessing import EOGRegression
from mne.time_frequency import morlet, tfr_array_morlet
from scipy.stats import kurtosis
from sklearn.model_selection import RepeatedStratifiedKFold

CASES = ("HH", "HR", "RR", "RH")
WINDOWS = [(400 + 50 * i, 450 + 50 * i) for i in range(4)] + [(50 * i, 50 * i + 100) for i in range(11)]
FREQUENCIES, CYCLES = np.arange(2.0, 31.0, 2.0), np.linspace(2, 10, 15)
PAD, STEP, CHUNK = 256, 2, 50


def clean(path: str) -> mne.io.BaseRaw:
    raw = mne.io.read_raw_fif(path, preload=True)
    raw.filter(
        1, 40, picks=["eeg", "eog"], l_trans_bandwidth=1, h_trans_bandwidth=1, filter_length="3301ms", pad="edge"
    )
    raw.set_eeg_reference([])
    EOGRegression(picks="eeg", picks_artifact="eog").fit(raw).apply(raw, copy=False)
    raw.pick("eeg")
    value = kurtosis(raw.get_data(), axis=1)
    n = len(value)
    kept = np.sort(value)[max(round(0.1 * n), 1) - 1 : n - round(0.1 * n)]
    z = (value - kept.mean()) / kept.std(ddof=1)
    raw.info["bads"] = [name for name, one in zip(raw.ch_names, z, strict=True) if abs(one) > 2]
    raw.interpolate_bads()
    raw.set_eeg_reference("average")
    return raw


def epochs_of(raw: mne.io.BaseRaw, trials: pd.DataFrame) -> mne.Epochs:
    wanted = ~trials["practice"] & (trials["condition_before"].notna() | trials["condition_after"].notna())
    trials = trials[wanted].reset_index(drop=True)
    onsets = trials["onset_sample"].to_numpy(int)
    events = np.c_[onsets, np.zeros(len(onsets), int), np.ones(len(onsets), int)]
    raw, events = raw.resample(512, events=events)
    return mne.Epochs(
        raw, events, tmin=-0.2, tmax=1.2, baseline=None, reject={"eeg": 2e-3}, metadata=trials, preload=True
    )


def conditions(trials: pd.DataFrame) -> dict[str, np.ndarray]:
    found = {}
    for scenario in ("all", "iC", "sC"):
        inside = np.full(len(trials), True) if scenario == "all" else (trials["scenario"] == scenario).to_numpy()
        for position in ("before", "after"):
            for case in CASES:
                mask = inside & (trials[f"condition_{position}"] == case).to_numpy()
                found[f"{scenario}/{case}_{position}"] = mask
    return found


def ersp(epochs: mne.Epochs, masks: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the mean magnitude of each condition: a transform a condition, as MNE's interface invites.

    Conditions of both scenarios together are their weighted means. A trial is tr−1 of one condition and tr of another,
    so most are transformed twice.
    """
    kernels = morlet(512.0, FREQUENCIES, CYCLES, zero_mean=False)
    gain = np.array([np.abs(np.fft.fft(k, 1 << 16)).max() for k in kernels])
    found = {}
    for name in (name for name in masks if not name.startswith("all/")):
        data = epochs[masks[name]].get_data() * 1e6
        total = 0.0
        for start in range(0, len(data), CHUNK):
            padded = np.pad(data[start : start + CHUNK], ((0, 0), (0, 0), (PAD, PAD)))
            waves = tfr_array_morlet(padded, 512.0, FREQUENCIES, CYCLES, zero_mean=False, output="complex", decim=STEP)
            total = total + np.abs(waves)[..., PAD // STEP : -(PAD // STEP)].sum(axis=0)
        found[name] = 2 * total / gain[:, None] / len(data)
    for name in (name for name in masks if name.startswith("all/")):
        parts = [name.replace("all", scenario) for scenario in ("iC", "sC")]
        found[name] = np.average([found[p] for p in parts], axis=0, weights=[masks[p].sum() for p in parts])
    return found


def features(data: np.ndarray, times: np.ndarray) -> np.ndarray:
    milliseconds = np.round(1000 * times, 3)
    data = data - data[..., (milliseconds >= 0) & (milliseconds < 800)].mean(axis=-1, keepdims=True)
    means = [data[..., (milliseconds >= a) & (milliseconds < b)].mean(axis=-1) for a, b in WINDOWS]
    return np.stack(means, axis=-1).reshape(len(data), -1)


def decode(x: np.ndarray, y: np.ndarray) -> float:
    """Return the balanced accuracy over 10 × 10 folds of the paper's classifier, undersampled in the training folds."""
    rng, rates = np.random.default_rng(0), []
    for train, test in RepeatedStratifiedKFold(n_splits=10, n_repeats=10, random_state=0).split(x, y):
        size = min(np.bincount(y[train]))
        first, second = (x[rng.choice(train[y[train] == label], size, replace=False)] for label in (0, 1))
        spread = 0.1 * (np.cov(first.T) + np.cov(second.T)) + 2 * 0.9 * np.eye(x.shape[1])
        weights = np.linalg.solve(spread, second.mean(0) - first.mean(0))
        decided = x[test] @ weights > weights @ (first.mean(0) + second.mean(0)) / 2
        rates.append(np.mean([np.mean(decided[y[test] == label] == label) for label in (0, 1)]))
    return float(np.mean(rates))


class Clock:
    """Says what each part took, in processor seconds."""

    def __init__(self) -> None:
        self.last = time.process_time()

    def __call__(self, part: str) -> None:
        now = time.process_time()
        print(f"    script: {part} {now - self.last:.1f} s", flush=True)
        self.last = now


def main(raw_path: str, trials_path: str, out: str) -> None:
    mne.set_log_level("error")
    clock = Clock()
    raw = clean(raw_path)
    clock("read and clean")
    epochs = epochs_of(raw, pd.read_parquet(trials_path))
    clock("resample and cut")
    masks = conditions(epochs.metadata)
    data = epochs.get_data() * 1e6
    baseline = (epochs.times >= -0.2 - 1e-6) & (epochs.times <= 1e-6)
    corrected = data - data[..., baseline].mean(axis=-1, keepdims=True)
    erp = {name: corrected[mask].mean(axis=0) for name, mask in masks.items()}
    clock("ERP")
    maps = ersp(epochs, masks)
    clock("ERSP")
    x = features(data, epochs.times)
    scores = {}
    for scenario in ("iC", "sC"):
        for plain, takeover in (("HH", "HR"), ("RR", "RH")):
            one, two = (masks[f"{scenario}/{case}_before"] for case in (plain, takeover))
            scores[f"{scenario}/{plain}vs{takeover}"] = decode(x[one | two], two[one | two].astype(int))
    clock("features and decoding")
    np.savez(out, erp=erp["all/RH_before"], ersp=maps["all/RH_before"], bacc=list(scores.values()))


if __name__ == "__main__":
    main(*sys.argv[1:])
