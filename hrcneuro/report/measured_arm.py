"""This run's figures on the timing of the arm and its markers (paper 2.3.4)."""

from __future__ import annotations

import math

import numpy as np

from hrcneuro import published
from hrcneuro.decoding.features import FINE_S
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Measured

# An average over trials whose onsets jitter by this SD keeps the highest frequency of the pass band at 3 dB:
# exp(-(2 pi f sd)^2 / 2) = sqrt(1/2).
_MOST_SD_MS = 1000 * math.sqrt(math.log(2)) / (2 * math.pi * published.PASS_BAND_HZ.value[1])
# A constant latency shifts every result by itself; half of the decoder's shortest window leaves it in its window.
_MOST_LATENCY_MS = 1000 * (FINE_S[0][1] - FINE_S[0][0]) / 2


def measure(results: Results) -> dict[str, Measured]:
    """Return the key of a claim -> what this run has on it: from the arm's motion to the marker in the recording."""
    moves = results.tables("robot", "moves.parquet").values()
    # A stim channel shows a marker with its next sample; without a known rate the marker itself is all there is.
    latency = [
        (t["stim_latency_ms"].astype(float).fillna(t["marker_latency_ms"].astype(float)) - t["trigger_latency_ms"])
        for t in moves
    ]
    values = np.concatenate([one.dropna().to_numpy(float) for one in latency]) if latency else np.zeros(0)
    if len(values) < 2:
        return {}
    mean, sd = float(values.mean()), float(values.std(ddof=1))
    text = f"marker {mean:.1f} ± {sd:.1f} ms after the motion's onset, {len(values)} moves"
    agrees = abs(mean) <= _MOST_LATENCY_MS and sd <= _MOST_SD_MS
    why = (
        f"mean within ± {_MOST_LATENCY_MS:g} ms, half of the decoder's shortest window; SD at most "
        f"{_MOST_SD_MS:.1f} ms, which leaves {published.PASS_BAND_HZ.value[1]:g} Hz in an average at 3 dB"
    )
    return {"timing": Measured(text, agrees, "arm", why, value=mean, unit="ms")}
