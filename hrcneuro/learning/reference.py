"""Eq 3–6 for one repetition, as printed: the reference of :mod:`hrcneuro.learning.learner`, equal to the last bit."""

from __future__ import annotations

import math

import numpy as np

from hrcneuro.learning.rates import Rates
from hrcneuro.learning.task import Draws

HUMAN, ROBOT = 0, 1


def learn_one(draws: Draws, repetition: int, rates: Rates, *, alpha: float, tau: float, ddof: int = 0) -> list[float]:
    """Return the choice accuracy after each episode: the mean of π(correct action) over all subtasks.

    Args:
        draws: The random draws; only those of ``repetition`` are read.
        rates: The decoder's four rates, per cent.
        alpha: Learning rate α of Eq 3 (the reward R is 1).
        tau: Temperature τ of Eq 5.
        ddof: Eq 6 divides by the SD with N − ddof in its denominator.
    """
    task = draws.task
    n = task.subtasks
    q = [[0.0, 0.0] for _ in range(n)]  # q(s, a)
    accuracy = []
    before: int | None = None
    for episode, segment in enumerate(task.segment):
        owner = [HUMAN if human else ROBOT for human in draws.human[segment, :, repetition]]
        if not task.carry_over:
            before = None
        for event in range(task.events):
            s = int(draws.subtask[episode, event, repetition])
            if before is not None:
                predicted = _decode(before, owner[s], draws.epsilon[episode, event, repetition], rates)  # Eq 4
                q[s][predicted] += alpha * 1.0  # Eq 3
                q = _standardise(q, ddof)  # Eq 6
            before = owner[s]
        policy = [_softmax(q[s], tau) for s in range(n)]  # Eq 5
        accuracy.append(_sum(policy[s][owner[s]] for s in range(n)) / n)
    return accuracy


def _decode(before: int, now: int, epsilon: float, rates: Rates) -> int:
    if (before, now) == (HUMAN, HUMAN):
        return HUMAN if epsilon <= rates.tnr_hh else ROBOT
    if (before, now) == (HUMAN, ROBOT):
        return ROBOT if epsilon <= rates.tpr_hr else HUMAN
    if (before, now) == (ROBOT, ROBOT):
        return ROBOT if epsilon <= rates.tnr_rr else HUMAN
    return HUMAN if epsilon <= rates.tpr_rh else ROBOT


def _standardise(q: list[list[float]], ddof: int) -> list[list[float]]:
    # Over all entries: over each subtask's two alone the memory would forget everything but the last answer.
    order = [(s, a) for a in (HUMAN, ROBOT) for s in range(len(q))]
    mean = _sum(q[s][a] for s, a in order) / len(order)
    variance = _sum((q[s][a] - mean) * (q[s][a] - mean) for s, a in order) / (len(order) - ddof)
    sd = math.sqrt(variance)
    return [[(value - mean) / sd for value in row] for row in q]


def _softmax(q: list[float], tau: float) -> list[float]:
    # e^x / (e^x + e^y) = 1 / (1 + e^(y - x)), which cannot overflow into nan.
    with np.errstate(over="ignore"):
        return [float(1.0 / (1.0 + np.exp((q[1 - a] - q[a]) / tau))) for a in (HUMAN, ROBOT)]


def _sum(values: object) -> float:
    # Plain left-to-right addition; Python 3.12's sum() compensates, which changes the last bit.
    total = 0.0
    for value in values:  # type: ignore[attr-defined]
        total += value
    return total
