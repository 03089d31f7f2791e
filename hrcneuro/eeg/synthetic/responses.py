"""What a move evokes, which moves carry the extra positivity, and the average that all this amounts to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.eeg.synthetic.head import CH_NAMES, site, topography

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic.params import SyntheticParams

# Each response is a sum of Gaussians: (weight, centre in s after onset, SD in s). The positivity's centre is a trial's
# latency, so it stands at zero here.
WAVES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "visual": ((0.4, 0.105, 0.016), (-1.0, 0.170, 0.024), (0.7, 0.250, 0.038)),
    "motor": ((-1.0, -0.020, 0.050), (0.6, 0.110, 0.045)),
    "positivity": ((1.0, 0.0, 0.070),),
    "error": ((-0.6, 0.250, 0.032), (1.0, 0.330, 0.042), (-0.4, 0.440, 0.050)),
}
COMPONENTS = tuple(WAVES)
_REACH_S = 5.0  # in SDs: where a Gaussian is cut off


def flag(trials: pd.DataFrame, column: str) -> np.ndarray:
    """Return a column of truth values as bool, shape (n,); what is missing counts as false."""
    values = trials[column]
    return np.array([bool(v) if not pd.isna(v) else False for v in values], dtype=bool)


def is_(trials: pd.DataFrame, column: str, value: str) -> np.ndarray:
    """Return where a column of strings has the value, bool, shape (n,); what is missing differs from everything."""
    return np.array([isinstance(v, str) and v == value for v in trials[column]], dtype=bool)


def carries(trials: pd.DataFrame, effect: str) -> np.ndarray:
    """Return how many times each move carries the effect's extra positivity, shape (n,), float (0, 1; both: up to 2).

    anticipation: the human takes over with the next move. post_error: the move before was an error, whoever acts next.
    turn: the next target differs, whoever acts. both: anticipation and post_error, added.
    """
    ahead = is_(trials, "condition_before", "RH")
    if effect == "anticipation":
        return ahead.astype(float)
    if effect == "post_error":
        return flag(trials, "prev_error").astype(float)
    if effect == "turn":
        return flag(trials, "turn").astype(float)
    if effect == "both":
        return ahead.astype(float) + flag(trials, "prev_error")
    return np.zeros(len(trials))


def topographies(rng: np.random.Generator, *, variability: float) -> dict[str, np.ndarray]:
    """Return each response's gain at the 30 channels against the mastoids, peak one, with a subject's own place."""
    jitter = 0.006 * variability
    straight = np.zeros(3)
    front = site("Fz") + site("Cz")
    front /= np.sqrt(np.sum(front**2))
    back = site("O1") + site("O2")
    back /= np.sqrt(np.sum(back**2))
    left = site("C3")
    return {
        "visual": topography(back, depth=0.70, tilt=straight, jitter_m=jitter, rng=rng),
        "motor": topography(left, depth=0.75, tilt=straight, jitter_m=jitter, rng=rng),
        "positivity": topography(front, depth=0.60, tilt=straight, jitter_m=jitter, rng=rng),
        "error": topography(front, depth=0.55, tilt=0.3 * site("Fz"), jitter_m=jitter, rng=rng),
    }


def single_trials(
    trials: pd.DataFrame, *, params: SyntheticParams, rng: np.random.Generator
) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return what every move evokes (a row a move: amplitudes in µV, latency in ms) and the subject's own values."""
    subject = own_values(params=params, rng=rng)
    return evoked(trials, subject, params=params, rng=rng), subject


def own_values(*, params: SyntheticParams, rng: np.random.Generator) -> dict[str, Any]:
    """Return a subject's own amplitudes, in µV, and latency, in ms."""
    own = params.variability * rng.standard_normal(6)
    return {
        "effect_uv": params.size_uv * float(np.exp(0.2 * own[0] - 0.02 * params.variability**2)),
        "positivity_uv": params.positivity_uv * float(np.exp(0.2 * own[1])),
        "visual_uv": params.visual_uv * float(np.exp(0.2 * own[2])),
        "error_uv": params.error_uv * float(np.exp(0.2 * own[3])),
        "motor_uv": params.motor_uv * float(np.exp(0.2 * own[4])),
        "latency_ms": params.latency_ms + 15.0 * float(own[5]),
    }


def evoked(
    trials: pd.DataFrame, subject: Mapping[str, Any], *, params: SyntheticParams, rng: np.random.Generator
) -> pd.DataFrame:
    """Return what every move evokes in a subject with these values: a row a move, amplitudes in µV, latency in ms."""
    n = len(trials)
    times = carries(trials, params.effect)
    share = np.where(is_(trials, "scenario", "sC"), params.sequential_share, 1.0)
    sigma = params.amplitude_sigma
    spread = np.exp(sigma * rng.standard_normal(n) - sigma**2 / 2)  # mean one
    jitter = np.exp(0.25 * rng.standard_normal((3, n)) - 0.25**2 / 2)
    extra = subject["effect_uv"] * times * share
    return pd.DataFrame(
        {
            "carries": times > 0,
            "extra_uv": extra * spread,
            "positivity_uv": (subject["positivity_uv"] + extra) * spread,
            "latency_ms": subject["latency_ms"] + params.latency_sd_ms * rng.standard_normal(n),
            "visual_uv": subject["visual_uv"] * jitter[0],
            "motor_uv": is_(trials, "actor", "human") * subject["motor_uv"] * jitter[1],
            "error_uv": flag(trials, "error") * subject["error_uv"] * jitter[2],
        }
    )


def course(component: str, table: pd.DataFrame, onset_s: np.ndarray, samples: int, sfreq: float) -> np.ndarray:
    """Return a response's continuous time course over all moves in µV, shape (samples,), float32."""
    out = np.zeros(samples)
    amplitude = table[f"{component}_uv"].to_numpy()
    delay = table["latency_ms"].to_numpy() / 1000 if component == "positivity" else np.zeros(len(table))
    live = amplitude != 0
    for weight, centre, width in WAVES[component]:
        peak_s = (onset_s + delay + centre)[live]
        reach = int(np.ceil(_REACH_S * width * sfreq))
        index = np.round(peak_s * sfreq).astype(int)[:, None] + np.arange(-reach, reach + 1)
        value = weight * amplitude[live, None] * np.exp(-0.5 * ((index / sfreq - peak_s[:, None]) / width) ** 2)
        inside = (index >= 0) & (index < samples)
        np.add.at(out, index[inside], value[inside])
    return out.astype(np.float32)


def planted_average(truth: Mapping[str, Any], times: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Return the average that was planted in some moves, shape (30, len(times)), µV against the mastoids.

    Args:
        truth: A recording's ground truth.
        times: Seconds relative to the movement's onset.
        rows: Truth values or indices that pick moves; None takes all.

    The next move's response is not in it.
    """
    table = (
        truth["trials"] if rows is None else truth["trials"].iloc[np.flatnonzero(rows) if rows.dtype == bool else rows]
    )
    total = np.zeros((len(CH_NAMES), len(times)))
    for component in COMPONENTS:
        amplitude = table[f"{component}_uv"].to_numpy()
        delay = table["latency_ms"].to_numpy() / 1000 if component == "positivity" else np.zeros(len(table))
        mean = np.zeros(len(times))
        for weight, centre, width in WAVES[component]:
            gauss = np.exp(-0.5 * ((times[None, :] - delay[:, None] - centre) / width) ** 2)
            mean += weight * (amplitude[:, None] * gauss).mean(axis=0)
        total += truth["topographies"][component].to_numpy()[:, None] * mean
    return total
