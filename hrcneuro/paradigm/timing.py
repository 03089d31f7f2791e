"""When moves begin: the arm's travel, the wait for the next partner, pauses and breaks (paper §2.3.1–2.3.2).

The arm needs t_f for a tile. Within 2 mm of its goal, from 0.846 t_f on (minimum jerk, 7 cm), the next command is
accepted, and the motion starts when the arm is at rest. The robot's own command is there at once; a human presses after
a reaction time, counted from the moment at which keys are accepted.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from hrcneuro.paradigm.conditions import EPISODE
from hrcneuro.paradigm.params import TimingParams

IN_RADIUS = 0.846
"""Share of t_f after which the end-effector stays within 2 mm of the tile's centre."""


def assign_onsets(
    trials: pd.DataFrame, *, rng: np.random.Generator, params: TimingParams = TimingParams()
) -> pd.DataFrame:
    """Return the moves of one subject with onset_s (seconds from the recording's start) and t_f_s.

    Onsets ascend; the first lies ``lead_in_s`` after the start; an episode begins ``pause_s`` and a block ``break_s``
    after the end of the one before, each stretched by up to a half at random.

    Args:
        trials: One row a move in order, with practice, block, episode and actor.
        rng: The subject's generator.
        params: When moves begin.

    Raises:
        ValueError: No beta distribution between the shortest and the longest motion has this mean and deviation.
    """
    n = len(trials)
    t_f = travel(n, rng=rng, params=params)
    reaction = np.maximum(reactions(n, rng=rng, params=params), 0.0)
    stretch = rng.uniform(1.0, 1.5, n)
    human = trials["actor"].to_numpy(dtype=object) == "human"
    block = trials.groupby(list(EPISODE[:2]), sort=False, observed=True).ngroup().to_numpy()
    episode = trials.groupby(list(EPISODE), sort=False, observed=True).ngroup().to_numpy()

    accepted = IN_RADIUS * t_f
    earliest = t_f if params.start_next == "at_rest" else accepted
    # step[i] is the time from onset i to onset i + 1, whose mover may be a human.
    command = np.where(human[1:], accepted[:-1] + reaction[1:], accepted[:-1])
    step = np.maximum(np.maximum(earliest[:-1], command), params.soa_min_s)
    step += np.where(np.diff(episode) != 0, params.pause_s * stretch[1:], 0.0)
    step += np.where(np.diff(block) != 0, params.break_s * stretch[1:], 0.0)
    out = trials.copy()
    out["onset_s"] = params.lead_in_s + np.concatenate([[0.0], np.cumsum(step)])[:n]
    out["t_f_s"] = t_f
    return out


def check_travel(params: TimingParams) -> None:
    """Refuse durations of a motion that do not fit their range.

    Raises:
        ValueError: No beta distribution between the shortest and the longest motion has this mean and deviation.
    """
    low, high = params.t_f_min_s, params.t_f_max_s
    if high > low and params.t_f_sd_s > 0:
        _beta(params)


def travel(n: int, *, rng: np.random.Generator, params: TimingParams) -> np.ndarray:
    """Return the duration of each motion, in seconds, shape (n,)."""
    low, high = params.t_f_min_s, params.t_f_max_s
    if high <= low or params.t_f_sd_s == 0:
        return np.full(n, min(max(params.t_f_mean_s, low), high))
    a, b = _beta(params)
    return low + (high - low) * rng.beta(a, b, n)


def _beta(params: TimingParams) -> tuple[float, float]:
    """Return the parameters a and b of the motion's duration, as a share of the way from shortest to longest."""
    low, high = params.t_f_min_s, params.t_f_max_s
    mean, var = (params.t_f_mean_s - low) / (high - low), (params.t_f_sd_s / (high - low)) ** 2
    size = mean * (1 - mean) / var - 1
    if not (0 < mean < 1 and size > 0):
        raise ValueError(
            f"a motion of {params.t_f_mean_s:g} ± {params.t_f_sd_s:g} s does not fit between {low:g} and {high:g} s"
        )
    return mean * size, (1 - mean) * size


def reactions(n: int, *, rng: np.random.Generator, params: TimingParams) -> np.ndarray:
    """Return a human's reaction times, in seconds, shape (n,), counted from when keys are accepted."""
    # Log-normal with the given mean and standard deviation: reaction times are skewed to the right.
    if params.reaction_mean_s <= 0:
        return np.zeros(n)
    spread = np.log1p((params.reaction_sd_s / params.reaction_mean_s) ** 2)
    return rng.lognormal(np.log(params.reaction_mean_s) - spread / 2, np.sqrt(spread), n)
