"""Epochs around onsets: which may be cut, how they are named, and how many of each kind remain (paper §2.5.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.paradigm.conditions import CASES

REASONS = ("no onset", "outside", "boundary", "marked", "amplitude")
"""Why an epoch is rejected, the first that applies: the trial has no onset in the recording; the window leaves the
recording; it crosses a discontinuity; it touches a stretch marked bad; its amplitude is too large."""

POSITIONS = {"before": "condition_before", "after": "condition_after"}


@dataclass(frozen=True)
class Window:
    """The samples of an epoch, relative to its onset: ``first`` … ``first + length - 1``."""

    sfreq: float
    first: int
    length: int

    @classmethod
    def of(cls, sfreq: float, tmin: float, tmax: float) -> Window:
        """Return the window from the sample nearest to ``tmin`` to the one nearest to ``tmax`` (s), both included."""
        # Rates that are meant to be equal differ by up to a hundred-thousandth (resample.common_rate), and so do their
        # products on either side of a half; both go up.
        first, last = (math.floor(t * sfreq + 0.5 + 1e-5 * abs(t) * sfreq) for t in (tmin, tmax))
        return cls(sfreq, first, last - first + 1)

    @property
    def tmin(self) -> float:
        """Time of the first sample, in seconds."""
        return self.first / self.sfreq


def is_study(trials: pd.DataFrame) -> bool:
    """Return whether the trials follow the paradigm; any other study has no scenarios."""
    return bool(trials["scenario"].notna().any())


def candidates(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the trials of which epochs are wanted, in order.

    In the study these are the main-block moves that are tr−1 or tr of a counting pair, each once; elsewhere all.
    """
    if not is_study(trials):
        return trials
    main = ~trials["practice"].fillna(False).astype(bool)
    return trials[main & (trials["condition_before"].notna() | trials["condition_after"].notna())]


def tags(trials: pd.DataFrame) -> list[str]:
    """Return an event name a trial: ``iC/before_RH/after_RR`` with absent parts left out, or the marker's name."""
    if not is_study(trials):
        return [str(event) for event in trials["event"]]
    columns = zip(trials["scenario"], trials["condition_before"], trials["condition_after"], strict=True)
    return [
        "/".join([scenario, *(f"{name}_{case}" for name, case in (("before", b), ("after", a)) if not pd.isna(case))])
        for scenario, b, a in columns
    ]


def judge(
    data: np.ndarray,
    onsets: np.ndarray,
    window: Window,
    *,
    borders: Sequence[int],
    marked: Sequence[tuple[int, int]],
    limit: float,
) -> np.ndarray:
    """Return one of :data:`REASONS` a trial, or an empty string where the epoch is good: ndarray, shape (n_trials,).

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        onsets: ndarray, shape (n_trials,), sample of each onset, negative where there is none.
        window: What to cut.
        borders: First samples of new stretches; an epoch may begin at one but not contain it later.
        marked: Bad stretches as (first sample, first sample after).
        limit: Largest |x| that a good epoch may hold, in the unit of the data.
    """
    starts = onsets + window.first
    stops = starts + window.length
    reasons = np.full(len(onsets), "", dtype=object)
    edges = np.sort(np.asarray(borders, int))
    crosses = np.searchsorted(edges, starts, side="right") < np.searchsorted(edges, stops, side="left")
    for i, (start, stop) in enumerate(zip(starts, stops, strict=True)):
        if onsets[i] < 0:
            reasons[i] = "no onset"
        elif start < 0 or stop > data.shape[1]:
            reasons[i] = "outside"
        elif crosses[i]:
            reasons[i] = "boundary"
        elif any(a < stop and start < b for a, b in marked):
            reasons[i] = "marked"
        else:
            piece = data[:, start:stop]
            if max(piece.max(), -piece.min()) > limit:
                reasons[i] = "amplitude"
    return reasons


def largest(data: np.ndarray, onsets: np.ndarray, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest |x| of each epoch, NaN where it leaves the recording, and the channel that holds it, else -1.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        onsets: ndarray, shape (n_trials,), sample of each onset, negative where there is none.
        window: What is cut.

    Returns:
        ndarray, shape (n_trials,), in that unit, and ndarray, shape (n_trials,), int.
    """
    peaks, channels = np.full(len(onsets), np.nan), np.full(len(onsets), -1)
    starts = onsets + window.first
    inside = (onsets >= 0) & (starts >= 0) & (starts + window.length <= data.shape[1])
    for i in np.flatnonzero(inside):
        piece = data[:, starts[i] : starts[i] + window.length]
        own = np.maximum(piece.max(axis=1), -piece.min(axis=1))
        channels[i] = own.argmax()
        peaks[i] = own[channels[i]]
    return peaks, channels


def cut(data: np.ndarray, onsets: np.ndarray, window: Window) -> np.ndarray:
    """Return the epochs, copied out of the continuous data.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        onsets: ndarray, shape (n_epochs,), sample of each onset.
        window: What to cut; it must lie inside the data.

    Returns:
        ndarray, shape (n_epochs, n_channels, n_times of the window), in that unit.
    """
    epochs = np.empty((len(onsets), len(data), window.length), data.dtype)
    for epoch, onset in zip(epochs, onsets, strict=True):
        epoch[:] = data[:, onset + window.first : onset + window.first + window.length]
    return epochs


def tally(trials: pd.DataFrame, reasons: np.ndarray) -> pd.DataFrame:
    """Return the counts, one row a scenario × case × position, with kept, rejected and a column a reason.

    In the study every scenario has all four cases at both positions, also those without a trial; elsewhere the
    scenario is ``all``, the case the event's name and the position ``event``.

    Args:
        trials: The trial table of the epochs.
        reasons: ndarray, shape (n_trials,), see :func:`judge`.
    """
    if is_study(trials):
        kinds = [
            (scenario, case, position, trials["scenario"].eq(scenario) & trials[column].eq(case))
            for scenario in sorted(trials["scenario"].dropna().unique())
            for position, column in POSITIONS.items()
            for case in CASES
        ]
    else:
        kinds = [("all", name, "event", trials["event"].eq(name)) for name in sorted(trials["event"].unique())]
    rows = []
    for scenario, case, position, mask in kinds:
        mine = reasons[mask.to_numpy(bool)]
        per_reason = {reason: int((mine == reason).sum()) for reason in REASONS}
        kept = int((mine == "").sum())
        rows.append(
            {"scenario": scenario, "case": case, "position": position, "kept": kept}
            | {"rejected": len(mine) - kept}
            | per_reason
        )
    return pd.DataFrame(rows)
