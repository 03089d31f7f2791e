"""What can be set of a synthetic recording, and the calibrated size of each effect."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hrcneuro.contract import option

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
    """The synthetic recording's parameters; amplitudes are medians over subjects, at the channel where they peak.

    In sC takeovers are foreseen (paper §4.1): a share of the effect is left there. The background's RMS is the mean
    over the EEG channels, mu's that of each hemisphere. A bad channel has flat spells, a loose contact or bursts of
    muscle; what a noisy one has, kurtosis does not see.
    """

    effect: str = option("anticipation", "which moves carry the extra positivity", choices=EFFECTS)
    effect_uv: float | None = option(None, "size of the extra; none: the effect's calibrated size", unit="uV", low=0)
    sequential_share: float = option(0.5, "share of the effect that is left in sC", low=0, high=1, share=True)
    positivity_uv: float = option(4.0, "fronto-central positivity after every move", unit="uV", low=0)
    latency_ms: float = option(500.0, "its latency", unit="ms", low=0)
    latency_sd_ms: float = option(40.0, "standard deviation of the latency over trials", unit="ms", low=0)
    amplitude_sigma: float = option(0.4, "sigma of the lognormal amplitude over trials", low=0)
    visual_uv: float = option(5.0, "occipital response to motion onset", unit="uV", low=0)
    motor_uv: float = option(3.0, "central response around the human's own moves", unit="uV", low=0)
    error_uv: float = option(7.0, "fronto-central response to a move that goes wrong", unit="uV", low=0)
    background_uv: float = option(7.5, "RMS of the 1/f background, 1-40 Hz", unit="uV", low=0)
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

    def __post_init__(self) -> None:
        """Refuse an unknown effect and negative sizes."""
        if self.effect not in EFFECTS:
            raise ValueError(f"the effect is {self.effect!r}; allowed: {', '.join(EFFECTS)}")
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, int | float) and value < 0:
                raise ValueError(f"{f.name} = {value} is negative; allowed: 0 or more")

    @property
    def size_uv(self) -> float:
        """The extra positivity in microvolt: as given, or calibrated."""
        return CALIBRATED_UV[self.effect] if self.effect_uv is None else self.effect_uv
