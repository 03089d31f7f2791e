"""A synthetic recording without an end, sample after sample: rest that repeats, and what moves evoke as they happen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.eeg.synthetic import responses
from hrcneuro.eeg.synthetic.generator import generate
from hrcneuro.eeg.synthetic.head import CH_NAMES
from hrcneuro.eeg.synthetic.params import SyntheticParams

_REST_S = 120.0  # after so long its rest repeats
_FADE_S = 2.0
_AHEAD_S = 4.0  # what a move evokes is over by then
_MISSING = {"actor": None, "scenario": "iC", "error": False, "prev_error": False, "turn": False}


class Endless:
    """The EEG of one subject, in µV against the mean of TP9 and TP10.

    Attributes:
        sfreq: Sampling rate, Hz.
        taken: Samples that were taken so far.
    """

    ch_names = CH_NAMES

    def __init__(self, *, params: SyntheticParams, sfreq: float, rng: np.random.Generator, sitting: int = 0) -> None:
        """Make a subject, and some minutes of its rest.

        Args:
            params: What is planted.
            sfreq: Sampling rate, Hz.
            rng: The subject's generator.
            sitting: As :func:`~hrcneuro.eeg.synthetic.generator.generate` has it.
        """
        self.sfreq, self.taken, self._params = sfreq, 0, params
        self._draws, made = rng.spawn(2)
        still = replace(params, effect="none", positivity_uv=0.0, visual_uv=0.0, motor_uv=0.0, error_uv=0.0)
        # One move that evokes nothing: a recording ends five seconds after its last one.
        nothing = pd.DataFrame([{**_MISSING, "onset_s": _REST_S + _FADE_S - 5.0, "condition_before": None}])
        rest = generate(nothing, params=still, sfreq=sfreq, rng=made, sitting=sitting)
        self._rest = _joined_ends(rest.data_uv, round(_FADE_S * sfreq))
        gains: pd.DataFrame = rest.truth["topographies"]
        self._gains = {name: gains[name].to_numpy(np.float32) for name in responses.COMPONENTS}
        self._subject = responses.own_values(params=params, rng=self._draws)
        if sitting:
            self._draws = self._draws.spawn(sitting)[-1]
        # Twice what lies ahead, so that what was taken is shifted out now and then only.
        self._ahead = round(_AHEAD_S * sfreq)
        self._evoked, self._past = np.zeros((len(CH_NAMES), 2 * self._ahead), np.float32), 0

    def take(self, n: int) -> np.ndarray:
        """Return the next samples: ndarray, shape (n, 30), float32, µV."""
        at = (self.taken + np.arange(n)) % self._rest.shape[1]
        data = self._rest[:, at]
        known = min(n, self._ahead)
        data[:, :known] += self._evoked[:, self._past : self._past + known]
        self._past += known
        if self._past > self._ahead:
            left = self._evoked.shape[1] - self._past
            self._evoked[:, :left] = self._evoked[:, self._past :]
            self._evoked[:, left:] = 0
            self._past = 0
        self.taken += n
        return data.T

    def evoke(self, onset: float, move: Mapping[str, Any], *, only: tuple[str, ...] = responses.COMPONENTS) -> None:
        """Let a move evoke what it does, as far as that lies ahead.

        Args:
            onset: Of its movement, in samples from the first one that was taken.
            move: ``actor error prev_error condition_before turn scenario`` as in trials.parquet; what is not given
                evokes nothing.
            only: Names of the responses.
        """
        row = pd.DataFrame([{**_MISSING, "condition_before": None, **move}])
        table = responses.evoked(row, self._subject, params=self._params, rng=self._draws)
        begin = (onset - self.taken) / self.sfreq
        for name in only:
            wave = responses.course(name, table, np.array([begin]), self._ahead, self.sfreq)
            self._evoked[:, self._past : self._past + self._ahead] += self._gains[name][:, None] * wave


def _joined_ends(data: np.ndarray, fade: int) -> np.ndarray:
    """Return data that can be repeated: its last ``fade`` samples pass over into its first ones, at equal power."""
    body, tail = data[:, :-fade].copy(), data[:, -fade:]
    rising = np.sin(0.5 * np.pi * (np.arange(fade) + 0.5) / fade).astype(np.float32)
    falling = np.sqrt(1 - rising**2)
    # Offsets of the electrodes do not fade at equal power: they are the same at both ends, and stay.
    level = data.mean(axis=1, keepdims=True)
    body[:, :fade] = level + rising * (body[:, :fade] - level) + falling * (tail - level)
    return body
