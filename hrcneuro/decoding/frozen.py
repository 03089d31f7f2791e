"""A decoder that is finished: nothing but numbers, from a filtered epoch to a score and a probability.

It is made once from a calibration (:mod:`.calibration`) and then serves streams of the same kind: the same channels in
the same order, in microvolt, at the same rate. Each decision is computed alone, with arrays of one shape and layout, so
that it is the same to the last bit whether the epoch comes from a stream or from a recording.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hrcneuro.decoding.features import ONLINE_MEAN_S, WINDOWS_S, window_weights
from hrcneuro.decoding.frozen_refusals import (
    OtherChannelsError,
    OtherOrderError,
    OtherRateError,
    OtherUnitError,
)
from hrcneuro.decoding.refusals import NotFiniteTrialsError
from hrcneuro.decoding.scheme import FEATURES_END_S
from hrcneuro.eeg.causal import CausalStream, Design, nearest

UNIT = "µV"
# The micro sign, the Greek letter and plain u; streams name the unit in words, too.
_MICROVOLT = frozenset({"uv", "µv", "μv", "microvolt", "microvolts"})
# Rates that are meant to be equal differ by rounding only.
_SAME_RATE = 1e-5
# So many channels are named in a message.
_FEW = 6


@dataclass(frozen=True)
class FrozenProblem:
    """How one problem is decided: score = wᵀx + b, P(class 2) = 1 / (1 + exp(−(slope · score + offset))).

    Attributes:
        classes: Conditions of class 1 (no takeover) and class 2 (takeover).
        actor: Who makes the moves at whose onset it is decided; empty where both do.
        weights: w, ndarray, shape (n_channels × n_windows,), per µV.
        bias: b; a positive score decides for class 2.
        slope, offset: Of the log-odds of class 2 where both classes are equally likely beforehand.
    """

    classes: tuple[str, str]
    actor: str
    weights: np.ndarray
    bias: float
    slope: float
    offset: float

    def score(self, seen: np.ndarray) -> float:
        """Return the score of an epoch's features, ndarray, shape (n_features,), µV."""
        return float(self.weights @ seen) + self.bias

    def log_odds(self, score: float) -> float:
        """Return log P(score | class 2) / P(score | class 1): what the score says, whatever is likely beforehand."""
        return self.slope * score + self.offset


@dataclass(frozen=True)
class Decision:
    """What is decoded from one epoch.

    Attributes:
        score: Positive where takeover is decided.
        probability: Of takeover, where both classes are equally likely beforehand.
        peak_uv: Largest deviation from a channel's mean in the cleaned epoch, µV.
        artefact: Whether that is more than in any epoch that the decoder may learn from: nothing should be made of it.
    """

    score: float
    probability: float
    peak_uv: float
    artefact: bool

    @property
    def takeover(self) -> bool:
        """Whether takeover is decided."""
        return self.score > 0


@dataclass(frozen=True)
class FrozenDecoder:
    """A finished decoder; one thread may use it at a time.

    Attributes:
        channels: Of the stream that it serves, in this order, in µV.
        sfreq: The stream's sampling rate, in Hz.
        band_hz: Pass band of the filter.
        filter: The causal filter of each channel.
        matrix: ndarray, shape (n_kept, n_channels): cleans a filtered sample, see :mod:`hrcneuro.eeg.spatial`.
        kept: Names of the cleaned channels.
        windows: ndarray, shape (n_windows, n_times): weights of an epoch's samples in each feature of a channel.
        reject_uv: A larger deviation in an epoch is an artefact, µV.
        problems: Name -> how it is decided.
    """

    channels: tuple[str, ...]
    sfreq: float
    band_hz: tuple[float, float]
    filter: Design
    matrix: np.ndarray
    kept: tuple[str, ...]
    windows: np.ndarray
    reject_uv: float
    problems: Mapping[str, FrozenProblem]

    @cached_property
    def _room(self) -> np.ndarray:
        """Room for a cleaned epoch: memory that the system clears anew for every decision costs more than deciding."""
        return np.empty((len(self.matrix), self.n_times))

    @property
    def n_times(self) -> int:
        """Samples of an epoch."""
        return int(self.windows.shape[1])

    def problem_of(self, actor: str) -> str:
        """Return the name of the problem that is decided at the onset of a move of ``human`` or ``robot``.

        Raises:
            KeyError: There is none, or more than one.
        """
        names = [name for name, one in self.problems.items() if one.actor in (actor, "")]
        if len(names) != 1:
            raise KeyError(f"{len(names)} problems are decided after a move of {actor!r}: {', '.join(self.problems)}")
        return names[0]

    def rows(
        self, channels: Sequence[str], units: Sequence[str], sfreq: float, *, beside: Collection[str] = ()
    ) -> list[int]:
        """Return which rows of a stream's chunks the decoder takes; refuse a stream of another kind.

        Args:
            channels: The stream's channels, in their order.
            units: A unit a channel, as the stream states it.
            sfreq: The rate that it states, in Hz.
            beside: Channels of the stream that are no part of the recording, as one of triggers.

        Raises:
            OtherChannelsError, OtherOrderError, OtherUnitError, OtherRateError: What differs, what is there, and what
                the decoder takes.
        """
        if abs(sfreq - self.sfreq) > _SAME_RATE * self.sfreq:
            raise OtherRateError(f"the stream comes at {sfreq:g} Hz; the decoder takes {self.sfreq:g} Hz")
        taken = [row for row, name in enumerate(channels) if name not in beside]
        names = tuple(channels[row] for row in taken)
        if sorted(names) != sorted(self.channels):
            raise OtherChannelsError(_differing(names, self.channels))
        if names != self.channels:
            at = next(i for i, (got, own) in enumerate(zip(names, self.channels, strict=True)) if got != own)
            raise OtherOrderError(
                f"the stream's channels come in another order: channel {at + 1} is {names[at]}; the decoder takes "
                f"{self.channels[at]} there"
            )
        wrong = [row for row in taken if units[row].strip().lower() not in _MICROVOLT]
        if wrong:
            raise OtherUnitError(
                f"{len(wrong)} channels of the stream are in another unit, the first, {channels[wrong[0]]}, in "
                f"{units[wrong[0]]!r}; the decoder takes {UNIT}"
            )
        return taken

    def stream(self, *, kept_s: float) -> CausalStream:
        """Return a stream of the channels that :meth:`rows` picks, of which the last ``kept_s`` seconds are kept."""
        ignored = np.flatnonzero(~self.matrix.any(axis=0))
        kept = self.n_times + math.ceil(kept_s * self.sfreq)
        return CausalStream(self.filter, len(self.channels), kept=kept, ignored=ignored.tolist())

    def first(self, zero: float) -> int:
        """Return the first sample of the epoch whose zero lies ``zero`` samples into a stream, with a fraction."""
        return nearest(zero)

    def last(self, zero: float) -> int:
        """Return the last sample that the decision needs."""
        return nearest(zero) + self.n_times - 1

    def features(self, epoch: np.ndarray) -> tuple[np.ndarray, float]:
        """Return an epoch's features, ndarray, shape (n_kept × n_windows,), µV, and its largest deviation, µV.

        Args:
            epoch: ndarray, shape (n_channels, n_times), µV, filtered.

        Raises:
            ValueError: It has another shape.
            NotFiniteTrialsError: It holds samples that are no numbers.
        """
        expected = (len(self.channels), self.n_times)
        if epoch.shape != expected:
            raise ValueError(f"an epoch of shape {epoch.shape}; the decoder takes {expected}, channels × samples")
        clean = self._room
        # One layout for all: products of other layouts may round otherwise.
        np.matmul(self.matrix, np.ascontiguousarray(epoch, float), out=clean)
        seen = (clean @ self.windows.T).ravel()
        clean -= clean.mean(axis=1, keepdims=True)
        peak = float(np.abs(clean, out=clean).max())
        if not math.isfinite(peak):
            raise NotFiniteTrialsError("the epoch holds samples that are no finite numbers")
        return seen, peak

    def decide(self, epoch: np.ndarray, problem: str) -> Decision:
        """Return what an epoch says: arguments and errors are those of :meth:`features`, and a name of ``problems``."""
        seen, peak = self.features(epoch)
        one = self.problems[problem]
        score = one.score(seen)
        return Decision(score, sigmoid(one.log_odds(score)), peak, peak > self.reject_uv)


def windows(sfreq: float) -> np.ndarray:
    """Return the weights of the 15 windows' means less the 0–0.6 s mean: ndarray, shape (15, n_times) (paper 2.5.4).

    An epoch begins at its zero and holds the samples before 0.6 s: as many as ``n_times``.

    Raises:
        EmptyWindowError: A window holds no sample at this rate, in Hz.
    """
    n_times = math.ceil(FEATURES_END_S * sfreq - 1e-5 * FEATURES_END_S * sfreq)
    return window_weights(np.arange(n_times) / sfreq, windows_s=WINDOWS_S, mean_window_s=ONLINE_MEAN_S)


def sigmoid(x: float) -> float:
    """Return 1 / (1 + exp(−x)), also where exp would overflow."""
    return 1 / (1 + math.exp(-x)) if x >= 0 else math.exp(x) / (1 + math.exp(x))


def _differing(got: Sequence[str], own: Sequence[str]) -> str:
    """Return what a stream lacks of the decoder's channels and has beside them."""
    lacking, more = ([name for name in a if name not in b] for a, b in ((own, got), (got, own)))
    said = [f"lacks {_some(lacking)}"] if lacking else []
    said += [f"has {_some(more)} beside them"] if more else []
    said += [f"names {_some(sorted({n for n in got if got.count(n) > 1}))} twice"] if not said else []
    return f"the stream {' and '.join(said)}; the decoder takes these {len(own)} channels: {', '.join(own)}"


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_FEW]) + (f" and {len(names) - _FEW} more" if len(names) > _FEW else "")
