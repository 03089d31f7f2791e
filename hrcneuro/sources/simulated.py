"""Subjects that never sat in the laboratory: simulated moves or a real log, with a synthetic recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.errors import ConfigError, Cures, DataError, cured
from hrcneuro.paradigm.design import MOVE
from hrcneuro.sources.logs import read_log
from hrcneuro.sources.recording import Recording, markers_of

if TYPE_CHECKING:
    from hrcneuro.eeg.synthetic import SyntheticParams
    from hrcneuro.paradigm.params import SessionParams, TimingParams


_TIMING_CURE = (
    "move acquire.timing.t_f_mean_s further inside t_f_min_s and t_f_max_s, or reduce acquire.timing.t_f_sd_s"
)
_ERRORS_CURE = (
    "lower acquire.session.error_rate, practice_error_rate and wrong_key_rate; the study has 0.30, 0.22 and 0.001 to "
    "0.07"
)


def simulate_trials(unit: str, *, session: SessionParams, timing: TimingParams, seed: int) -> pd.DataFrame:
    """Return the annotated moves of a simulated subject, with onset_s and t_f_s.

    Raises:
        ConfigError: So many moves go wrong that an episode does not end, or the durations do not fit their range.
    """
    from hrcneuro.paradigm.episode import EndlessEpisodeError
    from hrcneuro.paradigm.session import simulate_session

    _check_timing(timing)
    with cured({EndlessEpisodeError: (ConfigError, _ERRORS_CURE)}):
        return simulate_session(session, rng=generator(seed, unit, "moves"), timing=timing)


def logged_trials(folder: str, unit: str, *, timing: TimingParams, seed: int) -> pd.DataFrame:
    """Return the annotated moves of a real log, with simulated onset_s and t_f_s.

    Raises:
        DataError: The log is missing, truncated or contradicts its metadata.
        ConfigError: The durations do not fit their range.
    """
    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.paradigm.timing import assign_onsets

    _check_timing(timing)
    log = read_log(Path(folder).expanduser(), unit)
    return annotate(assign_onsets(log, rng=generator(seed, unit, "moves"), params=timing))


def record(
    trials: pd.DataFrame, unit: str, *, eeg: SyntheticParams, sfreq: float, seed: int, contaminated: bool
) -> tuple[Recording, pd.DataFrame, dict[str, Any]]:
    """Return a synthetic recording of the moves, the moves as the recording's triggers time them, and the truth.

    The truth (see ``hrcneuro.eeg.synthetic.Synthetic``) knows the movements' own times.

    Raises:
        ConfigError: The sampling rate is too low for EEG.
        DataError: There are no moves, or their onsets are not in order.
    """
    from hrcneuro.eeg.synthetic import generate
    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.sources.channels import standard_montage

    with cured(_recording_cures()):
        synthetic = generate(
            trials, params=eeg, sfreq=sfreq, rng=generator(seed, unit, "eeg"), contaminated=contaminated
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


def _check_timing(timing: TimingParams) -> None:
    from hrcneuro.paradigm.timing import check_travel

    with cured({ValueError: (ConfigError, _TIMING_CURE)}):
        check_travel(timing)


def _recording_cures() -> Cures:
    from hrcneuro.eeg.refusals import MovesError, SlowSamplingError

    return {
        SlowSamplingError: (ConfigError, "set acquire.sfreq to the study's 1000, or to 128 for a small recording"),
        MovesError: (DataError, "look at the moves: hrcneuro acquire SUBJECT --inspect"),
    }


def generator(seed: int, unit: str, part: str) -> np.random.Generator:
    """Return the generator of one purpose for one subject."""
    # Named by subject and purpose: the order of subjects and the number of workers change nothing.
    return np.random.default_rng([seed, *f"{unit}/{part}".encode()])
