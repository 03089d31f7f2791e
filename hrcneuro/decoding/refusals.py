"""Why trials cannot be decoded, one class a reason: whoever calls knows the cure."""

from __future__ import annotations


class WindowOutsideError(ValueError):
    """A window of the features reaches past the epoch."""


class EmptyWindowError(ValueError):
    """A window of the features holds no sample at this sampling rate."""


class NotFiniteTrialsError(ValueError):
    """Trials hold samples that are no finite numbers."""


class NoSignalError(ValueError):
    """Every sample of the trials is the same."""


class VoltsError(ValueError):
    """The trials' spread is that of volts, not of microvolt."""


class EstimatorError(ValueError):
    """An estimator is unknown, or its parameters do not fit it."""


class MissingLibraryError(ValueError):
    """A library that an estimator needs cannot be imported."""


class TwinTrialsError(ValueError):
    """Trials are so close that they are one event twice: folds would train on what they test."""


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
    """A problem has too few trials of a class, or of a class beside a held-out block."""
