"""When a learning curve first reaches a level, and how long that takes a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrcneuro import published
from hrcneuro.learning.simulations import Curve

LEVELS = tuple(printed.value for printed in published.SIM1_ACCURACY.values())  # of choice accuracy
# (simulation, decoder, level) -> the episode at which the paper says that it is reached, and after how many minutes.
PRINTED = {
    ("SIM1", "emp", printed.value): (episode, published.SIM1_MINUTES[episode].value)
    for episode, printed in published.SIM1_ACCURACY.items()
}


@dataclass(frozen=True)
class Milestone:
    """The first episode (counted from 1) whose mean accuracy reaches a level; None where none does.

    Attributes:
        earliest, latest: The same for the upper and the lower edge of the mean's 95 % band.
    """

    episode: int | None
    earliest: int | None
    latest: int | None


def first_at(values: np.ndarray, level: float) -> int | None:
    """Return the first episode, counted from 1, at which ``values`` are at least ``level``."""
    reached = np.flatnonzero(values >= level)
    return int(reached[0]) + 1 if len(reached) else None


def milestone(curve: Curve, level: float) -> Milestone:
    """Return when a curve reaches ``level``."""
    band = curve.half_width
    return Milestone(
        first_at(curve.mean, level), first_at(curve.mean + band, level), first_at(curve.mean - band, level)
    )


def minutes(episode: int | None, *, events: int, trial_s: float) -> float:
    """Return how long so many episodes take, nan for None."""
    return float("nan") if episode is None else episode * events * trial_s / 60.0


@dataclass(frozen=True)
class Relearned:
    """What a reassignment costs: accuracy at the end of each assignment's term, shape (n_assignments,).

    Attributes:
        episode: The term's last episode, counted from 1.
        mean, half_width: Accuracy there, with half its 95 % band.
        loss: Accuracy at the end of the first term minus accuracy here, and half the width of its 95 % band.
    """

    episode: np.ndarray
    mean: np.ndarray
    half_width: np.ndarray
    loss: np.ndarray
    loss_half_width: np.ndarray


def relearned(curve: Curve, segment: np.ndarray) -> Relearned:
    """Return the accuracy at the end of each assignment's term (SIM3).

    The two ends of a loss come from the same repetitions; their band is taken as if they did not, which is wider.
    """
    last = np.flatnonzero(np.diff(segment, append=segment[-1] + 1))
    mean, band = curve.mean[last], curve.half_width[last]
    return Relearned(last + 1, mean, band, mean[0] - mean, np.where(last == last[0], 0.0, np.hypot(band, band[0])))
