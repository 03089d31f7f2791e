"""What can be set of the chain that cleans a recording. Light to import: no numeric library is needed for it."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.contract import option

FILTERS = ("zero_phase", "causal")
TRANSITIONS = ("achieved", "requested")
SPLINES = ("eeglab", "perrin")


@dataclass(frozen=True)
class CleaningParams:
    """The chain's parameters (paper §2.3.3); the defaults are the paper's."""

    l_freq: float = option(
        published.PASS_BAND_HZ.value[0], "lower edge of the pass band", unit="Hz", low=0, open_low=True
    )
    h_freq: float = option(
        published.PASS_BAND_HZ.value[1], "upper edge of the pass band", unit="Hz", low=0, open_low=True
    )
    sfreq: float = option(
        published.CLEAN_HZ.value, "sampling rate to come down to; a slower recording keeps its own", unit="Hz", low=1
    )
    filter: str = option(
        "zero_phase",
        "zero_phase: EEGLAB's windowed sinc; causal: first-order high-pass, fourth-order low-pass; sfreq looks ahead",
        choices=FILTERS,
    )
    transition: str = option(
        "achieved",
        "transition bands of zero_phase: as the order makes them, or as asked for (pop_eegfiltnew without an order)",
        choices=TRANSITIONS,
    )
    causal_l_freq: float = option(0.1, "high-pass of the causal filter", unit="Hz", low=0, open_low=True)
    eog: str = option("regression", "how eye movements are removed", choices=("regression", "none"))
    eog_offset: bool = option(
        True, "the regression also removes each channel's mean, as BIOSIG's does; false: as MNE's EOGRegression"
    )
    bad_channels: str = option("kurtosis", "how contaminated channels are found", choices=("kurtosis", "none"))
    threshold: float = option(
        published.KURTOSIS_SD.value,
        "channels whose normalised kurtosis lies further from the mean are bad",
        unit="SD",
        low=0,
        open_low=True,
    )
    noisy: str = option(
        "flag",
        "steadily noisy channels (PREP): flagged in quality.parquet and nothing more, or replaced as bad ones are",
        choices=("flag", "replace"),
    )
    noisy_deviation: float = option(
        5.0,
        "channels whose robust SD lies further from that of the others are noisy",
        unit="SD",
        low=0,
        open_low=True,
    )
    noisy_correlation: float = option(
        0.4, "a second in which no other channel correlates as well counts against a channel", low=0, high=1
    )
    noisy_share: float = option(
        0.01, "channels with more than this share of such seconds are noisy", low=0, high=1, share=True
    )
    interpolation: str = option(
        "eeglab",
        "splines for bad channels: as EEGLAB computes them, or Perrin's (MNE; better for new studies)",
        choices=SPLINES,
    )
    unplaced: str = option(
        "error", "what becomes of a bad channel whose position is unknown", choices=("error", "drop", "keep")
    )
    reference: str = option("average", "reference of the clean EEG; none: as recorded", choices=("average", "none"))


@dataclass(frozen=True)
class CausalOptions:
    """How a recording is seen as a stream is, by the stages that do so; :mod:`hrcneuro.eeg.causal` is the chain."""

    l_freq: float = option(0.1, "first-order high-pass of the causal filter", unit="Hz", low=0, open_low=True)
    h_freq: float = option(
        published.PASS_BAND_HZ.value[1],
        "fourth-order low-pass of the causal filter",
        unit="Hz",
        low=0,
        open_low=True,
    )
    interpolation: str = option(
        "eeglab", "splines for the channels that preprocess calls bad, as a stream sees them", choices=SPLINES
    )
    reference: str = option(
        "average", "reference of the EEG as a stream sees it; none: as recorded", choices=("average", "none")
    )
    reject_uv: float = option(
        published.IMPLAUSIBLE_UV.value,
        "a trial whose causal epoch has a larger deviation from a channel's 0-600 ms mean is an artefact",
        unit="µV",
        low=0,
        open_low=True,
    )

    def of_band(self) -> list[str]:
        """Return what is contradictory in the edges of the filter."""
        if self.l_freq < self.h_freq:
            return []
        return [f"l_freq = {self.l_freq:g} Hz must lie below h_freq = {self.h_freq:g} Hz"]
