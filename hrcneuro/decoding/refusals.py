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
