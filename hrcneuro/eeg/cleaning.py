"""The chain from a raw recording to clean EEG (paper §2.3.3): band-pass, eyes, bad channels, reference, rate.

Arrays are channels × samples, in microvolt, and are worked on in place: beside the recording the chain needs memory
for a few channels only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.eeg import channels, filters, interpolation, ocular, resample
from hrcneuro.errors import DataError

STEPS = ("filtered", "eog", "interpolated", "reference")
# A spline through fewer electrodes is a guess.
_MIN_GOOD = 3


@dataclass(frozen=True)
class Recipe:
    """What to do; the names and meanings are those of the stage's options."""

    l_freq: float
    h_freq: float
    sfreq: float
    filter: str = "zero_phase"
    transition: str = "achieved"
    causal_l_freq: float = 0.1
    eog: str = "regression"
    eog_offset: bool = True
    bad_channels: str = "kurtosis"
    threshold: float = 2.0
    interpolation: str = "eeglab"
    unplaced: str = "error"
    reference: str = "average"


@dataclass
class Signals:
    """A recording to clean. EEG rows come before EOG rows in ``data``; borders begin new stretches.

    ``positions`` are EEG channels × 3, around the centre of the interpolation's sphere, NaN where unknown;
    ``marked`` names the channels, EEG and EOG, that somebody called bad before.
    """

    data: np.ndarray
    sfreq: float
    eeg_names: list[str]
    eog_names: list[str]
    positions: np.ndarray
    borders: Sequence[int] = ()
    marked: frozenset[str] = frozenset()

    @property
    def eeg(self) -> np.ndarray:
        """The EEG, a view."""
        return self.data[: len(self.eeg_names)]

    @property
    def eog(self) -> np.ndarray:
        """The EOG, a view."""
        return self.data[len(self.eeg_names) :]


@dataclass
class Cleaned:
    """Clean EEG at the new rate, and what was found on the way: an entry an EEG channel of the recording.

    ``interpolated`` and ``dropped`` are boolean masks; ``weights`` is EEG × EOG, 0 for an EOG channel that was marked
    bad; ``reason`` says why a channel is bad (``kurtosis``, ``flat``, ``marked``) or is empty.
    """

    eeg: np.ndarray
    ratio: resample.Ratio
    kurtosis: np.ndarray
    z: np.ndarray
    reason: list[str]
    interpolated: np.ndarray
    dropped: np.ndarray
    weights: np.ndarray
    rms_before: np.ndarray
    rms_after: np.ndarray
    warnings: list[str] = field(default_factory=list)


def clean(
    signals: Signals, recipe: Recipe, *, on_step: Callable[[str, np.ndarray], None] = lambda name, eeg: None
) -> Cleaned:
    """Return the clean EEG; ``signals.data`` is used up.

    ``on_step`` sees the EEG after each of :data:`STEPS` (at the recording's rate) and must not change it.

    Raises:
        DataError: Samples are no numbers, there is no EOG to regress on, all channels are bad, a bad channel cannot
            be interpolated, or there is one channel to average.
        ConfigError: The band does not fit the sampling rate, or the new rate cannot hold the band.
    """
    names = signals.eeg_names
    notes: list[str] = []
    pass_freq = _check(signals, recipe)
    ratio = _rate(signals, recipe, pass_freq, notes)

    _band_pass(signals, recipe)
    on_step("filtered", signals.eeg)
    before = _rms(signals.eeg)
    weights = _remove_eyes(signals, recipe, notes)
    on_step("eog", signals.eeg)
    verdict, reason = _judge(signals, recipe, notes)
    interpolated, dropped = _interpolate(signals, recipe, reason, notes)
    eeg = _without(signals.eeg, dropped)
    on_step("interpolated", eeg)
    if recipe.reference == "average":
        _average(eeg, [name for name, left_out in zip(names, dropped, strict=True) if not left_out])
    on_step("reference", eeg)
    eeg = resample.resample(eeg, ratio, pass_freq=pass_freq, borders=signals.borders)
    after = np.full(len(names), math.nan)
    after[~dropped] = _rms(eeg)
    return Cleaned(
        eeg, ratio, verdict.kurtosis, verdict.z, reason, interpolated, dropped, weights, before, after, notes
    )


def _check(signals: Signals, recipe: Recipe) -> float:
    """Refuse what cannot be cleaned; return the highest frequency that the filter lets through, in Hz."""
    channels.check_finite(signals.data, [*signals.eeg_names, *signals.eog_names], signals.sfreq)
    if recipe.eog == "regression":
        _require_eog(signals)
    if recipe.filter == "causal":
        filters.check_band(signals.sfreq, recipe.causal_l_freq, recipe.h_freq)
        return recipe.h_freq
    return filters.design(signals.sfreq, recipe.l_freq, recipe.h_freq, transition=recipe.transition).high


def _require_eog(signals: Signals) -> None:
    if not signals.eog_names:
        raise DataError(
            f"preprocess.eog is 'regression', but no channel is EOG: {', '.join(signals.eeg_names)} are EEG",
            cure="set preprocess.eog = 'none', or say which channels are EOG: acquire.channel_types = {NAME = 'eog'}",
        )
    if signals.marked.issuperset(signals.eog_names):
        raise DataError(
            f"preprocess.eog is 'regression', but all EOG channels are marked bad: {', '.join(signals.eog_names)}",
            cure="set preprocess.eog = 'none', or unmark one that can serve (acquire.bads, or in the file)",
        )


def _rate(signals: Signals, recipe: Recipe, pass_freq: float, notes: list[str]) -> resample.Ratio:
    """Return the way to the new rate, refused here rather than after minutes; note what a person would not expect."""
    ratio = resample.ratio(signals.sfreq, recipe.sfreq)
    if abs(ratio.sfreq - min(recipe.sfreq, signals.sfreq)) > 1e-6:
        notes.append(f"{signals.sfreq:g} to {recipe.sfreq:g} Hz is no simple ratio: the rate is {ratio.sfreq:.6f} Hz")
    if ratio.up != ratio.down:
        taps = resample.antialias_taps(ratio, pass_freq)
        if recipe.filter == "causal":
            ahead_ms = math.ceil(1000 * (len(taps) // 2) / (ratio.source * ratio.up))
            notes.append(
                f"the filter is causal, the down-sampling after it is not: it looks up to {ahead_ms} ms ahead; "
                f"preprocess.sfreq = {signals.sfreq:g} leaves it out"
            )
    return ratio


def _band_pass(signals: Signals, recipe: Recipe) -> None:
    if recipe.filter == "causal":
        band = recipe.causal_l_freq, recipe.h_freq
        filters.causal(signals.data, signals.sfreq, *band, borders=signals.borders)
    else:
        band = recipe.l_freq, recipe.h_freq
        taps = filters.bandpass_taps(signals.sfreq, *band, transition=recipe.transition)
        filters.zero_phase(signals.data, taps, borders=signals.borders)


def _remove_eyes(signals: Signals, recipe: Recipe, notes: list[str]) -> np.ndarray:
    weights = np.zeros((len(signals.eeg_names), len(signals.eog_names)))
    if recipe.eog == "none":
        return weights
    eog, used = signals.eog, np.array([name not in signals.marked for name in signals.eog_names], bool)
    names = [name for name, one in zip(signals.eog_names, used, strict=True) if one]
    if not used.all():
        left = ", ".join(name for name in signals.eog_names if name not in names)
        notes.append(f"EOG channels marked bad take no part in the regression: {left}")
        eog = eog[used]
    weights[:, used], singular = ocular.regression_weights(signals.eeg, eog)
    if singular:
        notes.append(
            f"the EOG channels {', '.join(names)} do not differ enough (flat, or copies of each other): "
            "their weights are those of least norm"
        )
    ocular.remove(signals.eeg, eog, weights[:, used], offset=recipe.eog_offset)
    return weights


def _judge(signals: Signals, recipe: Recipe, notes: list[str]) -> tuple[channels.Verdict, list[str]]:
    names = signals.eeg_names
    marked = np.array([name in signals.marked for name in names], bool)
    threshold = recipe.threshold if recipe.bad_channels == "kurtosis" else math.inf
    verdict = channels.judge(signals.eeg, threshold, marked=marked)
    reason = [
        "flat" if flat else "marked" if mark else "kurtosis" if bad else ""
        for flat, mark, bad in zip(verdict.flat, marked, verdict.bad, strict=True)
    ]
    if verdict.bad.all():
        listed = ", ".join(f"{name} ({why})" for name, why in zip(names, reason, strict=True))
        raise DataError(
            f"all {len(names)} EEG channels are bad: {listed}",
            # Flat and marked channels are bad whatever the kurtosis step does.
            cure="look at the recording: hrcneuro acquire SUBJECT --inspect"
            + ("; preprocess.bad_channels = 'none' keeps those rejected by kurtosis" if "kurtosis" in reason else ""),
        )
    compared = int((~(verdict.flat | marked)).sum())
    if recipe.bad_channels == "kurtosis" and compared < channels.MIN_CHANNELS:
        notes.append(f"only {compared} channels to compare: none is rejected by its kurtosis")
    if verdict.bad.sum() > len(names) / 3:
        notes.append(f"{verdict.bad.sum()} of {len(names)} EEG channels are bad")
    return verdict, reason


def _interpolate(
    signals: Signals, recipe: Recipe, reason: list[str], notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate the bad channels that have a position; return masks of these and of those to leave out."""
    names = signals.eeg_names
    bad = np.array([bool(r) for r in reason], bool)
    placed = np.isfinite(signals.positions).all(axis=1) & np.any(signals.positions != 0, axis=1)
    lost = [name for name, b, p in zip(names, bad, placed, strict=True) if b and not p]
    dropped = np.zeros(len(names), bool)
    if lost:
        listed = ", ".join(lost)
        if recipe.unplaced == "error":
            raise DataError(
                f"bad channels without a position cannot be interpolated: {listed}",
                cure="give positions (acquire.montage), or set preprocess.unplaced = 'drop' to leave such channels out "
                "('keep' to leave them as they are)",
            )
        dropped = bad & ~placed & (recipe.unplaced == "drop")
        done = "left out" if recipe.unplaced == "drop" else "left as they are"
        notes.append(f"bad channels without a position, {done}: {listed}")
    target, source = np.flatnonzero(bad & placed), np.flatnonzero(~bad & placed)
    if len(target):
        if len(source) < _MIN_GOOD:
            raise DataError(
                f"{len(target)} bad channels cannot be interpolated from {len(source)} good ones with a position",
                cure="at least 3 are needed: give positions (acquire.montage) or set preprocess.bad_channels = 'none'",
            )
        at = signals.positions
        matrix = interpolation.weights(at[source], at[target], method=recipe.interpolation)
        interpolation.apply(signals.eeg, target, source, matrix)
    return bad & placed, dropped


def _average(eeg: np.ndarray, names: list[str]) -> None:
    if len(names) < 2:
        raise DataError(
            f"the average over 1 EEG channel ({names[0]}) is that channel: subtracting it leaves nothing",
            cure="set preprocess.reference = 'none', or take more EEG channels into the recording",
        )
    channels.average_reference(eeg)


def _without(eeg: np.ndarray, dropped: np.ndarray) -> np.ndarray:
    """Return the EEG without the dropped rows, moved up in its own memory."""
    kept = np.flatnonzero(~dropped)
    for to, row in enumerate(kept):
        if to != row:
            eeg[to] = eeg[row]
    return eeg[: len(kept)]


def _rms(data: np.ndarray) -> np.ndarray:
    return np.array([math.sqrt(float(channel @ channel) / len(channel)) for channel in data])
