"""Other ways to learn from the same answers: votes, confidence, Bayes, forgetting. Each has the paper's interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import expit

from hrcneuro.learning.learner import Learner, Make, Number, PaperLearner

HORIZONS = (25.0, 100.0, 400.0, 1e5)  # of the adaptive learner; the last is "never" in any session


class ConfidenceLearner(PaperLearner):
    """Eq 3–6 with a step that grows with the decoder's confidence.

    The step is α · |log-odds| over the running mean of |log-odds|, so that α keeps its meaning; the log-odds' sign
    says whose entry grows.
    """

    def __init__(self, subtasks: int, columns: int, *, alpha: Number, ddof: int = 0) -> None:
        super().__init__(subtasks, columns, alpha=alpha, ddof=ddof)
        self._half = subtasks * columns
        self._total = np.zeros(columns)
        self._events = 0

    def update(self, entry: np.ndarray, evidence: np.ndarray | None = None) -> None:
        """Weigh the answer by its log-odds."""
        odds = _needed(evidence)
        size = np.abs(odds)
        self._total += size
        self._events += 1
        share = size * self._events / np.where(self._total > 0, self._total, 1.0)
        # An answer that says nothing has to move something: Eq 6 is not defined on a memory of equal values.
        weight = np.where(self._total > 0, share, 1.0)
        self.step(entry % self._half + np.where(odds < 0, self._half, 0), self.alpha * weight)


class BayesLearner:
    """The posterior log-odds that a subtask is the human's, each subtask on its own, the assignment never changing."""

    def __init__(self, subtasks: int, columns: int) -> None:
        self.odds = np.zeros((subtasks, columns))
        self._flat = self.odds.reshape(-1)

    def update(self, entry: np.ndarray, evidence: np.ndarray | None = None) -> None:
        """Add the answer's log-odds (Bayes' rule) to the event's subtask."""
        self._flat[entry % len(self._flat)] += _needed(evidence)

    def end_episode(self) -> None:
        """Nothing to do: time alone changes no belief."""

    def margin(self) -> np.ndarray:
        """Return the log-odds: ndarray, shape (n_subtasks, n_columns)."""
        return self.odds


class VotesLearner(BayesLearner):
    """Counts answers, human minus robot: Bayes for a decoder of one rate, and the simplest thing that could work."""

    def update(self, entry: np.ndarray, evidence: np.ndarray | None = None) -> None:
        """Count the answer as one vote."""
        half = len(self._flat)
        self._flat[entry % half] += np.where(entry < half, 1.0, -1.0)


class ForgettingLearner(BayesLearner):
    """Bayes for assignments that are redrawn now and then: after each episode the belief is drawn toward one half.

    The exact filter of a two-state world that changes with probability h (Glaze, Kable & Gold 2015,
    doi:10.7554/eLife.08825). A redraw of tasks changes a subtask's owner in about half the cases, so that
    h = 1 / (2 · horizon).

    Args:
        subtasks, columns: Size of the memory.
        horizon: Expected number of episodes from one redraw to the next.
    """

    def __init__(self, subtasks: int, columns: int, *, horizon: float) -> None:
        super().__init__(subtasks, columns)
        change = 0.5 / horizon
        self._edge = np.log((1.0 - change) / change)

    def end_episode(self) -> None:
        """Widen what is believed, since the subtasks may be assigned anew before the next episode."""
        odds, edge = self.odds, self._edge
        odds += np.logaddexp(edge, -odds) - np.logaddexp(edge, odds)


class AdaptiveLearner:
    """Several forgetting learners, weighted by how well each has foretold the answers (Bayesian model averaging).

    It need not be told whether, or how often, tasks change.

    Args:
        subtasks, columns: Size of the memory.
        horizons: Expected numbers of episodes between redraws, one a member; all are equally credible at first.
    """

    def __init__(self, subtasks: int, columns: int, *, horizons: Sequence[float]) -> None:
        self.members = [ForgettingLearner(subtasks, columns, horizon=horizon) for horizon in horizons]
        self.weights = np.full((len(horizons), columns), 1.0 / len(horizons))  # posterior of each member

    def update(self, entry: np.ndarray, evidence: np.ndarray | None = None) -> None:
        """Weigh the members by the answer's likelihood, then let each learn from it."""
        odds = _needed(evidence)
        ratio = np.exp(odds)
        for weight, member in zip(self.weights, self.members, strict=True):
            believed = expit(member.odds.reshape(-1)[entry % member.odds.size])
            weight *= 1.0 + believed * (ratio - 1.0)
            member.update(entry, odds)
        self.weights /= self.weights.sum(axis=0)

    def end_episode(self) -> None:
        """Let each member allow for a redraw."""
        for member in self.members:
            member.end_episode()

    def margin(self) -> np.ndarray:
        """Return the log-odds of the members' mean belief: ndarray, shape (n_subtasks, n_columns)."""
        human = sum(w * expit(m.odds) for w, m in zip(self.weights, self.members, strict=True))
        robot = sum(w * expit(-m.odds) for w, m in zip(self.weights, self.members, strict=True))
        return np.log(np.maximum(human, 1e-300)) - np.log(np.maximum(robot, 1e-300))


def _needed(evidence: np.ndarray | None) -> np.ndarray:
    if evidence is None:
        raise ValueError("this learner weighs answers by their log-odds, and got none")
    return evidence


@dataclass(frozen=True)
class Kind:
    """A learner by name: how it is made, and which log-odds it listens to (``decision`` or ``graded``)."""

    make: Make
    evidence: str
    text: str


def kinds(*, alpha: float, ddof: int, horizon: float) -> dict[str, Kind]:
    """Return every learner; ``paper`` comes first."""
    paper: Callable[[int, int], Learner] = partial(PaperLearner, alpha=alpha, ddof=ddof)
    return {
        "paper": Kind(paper, "decision", "Eq 3-6"),
        "votes": Kind(VotesLearner, "decision", "counts answers"),
        "confidence": Kind(
            partial(ConfidenceLearner, alpha=alpha, ddof=ddof), "graded", "Eq 3-6, step weighted by log-odds"
        ),
        "bayes": Kind(BayesLearner, "decision", "Bayes, decisions weighted by their rates"),
        "bayes_graded": Kind(BayesLearner, "graded", "Bayes, graded scores"),
        "forgetting": Kind(
            partial(ForgettingLearner, horizon=horizon), "graded", "Bayes, graded scores, tasks may change"
        ),
        "adaptive": Kind(
            partial(AdaptiveLearner, horizons=HORIZONS), "graded", "the same, how often tasks change is learned too"
        ),
    }
