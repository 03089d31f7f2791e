"""Clean the EEG (paper §2.3.3): band-pass, eye movements, bad channels, common average, down-sampling."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Inputs, Read, Stage, Work, option
from hrcneuro.eeg.params import CleaningParams
from hrcneuro.errors import ConfigError, Cures, DataError, cured

if TYPE_CHECKING:
    import mne
    import numpy as np

    from hrcneuro.eeg.cleaning import Cleaned, Signals


_LOOK = "look at the recording: hrcneuro acquire SUBJECT --inspect"


@dataclass(frozen=True)
class Config(CleaningParams):
    """Options of the stage; the defaults are the paper's."""

    keep_steps: bool = option(False, "write the EEG after every step to steps.npz (large)")


def check(config: Config) -> list[str]:
    """Return what contradicts itself in the options."""
    mistakes = []
    low = ("causal_l_freq", config.causal_l_freq) if config.filter == "causal" else ("l_freq", config.l_freq)
    if low[1] >= config.h_freq:
        mistakes.append(f"preprocess.{low[0]} = {low[1]:g} Hz must lie below preprocess.h_freq = {config.h_freq:g} Hz")
    if config.h_freq >= config.sfreq / 2:
        mistakes.append(
            f"preprocess.h_freq = {config.h_freq:g} Hz must lie below half of preprocess.sfreq = {config.sfreq:g} Hz"
        )
    return mistakes


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Clean one subject's recording.

    Raises:
        DataError: The recording cannot be cleaned: no EEG, no EOG, samples that are no numbers, all channels bad.
        ConfigError: The pass band does not fit the recording's sampling rate.
    """
    from contextlib import ExitStack

    import numpy as np

    from hrcneuro.eeg.cleaning import clean
    from hrcneuro.eeg.spectrum import power_spectra
    from hrcneuro.io.fif import read_raw, write_raw
    from hrcneuro.tables import quality as files

    raw = read_raw(inputs.path("acquire", "{unit}_raw.fif"))
    signals = _signals(raw, config)
    n_source = signals.data.shape[1]
    # Samples that are no numbers are refused below, with their place.
    with np.errstate(invalid="ignore", over="ignore"):
        recorded = power_spectra(signals.eeg, signals.sfreq, borders=signals.borders)
    with ExitStack() as stack:
        keep = stack.enter_context(files.Steps(out / "steps.npz")) if config.keep_steps else None
        with cured(_cures()):
            cleaned = clean(signals, config, **({"on_step": keep.add} if keep else {}))
        if keep:
            keep.describe(signals, cleaned, _taps(config, raw.info["sfreq"]))
    files.write_quality(cleaned, signals, out)
    files.write_timing(cleaned, n_source, out)
    borders = [cleaned.ratio.first(border) for border in signals.borders]
    files.write_spectrum(
        {
            "recorded": (signals.eeg_names, *recorded),
            "clean": (
                [name for name, left_out in zip(signals.eeg_names, cleaned.dropped, strict=True) if not left_out],
                *power_spectra(cleaned.eeg, cleaned.ratio.sfreq, borders=borders),
            ),
        },
        out,
    )
    write_raw(_clean_raw(raw, cleaned, config), out / f"{inputs.unit}_clean_raw.fif")
    return _summary(raw, signals, cleaned, config)


def _signals(raw: mne.io.BaseRaw, config: Config) -> Signals:
    """Return the recording in microvolt, EEG first, EOG after it."""
    import mne

    from hrcneuro.analyses import electrodes
    from hrcneuro.eeg.breaks import borders
    from hrcneuro.eeg.cleaning import Signals
    from hrcneuro.io.fif import read_samples

    eeg = list(mne.pick_types(raw.info, eeg=True, exclude=()))
    eog = list(mne.pick_types(raw.info, eog=True, exclude=()))
    if not eeg:
        raise DataError(
            f"the recording has no EEG channel; its channels are {', '.join(raw.ch_names)}",
            cure="give their types: acquire.channel_types = {NAME = 'eeg'}",
        )
    data = read_samples(raw, [*eeg, *eog], 1e6)
    return Signals(
        data,
        float(raw.info["sfreq"]),
        [raw.ch_names[i] for i in eeg],
        [raw.ch_names[i] for i in eog],
        electrodes.positions(raw, eeg, config.interpolation),
        borders(raw.annotations.onset, raw.annotations.description, raw.info["sfreq"]),
        frozenset(raw.info["bads"]),
    )


def _cures() -> Cures:
    """Return what a user can do about each reason for which a recording cannot be cleaned."""
    from hrcneuro.eeg import refusals

    return {
        refusals.BandError: (ConfigError, "set preprocess.l_freq and preprocess.h_freq inside 0–{nyquist:g} Hz"),
        refusals.RateError: (
            ConfigError,
            "set preprocess.sfreq to {least} Hz or more, or lower preprocess.h_freq",
        ),
        refusals.NotFiniteError: (
            DataError,
            "repair the recording, or leave the channel out: acquire.drop = [{channel!r}]",
        ),
        refusals.NoEogError: (
            DataError,
            "set preprocess.eog = 'none' (for one subject: under [preprocess.subjects.SUBJECT]), or say which channels "
            "are EOG: acquire.channel_types = {{NAME = 'eog'}}",
        ),
        refusals.MarkedEogError: (
            DataError,
            "set preprocess.eog = 'none', or unmark one that can serve (acquire.bads, or in the file)",
        ),
        # Flat and marked channels are bad whatever the kurtosis step does.
        refusals.AllBadError: (DataError, _LOOK),
        refusals.AllRejectedError: (
            DataError,
            f"{_LOOK}; preprocess.bad_channels = 'none' keeps those rejected by kurtosis, preprocess.noisy = 'flag' "
            "those that are noisy",
        ),
        refusals.NoPositionError: (
            DataError,
            "give positions (acquire.montage), or set preprocess.unplaced = 'drop' to leave such channels out "
            "('keep' to leave them as they are)",
        ),
        refusals.FewGoodError: (
            DataError,
            "at least {least} are needed: give positions (acquire.montage) or set preprocess.bad_channels = 'none'",
        ),
        refusals.LoneChannelError: (
            DataError,
            "set preprocess.reference = 'none', or take more EEG channels into the recording",
        ),
    }


def _taps(config: Config, sfreq: float) -> np.ndarray | None:
    from hrcneuro.eeg.filters import bandpass_taps

    if config.filter == "causal":
        return None
    return bandpass_taps(sfreq, config.l_freq, config.h_freq, transition=config.transition)


def _clean_raw(raw: mne.io.BaseRaw, cleaned: Cleaned, config: Config) -> mne.io.BaseRaw:
    """Return the clean EEG (used up: it turns into volts) as MNE's type, with positions, events and breaks."""
    import mne
    import numpy as np
    from mne.io.constants import FIFF

    picks = mne.pick_types(raw.info, eeg=True, exclude=())
    info = mne.pick_info(raw.info, picks[np.flatnonzero(~cleaned.dropped)])
    with info._unlock():
        info["sfreq"] = cleaned.ratio.sfreq
        info["highpass"] = config.causal_l_freq if config.filter == "causal" else config.l_freq
        info["lowpass"] = config.h_freq
        if config.reference == "average":
            info["custom_ref_applied"] = FIFF.FIFFV_MNE_CUSTOM_REF_ON
    info["bads"] = []
    cleaned.eeg *= 1e-6
    clean = mne.io.RawArray(cleaned.eeg, info, verbose="error")
    marks = raw.annotations
    clean.set_annotations(mne.Annotations(marks.onset, marks.duration, marks.description), verbose="error")
    return clean


def _summary(raw: mne.io.BaseRaw, signals: Signals, cleaned: Cleaned, config: Config) -> dict[str, Any]:
    names = signals.eeg_names
    return {
        "sfreq": cleaned.ratio.sfreq,
        "source_sfreq": signals.sfreq,
        "downsampled": cleaned.ratio.up != cleaned.ratio.down,
        "seconds": float(raw.n_times / signals.sfreq),
        "segments": len(signals.borders) + 1,
        "channels": int((~cleaned.dropped).sum()),
        "eog_channels": list(signals.eog_names),
        "filter": config.filter,
        "interpolation": config.interpolation,
        "interpolated": [name for name, yes in zip(names, cleaned.interpolated, strict=True) if yes],
        "bad": {name: why for name, why in zip(names, cleaned.reason, strict=True) if why},
        "noisy": {name: why for name, why in zip(names, cleaned.noise.reason, strict=True) if why},
        "warnings": [*cleaned.warnings, *_apart(cleaned), *_ahead(signals, cleaned, config)],
    }


def _apart(cleaned: Cleaned) -> list[str]:
    """Return a sentence where too many channels go with no other for that to be noise."""
    n = cleaned.noise.n_alone
    if not n:
        return []
    return [
        f"{n} of {len(cleaned.noise.reason)} EEG channels go with no other: too many for noise of single channels, so "
        "none is called noisy by its correlation"
    ]


def _ahead(signals: Signals, cleaned: Cleaned, config: Config) -> list[str]:
    """Return a sentence where the filter is causal and what follows it is not."""
    if config.filter != "causal" or not cleaned.ahead_ms:
        return []
    return [
        f"the filter is causal, the down-sampling after it is not: it looks up to {cleaned.ahead_ms} ms ahead; "
        f"preprocess.sfreq = {signals.sfreq:g} leaves it out"
    ]


STAGE = Stage(
    name="preprocess",
    title="Signal quality",
    config=Config,
    libraries=("numpy", "scipy", "mne", "pandas", "pyarrow"),
    check=check,
    subject=Work(run, (Read("acquire", ("*_raw*.fif",)),)),
    # One subject's recording may lack EOG channels; the rest of the chain is the study's.
    by_subject=("eog",),
)
