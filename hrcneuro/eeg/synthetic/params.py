"""What can be set of a synthetic recording, and the calibrated size of each effect."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hrcneuro.errors import ConfigError, did_you_mean

EFFECTS = ("anticipation", "post_error", "turn", "both", "none")

# Sizes at which the plain contrast RR against RH in iC comes out as published, 57.1 % (Table 2). Got by running the
# paper's chain (1-40 Hz, EOG regression, kurtosis, interpolation, average reference, 405 features, rLDA with 0.9,
# undersampled 10-fold twice) on 33 recordings at 256 Hz with the moves of the 11 real logs, three seeds each. Mean
# accuracy ± SD over recordings there: anticipation 57.2 ± 3.8, post_error 56.9 ± 2.8, turn 57.1 ± 3.5, both 57.1 ± 3.7,
# none 49.6 ± 2.6. Between 5 and 7 µV of anticipation the accuracy rises by 1.8 points a microvolt. A response to errors
# must be so much larger since 26 % of RR also follow one. Recalibrate when a default below changes.
CALIBRATED_UV: dict[str, float] = {
    "anticipation": 6.2,
    "post_error": 28.0,
    "turn": 8.4,
    "both": 4.6,  # of each
    "none": 0.0,
}


@dataclass(frozen=True)
class SyntheticParams:
    """The synthetic recording's parameters; amplitudes are medians over subjects, at the channel where they peak."""

    effect: str = "anticipation"  # which moves carry the extra positivity
    effect_uv: float | None = None  # size of the extra; None is the effect's calibrated size
    sequential_share: float = (
        0.5  # the share of the effect that is left in sC (paper 4.1: takeovers are foreseen there)
    )
    positivity_uv: float = 4.0  # fronto-central positivity after every move
    latency_ms: float = 500.0
    latency_sd_ms: float = 40.0  # over trials
    amplitude_sigma: float = 0.4  # of the lognormal amplitude over trials
    visual_uv: float = 5.0  # occipital response to motion onset
    motor_uv: float = 3.0  # central response around the human's own moves
    error_uv: float = 7.0  # fronto-central response to a move that goes wrong
    background_uv: float = 7.5  # RMS in 1-40 Hz of the 1/f background, mean over the EEG channels
    exponent: float = 1.3  # of the background's power spectrum
    dipoles: int = 200
    sensor_uv: float = 2.0  # white sensor noise, RMS in 1-40 Hz
    alpha_uv: float = 10.0  # RMS of the occipital rhythm
    alpha_hz: float = 10.0
    mu_uv: float = 3.0  # RMS of the central rhythm at rest, of each hemisphere
    blinks_per_min: float = 14.0
    blink_uv: float = 180.0  # peak at the forehead's EOG channel
    saccade_uv: float = 25.0  # SD of the gaze position, at the canthi
    line_uv: float = 4.0  # amplitude of the power line's hum
    line_hz: float = 50.0
    drift_uv: float = 40.0  # RMS of the electrodes' slow drift
    bad_channels: int = 3  # at most so many channels go bad: flat spells, loose contacts, bursts of muscle
    noisy_channels: int = 1  # at most so many channels are noisy throughout, which kurtosis does not see
    trigger_jitter_ms: float = 2.0  # SD of trigger against movement
    variability: float = 1.0  # scales how much subjects differ; 0 makes them alike

    def __post_init__(self) -> None:
        """Refuse an unknown effect and negative sizes."""
        if self.effect not in EFFECTS:
            raise ConfigError(
                f"no synthetic effect {self.effect!r}{did_you_mean(self.effect, EFFECTS)}; "
                f"there are {', '.join(EFFECTS)}",
                cure=f"use one of them, as in effect = {EFFECTS[0]!r}",
            )
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, int | float) and value < 0:
                raise ConfigError(f"synthetic {f.name} = {value} is negative", cure="give zero or more")

    @property
    def size_uv(self) -> float:
        """The extra positivity in microvolt: as given, or calibrated."""
        return CALIBRATED_UV[self.effect] if self.effect_uv is None else self.effect_uv
