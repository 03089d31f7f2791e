"""The chain from a raw recording to clean EEG (paper §2.3.3): band-pass, eyes, bad channels, reference, rate.

Signals are worked on in place: beside the recording the chain needs memory for a few channels only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.eeg import channels, filters, interpolation, noisy, ocular, resample
from hrcneuro.eeg.params import CleaningParams
from hrcneuro.eeg.refusals import (
    AllBadError,
    AllRejectedError,
    FewGoodError,
    LoneChannelError,
    MarkedEogError,
    NoEogError,
    NoPositionError,
)

STEPS = ("filtered", "eog", "interpolated", "reference")
# A spline through fewer electrodes is a guess.
_MIN_GOOD = 3


@dataclass
class Signals:
    """A recording to clean.

    Attributes:
        data: ndarray, shape (n_eeg + n_eog, n_samples), µV: EEG rows come before EOG rows.
        sfreq: Sampling rate, in Hz.
        eeg_names, eog_names: The channels, in the order of the rows.
        positions: ndarray, shape (n_eeg, 3), around the centre of the interpolation's sphere, NaN where unknown.
        borders: First samples of new stretches.
        marked: Channels, EEG and EOG, that somebody called bad before.
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
        """The EEG: ndarray, shape (n_eeg, n_samples), a view."""
        return self.data[: len(self.eeg_names)]

    @property
    def eog(self) -> np.ndarray:
        """The EOG: ndarray, shape (n_eog, n_samples), a view."""
        return self.data[len(self.eeg_names) :]


@dataclass
class Cleaned:
    """Clean EEG at the new rate, and what was seen on the way, an entry an EEG channel of the recording.

    Attributes:
        eeg: ndarray, shape (n_kept, n_samples), µV: the channels that were not dropped.
        ratio: Of the new rate to the recording's.
        ahead_ms: How far the down-sampling looks ahead, in ms; 0 where the rate stays.
        kurtosis: ndarray, shape (n_eeg,), NaN for a flat channel.
        z: ndarray, shape (n_eeg,), SD: the kurtosis normalised, NaN where flat or marked.
        noise: Which channels are noisy all the time, before any was interpolated.
        reason: Why a channel is bad (``kurtosis``, ``flat``, ``marked``, ``noisy``), or an empty string.
        interpolated, dropped: ndarray, shape (n_eeg,), bool.
        weights: ndarray, shape (n_eeg, n_eog), 0 for an EOG channel that was marked bad.
        rms_before, rms_after: ndarray, shape (n_eeg,), µV: after the band-pass, and at the end (NaN where dropped).
        warnings: What a person would not expect, a sentence each.
    """

    eeg: np.ndarray
    ratio: resample.Ratio
    ahead_ms: int
    kurtosis: np.ndarray
    z: np.ndarray
    noise: noisy.Noise
    reason: list[str]
    interpolated: np.ndarray
    dropped: np.ndarray
    weights: np.ndarray
    rms_before: np.ndarray
    rms_after: np.ndarray
    warnings: list[str] = field(default_factory=list)


def clean(
    signals: Signals, params: CleaningParams, *, on_step: Callable[[str, np.ndarray], None] = lambda name, eeg: None
) -> Cleaned:
    """Return the clean EEG.

    Args:
        signals: The recording; its data are used up.
        params: The chain's parameters.
        on_step: Sees the EEG after each of :data:`STEPS` (at the recording's rate) and must not change it.

    Raises:
        Refusal: Samples are no numbers, there is no EOG to regress on, all channels are bad, a bad channel cannot be
            interpolated, there is one channel to average, the band does not fit the sampling rate, or the new rate
            cannot hold the band; each is a class of its own in :mod:`hrcneuro.eeg.refusals`.
    """
    names = signals.eeg_names
    notes: list[str] = []
    pass_freq = _check(signals, params)
    ratio, ahead_ms = _rate(signals, params, pass_freq, notes)

    _band_pass(signals, params)
    on_step("filtered", signals.eeg)
    before = _rms(signals.eeg)
    weights = _remove_eyes(signals, params, notes)
    on_step("eog", signals.eeg)
    verdict, noise, reason = _judge(signals, params, notes)
    interpolated, dropped = _interpolate(signals, params, reason, notes)
    eeg = _without(signals.eeg, dropped)
    on_step("interpolated", eeg)
    if params.reference == "average":
        _average(eeg, [name for name, left_out in zip(names, dropped, strict=True) if not left_out])
    on_step("reference", eeg)
    eeg = resample.resample(eeg, ratio, pass_freq=pass_freq, borders=signals.borders)
    after = np.full(len(names), math.nan)
    after[~dropped] = _rms(eeg)
    return Cleaned(
        eeg=eeg,
        ratio=ratio,
        ahead_ms=ahead_ms,
        kurtosis=verdict.kurtosis,
        z=verdict.z,
        noise=noise,
        reason=reason,
        interpolated=interpolated,
        dropped=dropped,
        weights=weights,
        rms_before=before,
        rms_after=after,
        warnings=notes,
    )


def _check(signals: Signals, params: CleaningParams) -> float:
    """Refuse what cannot be cleaned; return the highest frequency that the filter lets through, in Hz."""
    channels.check_finite(signals.data, [*signals.eeg_names, *signals.eog_names], signals.sfreq)
    if params.eog == "regression":
        _require_eog(signals)
    if params.filter == "causal":
        filters.check_band(signals.sfreq, params.causal_l_freq, params.h_freq)
        return params.h_freq
    return filters.design(signals.sfreq, params.l_freq, params.h_freq, transition=params.transition).high


def _require_eog(signals: Signals) -> None:
    if not signals.eog_names:
        raise NoEogError(
            "eye movements are to be removed by regression, but no channel is EOG: "
            f"{', '.join(signals.eeg_names)} are EEG"
        )
    if signals.marked.issuperset(signals.eog_names):
        raise MarkedEogError(
            "eye movements are to be removed by regression, but all EOG channels are marked bad: "
            f"{', '.join(signals.eog_names)}"
        )


def _rate(signals: Signals, params: CleaningParams, pass_freq: float, notes: list[str]) -> tuple[resample.Ratio, int]:
    """Return the way to the new rate, refused here rather than after minutes, and how far it looks ahead, in ms."""
    ratio = resample.ratio(signals.sfreq, params.sfreq)
    if abs(ratio.sfreq - min(params.sfreq, signals.sfreq)) > 1e-6:
        notes.append(f"{signals.sfreq:g} to {params.sfreq:g} Hz is no simple ratio: the rate is {ratio.sfreq:.6f} Hz")
    if ratio.up == ratio.down:
        return ratio, 0
    taps = resample.antialias_taps(ratio, pass_freq)
    return ratio, math.ceil(1000 * (len(taps) // 2) / (ratio.source * ratio.up))


def _band_pass(signals: Signals, params: CleaningParams) -> None:
    if params.filter == "causal":
        band = params.causal_l_freq, params.h_freq
        filters.causal(signals.data, signals.sfreq, *band, borders=signals.borders)
    else:
        band = params.l_freq, params.h_freq
        taps = filters.bandpass_taps(signals.sfreq, *band, transition=params.transition)
        filters.zero_phase(signals.data, taps, borders=signals.borders)


def _remove_eyes(signals: Signals, params: CleaningParams, notes: list[str]) -> np.ndarray:
    weights = np.zeros((len(signals.eeg_names), len(signals.eog_names)))
    if params.eog == "none":
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
    ocular.remove(signals.eeg, eog, weights[:, used], offset=params.eog_offset)
    return weights


def _judge(
    signals: Signals, params: CleaningParams, notes: list[str]
) -> tuple[channels.Verdict, noisy.Noise, list[str]]:
    names = signals.eeg_names
    marked = np.array([name in signals.marked for name in names], bool)
    threshold = params.threshold if params.bad_channels == "kurtosis" else math.inf
    verdict = channels.judge(signals.eeg, threshold, marked=marked)
    reason = [
        "flat" if flat else "marked" if mark else "kurtosis" if bad else ""
        for flat, mark, bad in zip(verdict.flat, marked, verdict.bad, strict=True)
    ]
    noise = _noise(signals, params, ~(verdict.flat | marked))
    if params.noisy == "replace":
        reason = [why or ("noisy" if is_noisy else "") for why, is_noisy in zip(reason, noise.noisy, strict=True)]
    bad = sum(map(bool, reason))
    if bad == len(names):
        listed = ", ".join(f"{name} ({why})" for name, why in zip(names, reason, strict=True))
        refusal = AllRejectedError if {"kurtosis", "noisy"} & set(reason) else AllBadError
        raise refusal(f"all {len(names)} EEG channels are bad: {listed}")
    compared = int((~(verdict.flat | marked)).sum())
    if params.bad_channels == "kurtosis" and compared < channels.MIN_CHANNELS:
        notes.append(f"only {compared} channels to compare: none is rejected by its kurtosis")
    if bad > len(names) / 3:
        notes.append(f"{bad} of {len(names)} EEG channels are bad")
    return verdict, noise, reason


def _noise(signals: Signals, params: CleaningParams, used: np.ndarray) -> noisy.Noise:
    return noisy.judge(
        signals.eeg,
        signals.sfreq,
        used=used,
        deviation=params.noisy_deviation,
        correlation=params.noisy_correlation,
        share=params.noisy_share,
        borders=signals.borders,
    )


def _interpolate(
    signals: Signals, params: CleaningParams, reason: list[str], notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate the bad channels that have a position; return masks of these and of those to leave out."""
    names = signals.eeg_names
    bad = np.array([bool(r) for r in reason], bool)
    placed = np.isfinite(signals.positions).all(axis=1) & np.any(signals.positions != 0, axis=1)
    lost = [name for name, b, p in zip(names, bad, placed, strict=True) if b and not p]
    dropped = np.zeros(len(names), bool)
    if lost:
        listed = ", ".join(lost)
        if params.unplaced == "error":
            raise NoPositionError(f"bad channels without a position cannot be interpolated: {listed}")
        dropped = bad & ~placed & (params.unplaced == "drop")
        done = "left out" if params.unplaced == "drop" else "left as they are"
        notes.append(f"bad channels without a position, {done}: {listed}")
    target, source = np.flatnonzero(bad & placed), np.flatnonzero(~bad & placed)
    if len(target):
        if len(source) < _MIN_GOOD:
            raise FewGoodError(
                f"{len(target)} bad channels cannot be interpolated from {len(source)} good ones with a position",
                least=_MIN_GOOD,
            )
        at = signals.positions
        matrix = interpolation.weights(at[source], at[target], method=params.interpolation)
        interpolation.apply(signals.eeg, target, source, matrix)
    return bad & placed, dropped


def _average(eeg: np.ndarray, names: list[str]) -> None:
    if len(names) < 2:
        raise LoneChannelError(
            f"the average over 1 EEG channel ({names[0]}) is that channel: subtracting it leaves nothing"
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
