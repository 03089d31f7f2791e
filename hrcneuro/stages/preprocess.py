"""Clean the EEG (paper §2.3.3): band-pass, eye movements, bad channels, common average, down-sampling."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Inputs, Read, Stage, Work, option
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import mne
    import numpy as np

    from hrcneuro.eeg.cleaning import Cleaned, Recipe, Signals


@dataclass(frozen=True)
class Config:
    """Options of the stage; the defaults are the paper's."""

    l_freq: float = option(1.0, "lower edge of the pass band", unit="Hz", low=0, open_low=True)
    h_freq: float = option(40.0, "upper edge of the pass band", unit="Hz", low=0, open_low=True)
    sfreq: float = option(512.0, "sampling rate to come down to; a slower recording keeps its own", unit="Hz", low=1)
    filter: str = option(
        "zero_phase",
        "zero_phase: EEGLAB's windowed sinc; causal: first-order high-pass, fourth-order low-pass; sfreq looks ahead",
        choices=("zero_phase", "causal"),
    )
    transition: str = option(
        "achieved",
        "transition bands of zero_phase: as the order makes them, or as asked for (pop_eegfiltnew without an order)",
        choices=("achieved", "requested"),
    )
    causal_l_freq: float = option(0.1, "high-pass of the causal filter", unit="Hz", low=0, open_low=True)
    eog: str = option("regression", "how eye movements are removed", choices=("regression", "none"))
    eog_offset: bool = option(
        True, "the regression also removes each channel's mean, as BIOSIG's does; false: as MNE's EOGRegression"
    )
    bad_channels: str = option("kurtosis", "how contaminated channels are found", choices=("kurtosis", "none"))
    threshold: float = option(
        2.0, "channels whose normalised kurtosis lies further from the mean are bad", unit="SD", low=0, open_low=True
    )
    interpolation: str = option(
        "eeglab",
        "splines for bad channels: as EEGLAB computes them, or Perrin's (MNE; better for new studies)",
        choices=("eeglab", "perrin"),
    )
    unplaced: str = option(
        "error", "what becomes of a bad channel whose position is unknown", choices=("error", "drop", "keep")
    )
    reference: str = option("average", "reference of the clean EEG; none: as recorded", choices=("average", "none"))
    keep_steps: bool = option(False, "write the EEG after every step to steps.npz (large)")


def check(config: Config) -> list[str]:
    """Return what contradicts itself in the options."""
    found = []
    low = ("causal_l_freq", config.causal_l_freq) if config.filter == "causal" else ("l_freq", config.l_freq)
    if low[1] >= config.h_freq:
        found.append(f"preprocess.{low[0]} = {low[1]:g} Hz must lie below preprocess.h_freq = {config.h_freq:g} Hz")
    if config.h_freq >= config.sfreq / 2:
        found.append(
            f"preprocess.h_freq = {config.h_freq:g} Hz must lie below half of preprocess.sfreq = {config.sfreq:g} Hz"
        )
    return found


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Clean one subject's recording.

    Raises:
        DataError: The recording cannot be cleaned: no EEG, no EOG, samples that are no numbers, all channels bad.
        ConfigError: The pass band does not fit the recording's sampling rate.
    """
    from contextlib import ExitStack

    from hrcneuro.eeg.cleaning import clean
    from hrcneuro.io.fif import read_raw, write_raw
    from hrcneuro.tables import quality as files

    raw = read_raw(inputs.path("acquire", "{unit}_raw.fif"))
    signals = _signals(raw, config)
    n_source = signals.data.shape[1]
    with ExitStack() as stack:
        keep = stack.enter_context(files.Steps(out / "steps.npz")) if config.keep_steps else None
        cleaned = clean(signals, _recipe(config), **({"on_step": keep.add} if keep else {}))
        if keep:
            keep.describe(signals, cleaned, _taps(config, raw.info["sfreq"]))
    files.write_quality(cleaned, signals, out)
    files.write_timing(cleaned, n_source, out)
    write_raw(_clean_raw(raw, cleaned, config), out / f"{inputs.unit}_clean_raw.fif")
    return _summary(raw, signals, cleaned, config)


def _signals(raw: mne.io.BaseRaw, config: Config) -> Signals:
    """Return the recording in microvolt, EEG first, EOG after it."""
    import mne
    import numpy as np

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
    found = np.array([raw.info["chs"][i]["loc"][:3] for i in eeg], float)
    found[~np.any(found != 0, axis=1)] = np.nan
    return Signals(
        data,
        float(raw.info["sfreq"]),
        [raw.ch_names[i] for i in eeg],
        [raw.ch_names[i] for i in eog],
        found - _centre(raw, found, config.interpolation),
        borders(raw.annotations.onset, raw.annotations.description, raw.info["sfreq"]),
        frozenset(raw.info["bads"]),
    )


def _centre(raw: mne.io.BaseRaw, positions: np.ndarray, method: str) -> np.ndarray:
    """Return the centre of the head's sphere: MNE's for Perrin's splines, else that of the electrodes."""
    import warnings

    import mne
    import numpy as np

    from hrcneuro.eeg.interpolation import sphere_centre

    if method == "perrin" and raw.info["dig"] is not None:
        # MNE refuses a handful of points and warns of few or of an odd centre; the electrodes' own fit serves then.
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            try:
                return np.asarray(mne.bem.fit_sphere_to_headshape(raw.info, units="m", verbose="error")[1])
            except (ValueError, RuntimeError):
                pass
    return sphere_centre(positions[np.isfinite(positions).all(axis=1)])


def _recipe(config: Config) -> Recipe:
    from hrcneuro.eeg.cleaning import Recipe

    options = asdict(config)
    del options["keep_steps"]
    return Recipe(**options)


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
    made = mne.io.RawArray(cleaned.eeg, info, verbose="error")
    marks = raw.annotations
    made.set_annotations(mne.Annotations(marks.onset, marks.duration, marks.description), verbose="error")
    return made


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
        "warnings": list(cleaned.warnings),
    }


STAGE = Stage(
    name="preprocess",
    config=Config,
    libraries=("numpy", "scipy", "mne", "pandas", "pyarrow"),
    check=check,
    subject=Work(run, (Read("acquire", ("*_raw*.fif",)),)),
)
