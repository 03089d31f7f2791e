"""How well a closed loop has learned, over episodes and over updates, and who did what; means over sessions.

Every interval is a 95 % interval by Student's t over sessions, which are independent of each other; episodes,
steps and decisions of one session are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learners import Kind
from hrcneuro.learning.loop import CASES, STEPS, LoopSessions
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.simulations import Curve, Variant, run_curves
from hrcneuro.learning.task import JointTask

_COLUMNS = 500  # of SIM1 at a time, whose log-odds then stay below 50 MB
ROWS = ("all", "human", "robot")
"""Whose directions an accuracy is over: all four, the person's two, the robot's two."""


@dataclass(frozen=True)
class Mean:
    """A mean over sessions.

    Attributes:
        mean, half_width: The mean, and half the width of its 95 % interval, NaN below two sessions; numbers, or arrays
            of one shape.
        n: Sessions with a value.
    """

    mean: np.ndarray
    half_width: np.ndarray
    n: np.ndarray

    @property
    def low(self) -> np.ndarray:
        """The interval's lower end."""
        return self.mean - self.half_width

    @property
    def high(self) -> np.ndarray:
        """The interval's upper end."""
        return self.mean + self.half_width


def mean_over_sessions(values: np.ndarray) -> Mean:
    """Return the mean along the first axis and its 95 % interval by Student's t.

    Args:
        values: ndarray, shape (n_sessions, ...); NaN where a session has no value.
    """
    there = np.isfinite(values)
    n = there.sum(axis=0)
    counted = np.maximum(n, 1)
    mean = np.where(n > 0, np.where(there, values, 0.0).sum(axis=0) / counted, np.nan)
    away = np.where(there, values - mean, 0.0)
    freedom = np.maximum(n - 1, 1)
    sd = np.sqrt((away * away).sum(axis=0) / freedom)
    half = np.where(n > 1, student.ppf(0.975, freedom) * sd / np.sqrt(counted), np.nan)
    return Mean(mean, half, n)


def ratio_over_sessions(part: np.ndarray, whole: np.ndarray) -> Mean:
    """Return the sum of ``part`` over that of ``whole`` and its 95 % interval by Student's t over sessions.

    Not the mean of the sessions' own shares: in a loop, what is answered decides how often is asked again, so that
    sessions with few cases are those with untypical answers. The interval is that of a ratio estimator (Cochran 1977,
    Sampling Techniques, chapter 6).

    Args:
        part, whole: ndarray, shape (n_sessions, ...): counts; sessions without a case do not count.
    """
    n = (whole > 0).sum(axis=0)
    total = whole.sum(axis=0)
    ratio = np.where(total > 0, part.sum(axis=0) / np.maximum(total, 1), np.nan)
    away = np.where(whole > 0, part - ratio * whole, 0.0)
    freedom = np.maximum(n - 1, 1)
    error = np.sqrt(n / freedom * (away * away).sum(axis=0)) / np.maximum(total, 1)
    half = np.where(n > 1, student.ppf(0.975, freedom) * error, np.nan)
    return Mean(ratio, half, n)


def expected_mean(values: np.ndarray, n: int) -> Mean:
    """Return where the mean of ``n`` further sessions like these is expected, in 95 of 100 cases, by Student's t.

    Args:
        values: ndarray, shape (n_sessions, ...), of simulated sessions.
        n: How many sessions were measured.
    """
    own = mean_over_sessions(values)
    return Mean(own.mean, own.half_width * np.sqrt(1.0 + own.n / max(n, 1)), own.n)


def accuracy(sessions: LoopSessions, rows: str = "all") -> np.ndarray:
    """Return the mean of π(right action | direction) after each episode: ndarray, shape (n_sessions, n_episodes).

    NaN where a session has no such episode, or no such direction.

    Args:
        sessions: Any.
        rows: One of ``ROWS``.
    """
    human = sessions.owners
    counted = {"all": np.ones_like(human), "human": human, "robot": ~human}[rows]
    right = np.where(human, sessions.policies, 1.0 - sessions.policies)
    directions = counted.sum(axis=2)
    total = np.where(counted, right, 0.0).sum(axis=2)
    return np.where(directions > 0, total / np.maximum(directions, 1), np.nan)


def against_updates(sessions: LoopSessions, rows: str, updates: np.ndarray) -> np.ndarray:
    """Return the accuracy after so many updates: ndarray, shape (n_sessions, n_points).

    It is known at episodes' ends: between two it is interpolated, before the first it comes from 1/2. NaN beyond the
    last one, and where a session drew its owners anew or forgot: there updates tell nothing.

    Args:
        sessions: Any.
        rows: One of ``ROWS``.
        updates: ndarray, shape (n_points,): numbers of updates.
    """
    values = accuracy(sessions, rows)
    found = np.full((len(values), len(updates)), np.nan)
    for k, (one, taken) in enumerate(zip(values, sessions.updates, strict=True)):
        here = np.isfinite(one)
        if not here.any() or (sessions.owners[k][here] != sessions.owners[k][here][0]).any():
            continue
        found[k] = np.interp(updates, np.append(0, taken[here]), np.append(0.5, one[here]), right=np.nan)
    return found


def shares(sessions: LoopSessions) -> Mean:
    """Return the share of steps of each kind of ``STEPS``: Mean of shape (5,)."""
    steps = sessions.steps.sum(axis=1)
    return ratio_over_sessions(steps, np.broadcast_to(steps.sum(axis=1, keepdims=True), steps.shape))


def rates_by_case(sessions: LoopSessions) -> Mean:
    """Return how often the decisions that taught were right, by ``CASES``: TNR, TPR, TPR, TNR as fractions."""
    said = sessions.decisions
    right = np.stack([said[:, k, int(case[0] != case[1])] for k, case in enumerate(CASES)], axis=1)
    return ratio_over_sessions(right, said.sum(axis=2))


def continuing(sessions: LoopSessions) -> Mean:
    """Return how often they said that the actor stays, after a robot's and after a human's move: fractions."""
    said = sessions.decisions.reshape(-1, 2, 2, 2).sum(axis=2)
    return ratio_over_sessions(said[..., 0], said.sum(axis=2))


def staying(sessions: LoopSessions) -> Mean:
    """Return how often the person expected that the actor stays, after a robot's and after a human's move."""
    cases = sessions.decisions.sum(axis=2)
    stay = cases[:, [CASES.index("RR"), CASES.index("HH")]]
    return ratio_over_sessions(stay, np.stack([cases[:, :2].sum(axis=1), cases[:, 2:].sum(axis=1)], axis=1))


def pooled_rates(sessions: LoopSessions) -> Rates | None:
    """Return the rates of all decisions that taught, of all sessions together, %.

    Of a case that never came, "takeover" counts as said as often as in the other case of the same actor. None where
    there is no decision at all after one of the two actors' moves.
    """
    said = sessions.decisions.sum(axis=0).reshape(2, 2, 2)
    if not said.sum(axis=(1, 2)).all():
        return None
    said = np.where(said.sum(axis=2, keepdims=True) > 0, said, said[:, ::-1])
    (rr, rh), (hr, hh) = (100.0 * said[..., 1] / said.sum(axis=2)).tolist()
    return Rates(tnr_hh=100.0 - hh, tpr_hr=hr, tnr_rr=100.0 - rr, tpr_rh=rh)


def level_rates(sessions: LoopSessions) -> Rates:
    """Return rates of one height: the share of all decisions that taught and were right, whatever the case, %."""
    said = sessions.decisions.sum(axis=0).reshape(2, 2, 2)
    # Of the robot's moves the robot next is no takeover; of the human's it is.
    right = said[0, 0, 0] + said[0, 1, 1] + said[1, 0, 1] + said[1, 1, 0]
    return Rates.level(100.0 * float(right / said.sum()))


def pooled_takeovers(sessions: LoopSessions) -> tuple[float, float]:
    """Return how often "takeover" was said of the human's moves, and of the robot's: fractions, NaN for none."""
    said = sessions.decisions.reshape(-1, 2, 2, 2).sum(axis=(0, 2))
    after_robot, after_human = _ratio(said[:, 1], said.sum(axis=1))
    return float(after_human), float(after_robot)


def sim1(rates: Rates, kind: Kind, *, episodes: int, repetitions: int, seed: int, tau: float) -> Curve:
    """Return SIM1's curve (paper §3.3) at these rates: ten events an episode, of which nine teach."""
    task = JointTask(episodes=episodes)
    variant = Variant("SIM1", "emp", task, CoinFlips(rates))
    return run_curves(
        [variant], kind.make, repetitions=repetitions, seed=seed, tau=tau, evidence=kind.evidence, columns=_COLUMNS
    )[0]


def sim1_updates(episodes: int) -> np.ndarray:
    """Return how many updates SIM1 has made after each episode: an episode's first event has none before it."""
    return (JointTask().events - 1) * np.arange(1, episodes + 1)


def step_share(sessions: LoopSessions, kind: str, of: Sequence[str]) -> Mean:
    """Return the share of one kind of step among some kinds, as the person's steps that are taken from them."""
    among = sessions.steps[..., [STEPS.index(one) for one in of]].sum(axis=(1, 2))
    return ratio_over_sessions(sessions.steps[..., STEPS.index(kind)].sum(axis=1), among)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    return np.where(whole > 0, part / np.maximum(whole, 1), np.nan)
