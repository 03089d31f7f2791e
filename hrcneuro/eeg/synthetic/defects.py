"""What goes wrong: flat spells, loose contacts, muscle, broadband noise, and a whole recording like s07's."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hrcneuro.eeg.synthetic.background import frequencies, shaped_noise, slow_gain
from hrcneuro.eeg.synthetic.head import CH_NAMES, EEG, MASTOIDS

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic.params import SyntheticParams

Spans = list[tuple[float, float]]
_MUSCLE_HZ = (18.0, 150.0)
# SD of the log amplitude over time of what is there throughout: its kurtosis is then that of any other channel.
_WAXING = 0.18


def plant(rng: np.random.Generator, data_uv: np.ndarray, sfreq: float, *, params: SyntheticParams) -> pd.DataFrame:
    """Spoil some EEG channels of ``data_uv`` (30 × samples, µV) in place; return what was done.

    A row a span: ``channel``, ``kind``, ``intermittent`` (kurtosis can see it), ``start_s``, ``stop_s``. The mastoids
    are spared: as the reference they would spoil every channel.
    """
    free = [i for i in range(len(EEG)) if i not in MASTOIDS]
    bad = int(rng.integers(params.bad_channels + 1))
    noisy = int(rng.integers(params.noisy_channels + 1))
    picked = rng.permutation(free)[: bad + noisy]
    rows = []
    for k, channel in enumerate(picked):
        kinds = INTERMITTENT if k < bad else THROUGHOUT
        kind = list(kinds)[int(rng.integers(len(kinds)))]
        for start, stop in kinds[kind](rng, data_uv[channel], sfreq):
            rows.append((CH_NAMES[channel], kind, k < bad, start, stop))
    columns = ["channel", "kind", "intermittent", "start_s", "stop_s"]
    types = {"channel": object, "kind": object, "intermittent": bool, "start_s": float, "stop_s": float}
    return pd.DataFrame(rows, columns=columns).astype(types)


def flat(rng: np.random.Generator, row: np.ndarray, sfreq: float) -> Spans:
    """Hold the channel at a constant, off its level, for some spells of 5 to 30 s; return them."""
    spans = _spans(rng, len(row) / sfreq, count=int(rng.integers(3, 9)), low_s=5.0, high_s=30.0)
    for start, stop in spans:
        a, b = int(start * sfreq), int(stop * sfreq)
        row[a:b] = row[a] + rng.choice([-1.0, 1.0]) * rng.uniform(200.0, 500.0)
    return spans


def loose(rng: np.random.Generator, row: np.ndarray, sfreq: float) -> Spans:
    """Add pops of a loose contact, jumps that decay within a second, in some spells; return these."""
    spans = _spans(rng, len(row) / sfreq, count=int(rng.integers(4, 11)), low_s=4.0, high_s=20.0)
    for start, stop in spans:
        a, b = int(start * sfreq), int(stop * sfreq)
        t = np.arange(b - a) / sfreq
        for at in rng.uniform(0, stop - start, max(int(1.2 * (stop - start)), 1)):
            height = rng.choice([-1.0, 1.0]) * rng.uniform(150.0, 500.0)
            row[a:b] += (
                np.where(t >= at, height, 0.0) * np.exp(-np.maximum(t - at, 0.0) / rng.uniform(0.1, 0.5))
            ).astype(np.float32)
    return spans


def muscle_bursts(rng: np.random.Generator, row: np.ndarray, sfreq: float) -> Spans:
    """Add bursts of muscle of 0.5 to 4 s; return them."""
    spans = _spans(rng, len(row) / sfreq, count=int(rng.integers(20, 61)), low_s=0.5, high_s=4.0)
    for start, stop in spans:
        a, b = int(start * sfreq), int(stop * sfreq)
        burst = _muscle(rng, b - a, sfreq) * np.hanning(b - a).astype(np.float32)
        row[a:b] += np.float32(rng.uniform(40.0, 90.0)) * burst
    return spans


def muscle(rng: np.random.Generator, row: np.ndarray, sfreq: float) -> Spans:
    """Add muscle throughout the recording; return its span."""
    noise = _muscle(rng, len(row), sfreq) * slow_gain(rng, len(row), sfreq, spread=_WAXING, every_s=10.0)
    row += np.float32(rng.uniform(8.0, 20.0)) * noise
    return [(0.0, len(row) / sfreq)]


def broadband(rng: np.random.Generator, row: np.ndarray, sfreq: float) -> Spans:
    """Add white noise throughout the recording, as from a bad gel bridge; return its span."""
    f = frequencies(len(row), sfreq)
    noise = shaped_noise(rng, np.ones_like(f), len(row), sfreq)
    row += np.float32(rng.uniform(10.0, 25.0)) * noise * slow_gain(rng, len(row), sfreq, spread=_WAXING, every_s=10.0)
    return [(0.0, len(row) / sfreq)]


Defect = Callable[[np.random.Generator, np.ndarray, float], Spans]
INTERMITTENT: dict[str, Defect] = {"flat": flat, "loose": loose, "muscle_bursts": muscle_bursts}
THROUGHOUT: dict[str, Defect] = {"muscle": muscle, "broadband": broadband}


def contaminate(rng: np.random.Generator, data_uv: np.ndarray, sfreq: float) -> pd.DataFrame:
    """Add jolts of millivolts to every channel in place, about one in six seconds; return their spans.

    That is how s07 is thought to have gone: the head or the cables move, each channel in its own measure.
    """
    duration = data_uv.shape[1] / sfreq
    starts = np.cumsum(rng.gamma(2.0, 3.0, int(duration / 6 * 1.5) + 10))
    starts = starts[starts < duration - 2.0]
    lengths = rng.uniform(0.5, 1.5, len(starts))
    susceptible = np.exp(0.6 * rng.standard_normal(len(CH_NAMES)))
    for start, length in zip(starts, lengths, strict=True):
        a, b = int(start * sfreq), int((start + length) * sfreq)
        t = np.linspace(0, 1, b - a)
        swing = np.sin(np.pi * t) * np.sin(2 * np.pi * rng.uniform(1.5, 6.0) * length * t + rng.uniform(0, 2 * np.pi))
        gain = 2000.0 * np.exp(0.4 * rng.standard_normal()) * susceptible * rng.standard_normal(len(CH_NAMES))
        gain -= gain[list(MASTOIDS)].mean()
        data_uv[:, a:b] += (gain[:, None] * swing).astype(np.float32)
    return pd.DataFrame({"start_s": starts, "stop_s": starts + lengths})


def no_jolts() -> pd.DataFrame:
    """Return the table of jolts of a recording that has none."""
    return pd.DataFrame({"start_s": np.zeros(0), "stop_s": np.zeros(0)})


def _muscle(rng: np.random.Generator, samples: int, sfreq: float) -> np.ndarray:
    """Return muscle noise with an RMS of one within 1-40 Hz, shape (samples,): flat from 18 to 150 Hz."""
    f = frequencies(samples, sfreq)
    low, high = _MUSCLE_HZ
    return shaped_noise(rng, ((f >= low) & (f <= high)).astype(np.float32), samples, sfreq)


def _spans(rng: np.random.Generator, duration_s: float, *, count: int, low_s: float, high_s: float) -> Spans:
    """Return spells in temporal order that do not overlap, at most a quarter of the recording in all."""
    spans: Spans = []
    left = duration_s / 4
    for _ in range(count):
        length = min(rng.uniform(low_s, high_s), duration_s / 10)
        start = rng.uniform(0, duration_s - length)
        if length <= left and all(start > b or start + length < a for a, b in spans):
            spans.append((float(start), float(start + length)))
            left -= length
    return sorted(spans)
