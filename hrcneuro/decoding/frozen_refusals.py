"""Why a frozen decoder cannot be made, or does not serve a stream: one class a reason; whoever calls knows the cure."""

from __future__ import annotations


class StreamError(ValueError):
    """A stream is not of the kind that a decoder was made for."""


class OtherChannelsError(StreamError):
    """A stream lacks channels that a decoder needs, or has others beside them."""


class OtherOrderError(StreamError):
    """A stream has the channels that a decoder needs, in another order."""


class OtherUnitError(StreamError):
    """A stream's samples are in another unit."""


class OtherRateError(StreamError):
    """A stream comes at another sampling rate."""


class FewTrialsError(ValueError):
    """A problem has too few trials of a class, or too few beside a part that is held out."""
