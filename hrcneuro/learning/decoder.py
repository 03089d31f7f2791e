"""What the robot is told about each event: Eq 4, a decoder that is right at one of four rates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hrcneuro.learning.evidence import decision_odds, graded_odds
from hrcneuro.learning.rates import Rates, case
from hrcneuro.learning.task import Draws, actors, previous_actors


def decide(before: np.ndarray, acting: np.ndarray, epsilon: np.ndarray, rates: Rates) -> np.ndarray:
    """Return the predicted next action of Eq 4, bool (true: the human), same shape as the arguments.

    A draw of U(0, 100) not above the situation's rate gives who really acts next, any other draw the other one.
    """
    correct = epsilon <= rates.by_case[case(before, acting)]
    return correct == acting


@dataclass(frozen=True)
class Answers:
    """What a decoder says about each event; every ndarray has shape (n_episodes, n_events, n_repetitions).

    Attributes:
        predicted: Who acts next, bool (true: the human).
        decision: Log-odds of human against robot that the decision alone carries.
        graded: The same from the decoder's graded score.
    """

    predicted: np.ndarray
    decision: np.ndarray | None = None
    graded: np.ndarray | None = None

    def log_odds(self, kind: str) -> np.ndarray:
        """Return the log-odds of a kind, ``decision`` or ``graded``."""
        odds = {"decision": self.decision, "graded": self.graded}[kind]
        if odds is None:
            raise ValueError(f"{kind} log-odds were not asked for: answer(..., evidence=True) computes them")
        return odds

    def first(self, repetitions: int) -> Answers:
        """Return the first repetitions only."""
        parts = (self.predicted, self.decision, self.graded)
        return Answers(*(None if part is None else part[..., :repetitions] for part in parts))  # type: ignore[arg-type]


class Decoder(Protocol):
    """Anything that the robot can listen to."""

    def answer(self, draws: Draws, rng: np.random.Generator, *, evidence: bool = False) -> Answers:
        """Return the answers to all events; with ``evidence`` the log-odds too."""


@dataclass(frozen=True)
class CoinFlips:
    """The paper's simulated decoder: independent answers at four rates."""

    rates: Rates

    def answer(self, draws: Draws, rng: np.random.Generator, *, evidence: bool = False) -> Answers:
        """Return Eq 4's answers; the log-odds are those of :mod:`hrcneuro.learning.evidence`."""
        acting = actors(draws)
        before = previous_actors(acting, carry_over=draws.task.carry_over)
        predicted = decide(before, acting, draws.epsilon, self.rates)
        if not evidence:
            return Answers(predicted)
        return Answers(
            predicted,
            decision_odds(before, predicted, self.rates),
            graded_odds(before, acting, draws.epsilon, self.rates),
        )
