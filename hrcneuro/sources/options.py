"""What can be set of a simulated subject: the tables [acquire.session], [acquire.timing] and [acquire.eeg].

The fields mirror those of the numeric packages that they are handed to, with help and limits for the configuration;
a test holds the two together. Importing this loads no numeric library.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option
from hrcneuro.eeg.synthetic.params import EFFECTS, SyntheticParams

_EEG = SyntheticParams()


@dataclass(frozen=True)
class Session:
    """The protocol and the partners of a simulated session (paper 2.4)."""

    practice_episodes: int = option(5, "episodes in each of the two practice blocks; 0 for none", low=0)
    blocks: int = option(12, "main blocks; odd ones iC, even ones sC", low=1, high=99)
    episodes_per_block: int = option(13, "episodes in a main block", low=1)
    error_rate: float = option(0.30, "probability that a move after no error goes wrong", low=0, high=1)
    practice_error_rate: float = option(0.22, "the same in practice blocks", low=0, high=1)
    wrong_key_rate: float | None = option(
        None, "share of keys outside the target, roughly: from 0.05 on, less; none: drawn", low=0, high=1
    )
    undo_rate: float | None = option(None, "share of errors that the next key takes back; none: drawn", low=0, high=1)


@dataclass(frozen=True)
class Timing:
    """When moves begin (paper 2.3.1)."""

    t_f_min_s: float = option(0.6, "shortest motion", unit="s", low=0, open_low=True)
    t_f_max_s: float = option(1.2, "longest motion", unit="s", low=0, open_low=True)
    t_f_mean_s: float = option(0.82, "mean duration of a motion", unit="s", low=0, open_low=True)
    t_f_sd_s: float = option(0.12, "its standard deviation", unit="s", low=0)
    reaction_mean_s: float = option(0.23, "a human's mean reaction time", unit="s", low=0)
    reaction_sd_s: float = option(0.07, "its standard deviation", unit="s", low=0)
    soa_min_s: float = option(0.6, "shortest time from onset to onset", unit="s", low=0)
    start_next: str = option("at_rest", "when the next motion may start", choices=("at_rest", "in_radius"))
    lead_in_s: float = option(5.0, "recorded before the first move", unit="s", low=0)
    pause_s: float = option(1.5, "pause between episodes", unit="s", low=0)
    break_s: float = option(8.0, "break between blocks", unit="s", low=0)


@dataclass(frozen=True)
class Eeg:
    """The synthetic recording; amplitudes are medians over subjects, at the channel where they peak."""

    effect: str = option(_EEG.effect, "which moves carry the extra positivity", choices=EFFECTS)
    effect_uv: float | None = option(
        _EEG.effect_uv, "size of the extra; none: the effect's calibrated size", unit="uV", low=0
    )
    sequential_share: float = option(_EEG.sequential_share, "share of the effect that is left in sC", low=0)
    positivity_uv: float = option(_EEG.positivity_uv, "fronto-central positivity after every move", unit="uV", low=0)
    latency_ms: float = option(_EEG.latency_ms, "its latency", unit="ms", low=0)
    latency_sd_ms: float = option(_EEG.latency_sd_ms, "standard deviation of the latency over trials", unit="ms", low=0)
    amplitude_sigma: float = option(_EEG.amplitude_sigma, "sigma of the lognormal amplitude over trials", low=0)
    visual_uv: float = option(_EEG.visual_uv, "occipital response to motion onset", unit="uV", low=0)
    motor_uv: float = option(_EEG.motor_uv, "central response around the human's own moves", unit="uV", low=0)
    error_uv: float = option(_EEG.error_uv, "fronto-central response to a move that goes wrong", unit="uV", low=0)
    background_uv: float = option(_EEG.background_uv, "RMS of the 1/f background, 1-40 Hz", unit="uV", low=0)
    exponent: float = option(_EEG.exponent, "exponent of its power spectrum", low=0)
    dipoles: int = option(_EEG.dipoles, "number of background dipoles", low=1)
    sensor_uv: float = option(_EEG.sensor_uv, "RMS of white sensor noise, 1-40 Hz", unit="uV", low=0)
    alpha_uv: float = option(_EEG.alpha_uv, "RMS of the occipital rhythm", unit="uV", low=0)
    alpha_hz: float = option(_EEG.alpha_hz, "its frequency", unit="Hz", low=0, open_low=True)
    mu_uv: float = option(_EEG.mu_uv, "RMS of the central rhythm at rest", unit="uV", low=0)
    blinks_per_min: float = option(_EEG.blinks_per_min, "blinks a minute", low=0)
    blink_uv: float = option(_EEG.blink_uv, "peak of a blink at the forehead", unit="uV", low=0)
    saccade_uv: float = option(_EEG.saccade_uv, "standard deviation of gaze at the canthi", unit="uV", low=0)
    line_uv: float = option(_EEG.line_uv, "amplitude of the power line's hum", unit="uV", low=0)
    line_hz: float = option(_EEG.line_hz, "its frequency", unit="Hz", low=0, open_low=True)
    drift_uv: float = option(_EEG.drift_uv, "RMS of slow electrode drift", unit="uV", low=0)
    bad_channels: int = option(_EEG.bad_channels, "at most so many channels go bad now and then", low=0, high=27)
    noisy_channels: int = option(_EEG.noisy_channels, "at most so many channels are noisy throughout", low=0, high=27)
    trigger_jitter_ms: float = option(
        _EEG.trigger_jitter_ms, "standard deviation of trigger against movement", unit="ms", low=0
    )
    variability: float = option(_EEG.variability, "scales how much subjects differ; 0 makes them alike", low=0)
