"""Eyes: blinks, gaze shifts, and how both spread over the head."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from hrcneuro.eeg.synthetic.head import CH_NAMES, EOG, head, to_mastoids

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic.params import SyntheticParams

OCULAR = ("blink", "horizontal", "vertical", "lid")
# No two blinks spread alike: the share of a blink's height by which it differs at the brow, unseen by the EOG channels,
# is what regression leaves over.
_LID_SHARE = 0.05
# A blink rises faster than it falls.
_RISE_S, _FALL_S = 0.045, 0.085
_SACCADE_S = 0.012
# What the three EOG channels (left and right canthus, forehead) see of each; the rest of the head decays with distance.
_AT_EOG = {
    "blink": (0.35, 0.35, 1.0),
    "horizontal": (-1.0, 1.0, 0.0),
    "vertical": (-0.15, -0.15, 0.7),
    "lid": (0.0, 0.0, 0.0),
}
_DECAY_M = {"blink": 0.042, "horizontal": 0.045, "vertical": 0.034, "lid": 0.030}
_AT_FRONT = {"blink": 0.8, "horizontal": 0.8, "vertical": 0.6, "lid": 0.8}


def propagation(rng: np.random.Generator, *, variability: float) -> dict[str, np.ndarray]:
    """Return the gains of blink, gaze (two axes) and lid at the 30 channels against the mastoids, each (30,).

    A blink is one at the forehead's EOG channel, gaze to the right is one at the right canthus, before referencing.
    """
    at = head().electrodes
    eog = len(CH_NAMES) - len(EOG)
    eyes = 0.5 * at[eog : eog + 2] + 0.5 * at[eog + 2]  # between canthus and forehead
    distance = np.linalg.norm(at[:, None, :] - eyes[None], axis=2)  # (30, 2): left, right
    gains = {}
    for kind in OCULAR:
        reach = _DECAY_M[kind] * np.exp(0.08 * variability * rng.standard_normal())
        near = np.exp(-distance / reach) / np.exp(-distance[eog:].min() / reach)
        gain = near[:, 1] - near[:, 0] if kind == "horizontal" else near.mean(axis=1)
        gain = gain * np.exp(0.08 * variability * rng.standard_normal(len(CH_NAMES)))
        gain *= _AT_FRONT[kind]
        gain[eog:] = np.array(_AT_EOG[kind]) * np.exp(0.08 * variability * rng.standard_normal(len(EOG)))
        gains[kind] = to_mastoids(gain)
    return gains


def blinks(rng: np.random.Generator, duration_s: float, *, params: SyntheticParams) -> pd.DataFrame:
    """Return a subject's blinks: ``peak_s``, ``amplitude_uv`` at the forehead, ``lid_uv`` of its own at the brow."""
    rate = params.blinks_per_min * np.exp(0.2 * params.variability * rng.standard_normal())
    size = params.blink_uv * np.exp(0.15 * params.variability * rng.standard_normal())
    if rate == 0:
        return pd.DataFrame({"peak_s": np.zeros(0), "amplitude_uv": np.zeros(0), "lid_uv": np.zeros(0)})
    refractory = 0.5
    mean_gap = max(60 / rate - refractory, 0.2)
    gaps = refractory + rng.gamma(1.5, mean_gap / 1.5, int(2 * duration_s / (mean_gap + refractory)) + 20)
    peak = np.cumsum(gaps)
    peak = peak[peak < duration_s - 0.5]
    amplitude = size * np.exp(0.2 * rng.standard_normal(len(peak)))
    lid = _LID_SHARE * amplitude * rng.standard_normal(len(peak))
    return pd.DataFrame({"peak_s": peak, "amplitude_uv": amplitude, "lid_uv": lid})


def blink_course(table: pd.DataFrame, column: str, samples: int, sfreq: float) -> np.ndarray:
    """Return the time course of the blinks' ``amplitude_uv`` or ``lid_uv``, shape (samples,), float32."""
    out = np.zeros(samples)
    before, after = int(5 * _RISE_S * sfreq), int(5 * _FALL_S * sfreq)
    peak = table["peak_s"].to_numpy()
    index = np.round(peak * sfreq).astype(int)[:, None] + np.arange(-before, after + 1)
    lag = index / sfreq - peak[:, None]
    value = table[column].to_numpy()[:, None] * np.exp(-0.5 * (lag / np.where(lag < 0, _RISE_S, _FALL_S)) ** 2)
    inside = (index >= 0) & (index < samples)
    np.add.at(out, index[inside], value[inside])
    return out.astype(np.float32)


def saccades(
    rng: np.random.Generator, duration_s: float, onset_s: np.ndarray, *, params: SyntheticParams
) -> pd.DataFrame:
    """Return a subject's gaze: ``time_s`` of each shift and the position from then on, ``x_uv`` and ``y_uv``.

    The eyes follow four moves of five, some 200 ms after onset, and wander by themselves about every three seconds.
    """
    follow = onset_s[rng.random(len(onset_s)) < 0.8]
    follow = follow + 0.20 + 0.04 * rng.standard_normal(len(follow))
    alone = rng.uniform(0, duration_s, rng.poisson(duration_s / 3))
    time = np.sort(np.concatenate([follow, alone]))
    size = params.saccade_uv * np.exp(0.2 * params.variability * rng.standard_normal())
    gaze = size * rng.standard_normal((2, len(time)))
    return pd.DataFrame({"time_s": time, "x_uv": gaze[0], "y_uv": gaze[1]})


def gaze_course(table: pd.DataFrame, axis: str, samples: int, sfreq: float) -> np.ndarray:
    """Return the gaze position along ``x_uv`` or ``y_uv``, shape (samples,), float32: steps of some 30 ms."""
    at = np.clip(np.round(table["time_s"].to_numpy() * sfreq).astype(int), 0, samples)
    edges = np.concatenate([[0], at, [samples]])
    steps = np.repeat(np.concatenate([[0.0], table[axis].to_numpy()]), np.diff(edges)).astype(np.float32)
    return gaussian_filter1d(steps, _SACCADE_S * sfreq, mode="nearest")
