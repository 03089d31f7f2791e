"""Subjects that never sat in the laboratory: simulated moves or a real log, with a synthetic recording."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.sources import options
from hrcneuro.sources.logs import read_log
from hrcneuro.sources.recording import Recording, markers_of
from hrcneuro.sources.trials import MOVE

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic import Synthetic


def simulate_trials(unit: str, *, session: options.Session, timing: options.Timing, seed: int) -> pd.DataFrame:
    """Return the annotated moves of a simulated subject, with onset_s and t_f_s."""
    from hrcneuro.paradigm.session import SessionParams, simulate_session

    params = SessionParams(**dataclasses.asdict(session), timing=_timing(timing))
    return simulate_session(params, rng=_rng(seed, unit, "moves"))


def logged_trials(folder: str, unit: str, *, timing: options.Timing, seed: int) -> pd.DataFrame:
    """Return the annotated moves of a real log, with simulated onset_s and t_f_s.

    Raises:
        DataError: The log is missing, truncated or contradicts its metadata.
    """
    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.paradigm.timing import assign_onsets

    log = read_log(Path(folder).expanduser(), unit)
    return annotate(assign_onsets(log, rng=_rng(seed, unit, "moves"), params=_timing(timing)))


def record(
    trials: pd.DataFrame, unit: str, *, eeg: options.Eeg, sfreq: float, seed: int, contaminated: bool
) -> tuple[Recording, pd.DataFrame, dict[str, Any]]:
    """Return a synthetic recording of the moves, the moves as the recording's triggers time them, and the truth.

    The truth (see ``hrcneuro.eeg.synthetic.Synthetic``) knows the movements' own times.
    """
    from hrcneuro.eeg.synthetic import SyntheticParams, generate
    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.sources.channels import standard_montage

    synthetic: Synthetic = generate(
        trials,
        params=SyntheticParams(**dataclasses.asdict(eeg)),
        sfreq=sfreq,
        rng=_rng(seed, unit, "eeg"),
        contaminated=contaminated,
    )
    onsets_s = synthetic.onset_samples / sfreq
    volts = synthetic.data_uv.astype(np.float64)
    volts *= 1e-6
    recording = Recording(
        volts,
        list(synthetic.ch_names),
        list(synthetic.ch_types),
        sfreq,
        markers_of(onsets_s, [MOVE] * len(onsets_s)),
        montage=standard_montage(),
    )
    return recording, annotate(trials.assign(onset_s=onsets_s)), synthetic.truth


def _timing(timing: options.Timing) -> Any:
    from hrcneuro.paradigm.timing import TimingParams

    return TimingParams(**dataclasses.asdict(timing))


def _rng(seed: int, unit: str, part: str) -> np.random.Generator:
    # Named by subject and purpose: the order of subjects and the number of workers change nothing.
    return np.random.default_rng([seed, *f"{unit}/{part}".encode()])
