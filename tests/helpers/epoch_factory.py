"""Epoch artifacts for tests: a small study with a planted effect, written as the stage epoch writes them."""

from __future__ import annotations

from pathlib import Path

import mne
import numpy as np
import pandas as pd

from hrcneuro.io.fif import write_epochs
from hrcneuro.paradigm.conditions import CASES

CHANNELS = ("Fz", "FC1", "FC2", "C3", "Cz", "C4", "Pz", "POz")


def trial_table(rng: np.random.Generator, n: int) -> pd.DataFrame:
    """Return a study's trial rows: both scenarios, cases before and after, errors, gaps."""
    before = rng.choice([*CASES, None], n, p=[0.35, 0.15, 0.3, 0.15, 0.05])
    after = np.concatenate([[None], before[:-1]])
    return pd.DataFrame(
        {
            "event": "move",
            "scenario": np.where(np.arange(n) < n // 2, "sC", "iC"),
            "condition_before": before,
            "condition_after": after,
            "error": rng.random(n) < 0.2,
            "prev_error": rng.random(n) < 0.2,
            "soa_s": np.round(rng.uniform(0.6, 1.2, n), 3),
            "turn": rng.random(n) < 0.4,
        }
    )


def write_subject(
    folder: Path,
    unit: str,
    *,
    seed: int,
    n: int = 60,
    sfreq: float = 128.0,
    effect_uv: float = 0.0,
    channels: tuple[str, ...] = CHANNELS,
    table: pd.DataFrame | None = None,
) -> mne.EpochsArray:
    """Write ``UNIT_epo.fif`` and return it: brain-like noise, a response at Cz, and an effect on RH_before at Fz."""
    rng = np.random.default_rng(seed)
    table = trial_table(rng, n) if table is None else table
    n = len(table)
    times = np.arange(round(-0.2 * sfreq), round(1.2 * sfreq) + 1) / sfreq
    spectrum = rng.standard_normal((n, len(channels), len(times) // 2 + 1, 2)) @ [1, 1j]
    spectrum /= np.maximum(np.arange(spectrum.shape[-1]), 1) ** 0.6
    data = np.fft.irfft(spectrum, len(times))
    data *= 8 / data.std()
    data -= data.mean(axis=1, keepdims=True)
    near_cz = np.exp(-0.5 * np.arange(len(channels)) ** 0.5)
    data += 3 * near_cz[:, None] * np.exp(-(((times - 0.2) / 0.05) ** 2))
    if effect_uv:
        takeover = (table["condition_before"] == "RH").to_numpy()
        bump = effect_uv * np.exp(-(((times - 0.5) / 0.06) ** 2)) * np.exp(-0.4 * np.arange(len(channels)))[:, None]
        data[takeover] += bump * rng.lognormal(0, 0.3, (takeover.sum(), 1, 1))
    info = mne.create_info(list(channels), sfreq, "eeg")
    montage = mne.channels.make_standard_montage("biosemi64")
    places = {c: montage.get_positions()["ch_pos"][c] for c in channels if c in montage.ch_names}
    if places:
        info.set_montage(mne.channels.make_dig_montage(places, coord_frame="head"), on_missing="ignore")
    gaps = table["soa_s"].fillna(1.0) if "soa_s" in table else pd.Series(np.ones(n))
    onsets = 1000 + np.round(np.concatenate([[0], np.cumsum(gaps)[:-1]]) * sfreq).astype(int)
    events = np.column_stack([onsets, np.zeros(n, int), np.ones(n, int)])
    epochs = mne.EpochsArray(
        data * 1e-6, info, events, tmin=times[0], event_id={"move": 1}, metadata=table, verbose="error"
    )
    folder.mkdir(parents=True, exist_ok=True)
    write_epochs(epochs, folder / f"{unit}_epo.fif")
    return epochs
