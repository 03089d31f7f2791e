"""Eq 3, 5 and 6 for many repetitions at once; bit for bit what :mod:`hrcneuro.learning.reference` computes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from hrcneuro.learning.task import Draws, taught

Number = float | np.ndarray


class Learner(Protocol):
    """What every learner can do; a column is one repetition of one simulation."""

    def update(self, entry: np.ndarray, evidence: np.ndarray | None) -> None:
        """Take in one event.

        Args:
            entry: Subtask and predicted actor as a flat index into an array of shape (2 · n_subtasks, n_columns) whose
                first half is the human's, intp, shape (n_columns,).
            evidence: ndarray, shape (n_columns,): log-odds of human against robot that the decoder gives to this event.
        """

    def end_episode(self) -> None:
        """Take note that an episode has ended."""

    def margin(self) -> np.ndarray:
        """Return how much more the human's action is worth than the robot's: ndarray, shape (n_subtasks, n_columns)."""


Make = Callable[[int, int], Learner]  # (subtasks, columns) -> a fresh learner


class PaperLearner:
    """The paper's memory q: a constant step for the predicted action, then standardised over all its entries.

    Args:
        subtasks, columns: Size of the memory; at least two columns, since NumPy adds up a lone one in another order.
        alpha: Learning rate, one number or one a column.
        ddof: Eq 6 divides by the SD with N − ddof in its denominator.
    """

    def __init__(self, subtasks: int, columns: int, *, alpha: Number, ddof: int = 0) -> None:
        if columns < 2:
            raise ValueError(f"{columns} column; a vectorised learner needs two or more")
        self.alpha, self.ddof = alpha, ddof
        self.q = np.zeros((2 * subtasks, columns))  # the human's entries, then the robot's
        self._flat = self.q.reshape(-1)
        self._square = np.empty_like(self.q)
        self._row = np.empty(columns)

    def update(self, entry: np.ndarray, evidence: np.ndarray | None = None) -> None:
        """Add α to the entries (Eq 3) and standardise (Eq 6)."""
        self.step(entry, self.alpha)

    def step(self, entry: np.ndarray, amount: Number) -> None:
        """Add ``amount`` to the entries and standardise."""
        q, row, count = self.q, self._row, len(self.q)
        self._flat[entry] += amount
        np.add.reduce(q, axis=0, out=row)
        row /= count
        np.subtract(q, row, out=q)
        np.multiply(q, q, out=self._square)
        np.add.reduce(self._square, axis=0, out=row)
        row /= count - self.ddof
        np.sqrt(row, out=row)
        np.divide(q, row, out=q)

    def end_episode(self) -> None:
        """Nothing to do: an episode's end is nothing to this learner."""

    def margin(self) -> np.ndarray:
        """Return q(s, human) − q(s, robot): ndarray, shape (n_subtasks, n_columns)."""
        half = len(self.q) // 2
        return self.q[:half] - self.q[half:]


def accuracy(margin: np.ndarray, human: np.ndarray, tau: Number) -> np.ndarray:
    """Return the mean over subtasks of π(correct action) (Eq 5): ndarray, shape (n_columns,).

    Args:
        margin: ndarray, shape (n_subtasks, n_columns): q(s, human) − q(s, robot).
        human: Which subtasks are the human's, bool, same shape.
        tau: Temperature, one number or one a column.
    """
    with np.errstate(over="ignore"):
        right = 1.0 / (1.0 + np.exp(np.where(human, -margin, margin) / tau))
    return np.add.reduce(right, axis=0) / len(right)


def greedy(margin: np.ndarray, human: np.ndarray) -> np.ndarray:
    """Return the share of subtasks whose better-valued action is correct, ties a half: ndarray, shape (n_columns,)."""
    return 0.5 + 0.5 * np.sign(np.where(human, margin, -margin)).mean(axis=0)


def learn(
    make: Make,
    draws: Sequence[Draws],
    predicted: Sequence[np.ndarray],
    *,
    tau: Number,
    evidence: Sequence[np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return choice accuracy and greedy accuracy after each episode, each of shape (n_episodes, n_columns).

    The columns are the repetitions of the first draws, then those of the second, and so on.

    Args:
        make: Returns a fresh learner for so many subtasks and columns.
        draws: Draws whose tasks agree in subtasks, episodes, events and carry-over.
        predicted: ndarray, shape (n_episodes, n_events, n_repetitions), bool: the decoder's answers, true: human.
        tau: Temperature, one number or one a column.
        evidence: Log-odds of human against robot, same shapes; learners that count decisions alone need none.
    """
    task = draws[0].task
    if any(_frame(d) != _frame(draws[0]) for d in draws):
        raise ValueError("the draws' tasks differ in subtasks, episodes, events or carry-over")
    used = sum(d.repetitions for d in draws)
    twice = 2 if used == 1 else 1  # a lone column goes twice, see PaperLearner
    column = np.arange(used * twice)
    learner = make(task.subtasks, len(column))
    useful = taught(task)
    segments = [d.task.segment for d in draws]
    soft, hard = np.empty((task.episodes, used)), np.empty((task.episodes, used))

    def joined(parts: list[np.ndarray]) -> np.ndarray:
        return np.concatenate(parts * twice, axis=-1)

    for episode in range(task.episodes):
        entries = joined([_rows(d, p, episode) for d, p in zip(draws, predicted, strict=True)]) * len(column) + column
        odds = None if evidence is None else joined([e[episode] for e in evidence])
        for event in np.flatnonzero(useful[episode]):
            learner.update(entries[event], None if odds is None else odds[event])
        learner.end_episode()
        human = joined([d.human[segment[episode]] for d, segment in zip(draws, segments, strict=True)])
        margin = learner.margin()
        soft[episode], hard[episode] = accuracy(margin, human, tau)[:used], greedy(margin, human)[:used]
    return soft, hard


def _rows(draws: Draws, predicted: np.ndarray, episode: int) -> np.ndarray:
    robot = (~predicted[episode]).view(np.uint8)
    return (draws.subtask[episode] + robot * np.uint8(draws.task.subtasks)).astype(np.intp)


def _frame(draws: Draws) -> tuple[int, int, int, bool]:
    task = draws.task
    return task.subtasks, task.episodes, task.events, task.carry_over
