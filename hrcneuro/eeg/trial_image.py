"""Single trials side by side, as an ERP image shows them (Jung et al. 2001, doi:10.1002/hbm.1050)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_LINES = 60
_SHARE = 0.05
"""Of the trials that a line is the mean of: enough to see a response in, few enough to see it change."""


@dataclass(frozen=True)
class TrialImage:
    """Trials in an order, a line for each or for the mean of neighbours.

    Attributes:
        lines: ndarray, shape (n_lines, n_times), µV.
        trials: How many each line is the mean of.
        ranks: Place of each line's middle among the trials, ndarray, shape (n_lines,).
        gaps_s: Mean time to the next onset of each line's trials, ndarray, shape (n_lines,), s; NaN where unknown.
    """

    lines: Floats
    trials: int
    ranks: Floats
    gaps_s: Floats

    @property
    def by_gap(self) -> bool:
        """Whether the trials are in the order of the time to the next onset, or in that of the recording."""
        return bool(np.isfinite(self.gaps_s).any())


def trial_image(waves: Floats, gaps_s: Floats) -> TrialImage:
    """Return at most sixty lines, each the mean of a twentieth of the trials; a line a trial where there are few.

    Trials are in the order of the time to the next onset, those without one last; where none has one, as they come.

    Args:
        waves: One channel's trials, ndarray, shape (n_trials, n_times), µV; one trial at least.
        gaps_s: Time to the next onset, ndarray, shape (n_trials,), s; NaN where unknown.
    """
    order = np.argsort(gaps_s, kind="stable")
    width = max(1, round(_SHARE * len(order)))
    firsts = np.linspace(0, len(order) - width, min(len(order) - width + 1, MOST_LINES)).round().astype(int)
    own = [order[first : first + width] for first in firsts]
    known = [gaps_s[trials][np.isfinite(gaps_s[trials])] for trials in own]
    return TrialImage(
        np.stack([waves[trials].mean(axis=0) for trials in own]),
        width,
        firsts + (width - 1) / 2,
        np.array([gaps.mean() if len(gaps) else np.nan for gaps in known]),
    )
