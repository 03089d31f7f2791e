"""Why signals cannot be worked on, one class a reason: whoever calls knows the cure, which may name an attribute."""

from __future__ import annotations

from typing import Any


class Refusal(ValueError):
    """Values or signals with which a step cannot work.

    Args:
        message: Quantity, value and limit.
        facts: What a cure may name; they become attributes.
    """

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(message)
        vars(self).update(facts)


class BandError(Refusal):
    """A pass band does not fit the sampling rate, whose ``nyquist`` is half of it, in Hz."""


class RateError(Refusal):
    """A new sampling rate cannot hold the pass band; ``least`` is the lowest that can, in Hz."""


class NotFiniteError(Refusal):
    """A ``channel`` has samples that are no finite numbers."""


class NoEogError(Refusal):
    """There is no EOG channel to regress on."""


class MarkedEogError(Refusal):
    """Every EOG channel is marked bad, so that none is left to regress on."""


class AllBadError(Refusal):
    """Every EEG channel is flat or marked bad, so that there is nothing to interpolate from."""


class AllRejectedError(AllBadError):
    """Every EEG channel is bad, some by their kurtosis alone."""


class NoPositionError(Refusal):
    """Bad channels have no position, so that they cannot be interpolated."""


class FewGoodError(Refusal):
    """Too few good channels have a position to interpolate from; ``least`` are needed."""


class LoneChannelError(Refusal):
    """The average over one channel is that channel."""


class SlowSamplingError(Refusal):
    """The sampling rate of a synthetic recording misses part of the EEG's band."""


class MovesError(Refusal):
    """The moves of a synthetic recording are none, or their onsets are missing or out of order."""
