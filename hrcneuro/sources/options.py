"""What can be set of a simulated subject: the tables [acquire.session], [acquire.timing] and [acquire.eeg].

The fields mirror those of the numeric packages that they are handed to, with help and limits for the configuration;
a test holds the two together. Importing this loads no numeric library.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option

EFFECTS = ("anticipation", "post_error", "turn", "both", "none")


@dataclass(frozen=True)
class Session:
    """The protocol and the partners of a simulated session (paper 2.4)."""

    practice_episodes: int = option(5, "episodes in each of the two practice blocks; 0 for none", low=0)
    blocks: int = option(12, "main blocks; odd ones iC, even ones sC", low=1, high=99)
    episodes_per_block: int = option(13, "episodes in a main block", low=1)
    error_rate: float = option(0.30, "probability that a move after no error goes wrong", low=0, high=1)
    practice_error_rate: float = option(0.22, "the same in practice blocks", low=0, high=1)
    wrong_key_rate: float | None = option(None, "share of keys outside the target; none: drawn", low=0, high=1)
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

    effect: str = option("anticipation", "which moves carry the extra positivity", choices=EFFECTS)
    effect_uv: float | None = option(None, "size of the extra; none: the effect's calibrated size", unit="uV", low=0)
    sequential_share: float = option(0.5, "share of the effect that is left in sC", low=0)
    positivity_uv: float = option(4.0, "fronto-central positivity after every move", unit="uV", low=0)
    latency_ms: float = option(500.0, "its latency", unit="ms", low=0)
    latency_sd_ms: float = option(40.0, "standard deviation of the latency over trials", unit="ms", low=0)
    amplitude_sigma: float = option(0.4, "sigma of the lognormal amplitude over trials", low=0)
    visual_uv: float = option(5.0, "occipital response to motion onset", unit="uV", low=0)
    motor_uv: float = option(3.0, "central response around the human's own moves", unit="uV", low=0)
    error_uv: float = option(7.0, "fronto-central response to a move that goes wrong", unit="uV", low=0)
    background_uv: float = option(8.5, "RMS of the 1/f background, 1-40 Hz", unit="uV", low=0)
    exponent: float = option(1.3, "exponent of its power spectrum", low=0)
    dipoles: int = option(200, "number of background dipoles", low=1)
    sensor_uv: float = option(2.0, "RMS of white sensor noise, 1-40 Hz", unit="uV", low=0)
    alpha_uv: float = option(10.0, "RMS of the occipital rhythm", unit="uV", low=0)
    alpha_hz: float = option(10.0, "its frequency", unit="Hz", low=0, open_low=True)
    mu_uv: float = option(3.0, "RMS of the central rhythm at rest", unit="uV", low=0)
    blinks_per_min: float = option(14.0, "blinks a minute", low=0)
    blink_uv: float = option(180.0, "peak of a blink at the forehead", unit="uV", low=0)
    saccade_uv: float = option(25.0, "standard deviation of gaze at the canthi", unit="uV", low=0)
    line_uv: float = option(4.0, "amplitude of the power line's hum", unit="uV", low=0)
    line_hz: float = option(50.0, "its frequency", unit="Hz", low=0, open_low=True)
    drift_uv: float = option(40.0, "RMS of slow electrode drift", unit="uV", low=0)
    bad_channels: int = option(3, "at most so many channels go bad now and then", low=0, high=27)
    noisy_channels: int = option(1, "at most so many channels are noisy throughout", low=0, high=27)
    trigger_jitter_ms: float = option(2.0, "standard deviation of trigger against movement", unit="ms", low=0)
    variability: float = option(1.0, "scales how much subjects differ; 0 makes them alike", low=0)
