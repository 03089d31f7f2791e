"""What Eq 3–6 do on average, without a single draw: one update exactly, the whole curve by closing the moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from hrcneuro.learning.rates import Rates
from hrcneuro.learning.task import JointTask, taught


def answer_probabilities(human: np.ndarray, rates: Rates) -> np.ndarray:
    """Return the probability of each entry of q to be the next one to grow: ndarray, shape (2 · n_subtasks,).

    Subtasks come with equal probability and independently, so the event before was the human's with probability m/n.

    Args:
        human: ndarray, shape (n_subtasks,), bool: which subtasks are the human's.
        rates: The decoder's four rates.
    """
    share = human.mean()
    rr, rh, hr, hh = rates.by_case / 100.0
    as_human = np.where(human, share * hh + (1 - share) * rh, share * (1 - hr) + (1 - share) * (1 - rr))
    return np.concatenate([as_human, 1.0 - as_human]) / len(human)


@dataclass(frozen=True)
class Step:
    """Mean and covariance of the change of q in one update, shapes (n_entries,) and (n_entries, n_entries)."""

    drift: np.ndarray
    covariance: np.ndarray


def one_update(q: np.ndarray, probabilities: np.ndarray, *, alpha: float, ddof: int = 0) -> Step:
    """Return the exact drift and covariance of one update (Eq 3 and 6): a sum over the entries that may grow.

    Args:
        q: ndarray, shape (n_entries,): the memory.
        probabilities: Of each entry to grow, same shape.
        alpha: Learning rate.
        ddof: As in Eq 6's SD.
    """
    grown = q + alpha * np.eye(len(q))  # one row an outcome
    grown -= grown.mean(axis=1, keepdims=True)
    change = grown / grown.std(axis=1, ddof=ddof, keepdims=True) - q
    drift = probabilities @ change
    away = change - drift
    return Step(drift, (away * probabilities[:, None]).T @ away)


def expected_curve(task: JointTask, rates: Rates, *, alpha: float, tau: float, ddof: int = 0) -> np.ndarray:
    """Return the expected choice accuracy after each episode of an assignment that stays: ndarray, shape (n_episodes,).

    Standardising shifts and rescales q, no more: but for that the memory is a sum of independent steps, each α times
    the SD of the sum so far. The closure replaces this SD by its root mean square. Then a subtask's margin is
    Gaussian with known mean and variance. Only the first step is not small (Eq 6 blows it up to the size of dozens
    of later ones), so everything is conditioned on the entry that it fell on, and averaged over that entry at last.
    Successive answers are taken as independent.
    """
    return expected_together([task], [rates], alpha=alpha, tau=tau, ddof=ddof)[0]


def expected_together(
    tasks: Sequence[JointTask], rates: Sequence[Rates], *, alpha: float, tau: float, ddof: int = 0
) -> list[np.ndarray]:
    """Return :func:`expected_curve` of each task and decoder, those of one size computed at once."""
    expected: list[np.ndarray] = [np.zeros(0)] * len(tasks)
    sizes: dict[tuple, list[int]] = {}
    for i, task in enumerate(tasks):
        sizes.setdefault((task.subtasks, task.episodes, task.events, task.carry_over), []).append(i)
    for members in sizes.values():
        human = np.array([np.arange(tasks[i].subtasks) < tasks[i].chosen for i in members])
        p = np.array([answer_probabilities(h, rates[i]) for h, i in zip(human, members, strict=True)])
        same = np.ones(len(members))
        curves = expected_curves(tasks[members[0]], human, p, alpha=alpha * same, tau=tau * same, ddof=ddof)
        for i, curve in zip(members, curves, strict=True):
            expected[i] = curve
    return expected


def expected_curves(
    task: JointTask, human: np.ndarray, p: np.ndarray, *, alpha: np.ndarray, tau: np.ndarray, ddof: int = 0
) -> np.ndarray:
    """Return :func:`expected_curve` for many decoders and parameters at once: ndarray, shape (n_cases, n_episodes).

    Args:
        task: Gives n, the episodes and which events teach.
        human: ndarray, shape (n_cases, n_subtasks), bool: which subtasks are the human's.
        p: ndarray, shape (n_cases, 2 · n_subtasks): from :func:`answer_probabilities`.
        alpha, tau: ndarray, shape (n_cases,): parameters.
        ddof: As in Eq 6's SD.
    """
    sums = _StepSums(p, ddof)
    accuracy = np.full((len(p), task.episodes), 0.5)
    for episode, useful in enumerate(taught(task).sum(axis=1)):
        for _ in range(int(useful)):
            sums.step(alpha[:, None])
        if sums.started:
            accuracy[:, episode] = _accuracy(p, human, sums, tau)
    return accuracy


class _StepSums:
    """Sums of the steps' sizes and of their squares after the first step, by the entry that the first fell on.

    All arrays have the shape (n_cases, n_entries).
    """

    def __init__(self, p: np.ndarray, ddof: int) -> None:
        level = 1.0 / p.shape[1]
        self.count = p.shape[1] - ddof
        self.around = 1.0 - (p * p).sum(axis=1, keepdims=True)  # mean squared distance of a unit step from its mean
        self.mean = ((p - level) ** 2).sum(axis=1, keepdims=True)  # squared length of that mean, less its level
        self.with_first = 2.0 * (p - level)  # twice its product with the first step
        self.first = 1.0 - level
        self.length, self.squares = np.zeros(p.shape), np.zeros(p.shape)
        self.started = False

    @property
    def spread(self) -> np.ndarray:
        """Root mean square of the memory's SD over entries, by first entry."""
        mean = self.first + self.length * (self.with_first + self.length * self.mean)
        return np.sqrt((mean + self.squares * self.around) / self.count)

    def step(self, alpha: np.ndarray) -> None:
        """Take one more step."""
        if self.started:
            size = alpha * self.spread
            self.length, self.squares = self.length + size, self.squares + size * size
        self.started = True


def _accuracy(p: np.ndarray, human: np.ndarray, sums: _StepSums, tau: np.ndarray) -> np.ndarray:
    """Return Eq 5's mean over subtasks, over the Gaussian margin and over the entry of the first step, (cases,)."""
    half = human.shape[1]
    for_human, for_robot = p[:, None, :half], p[:, None, half:]
    difference = for_human - for_robot
    # Axes: case, entry of the first step, subtask.
    first = np.concatenate([np.eye(half), -np.eye(half)])
    mean = first + sums.length[..., None] * difference
    variance = sums.squares[..., None] * (for_human + for_robot - difference**2)
    # The logistic function is the Gaussian distribution function of SD 1.702 to within 0.01.
    soft = 1.702 * tau[:, None, None] * sums.spread[..., None]
    right = ndtr(np.where(human[:, None], mean, -mean) / np.sqrt(variance + soft * soft)).mean(axis=2)
    return (p * right).sum(axis=1)
