"""A learner that takes one decision at a time, and its policy: the learners of :mod:`.learners`, as simulated.

A subtask is the direction of the next step on the path (N, E, S or W). At the onset of a move it is decoded whom the
person expects to do the next one; that answer teaches the robot who does steps of this direction (paper Eq 3 to 6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hrcneuro.learning.evidence import decision_odds
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.learners import Kind
from hrcneuro.learning.rates import Rates

SUBTASKS = ("N", "E", "S", "W")
"""Directions of a step, in the order of the learner's memory."""
HUMAN, ROBOT = "human", "robot"
_COLUMNS = 2  # a lone column would be added up in another order than in simulations
_MOST_FLOOR = 0.5

Values = dict[str, tuple[float, float]]
"""Subtask -> what the human's and the robot's action are worth."""
Policy = dict[str, float]
"""Subtask -> the probability that the robot leaves it to the human; the rest is that it acts itself."""


class OnlineLearner:
    """What the robot has learned of who does what.

    Attributes:
        updates: How many answers it has taken.
    """

    def __init__(self, kind: Kind, *, tau: float, floor: float = 0.0, rates: Rates | None = None) -> None:
        """Begin with no knowledge: either action has the probability 1/2.

        Args:
            kind: Which learner, from :func:`.learners.kinds`.
            tau: Temperature of Eq 5.
            floor: Least probability of each action: the robot keeps trying what it believes to be wrong.
            rates: The decoder's held-out rates, for learners that weigh an answer by them; None where unknown: those
                learners then hear answers that say nothing.

        Raises:
            ValueError: The floor is not within 0 and 0.5.
        """
        if not 0.0 <= floor <= _MOST_FLOOR:
            raise ValueError(f"a floor of {floor:g} for each of two actions; allowed: 0 to {_MOST_FLOOR:g}")
        self._kind, self._tau, self._floor = kind, tau, floor
        known = rates if rates is not None else Rates.level(50)
        # By 2·(by the human) + (the human next).
        self._decision_odds = decision_odds(np.array([0, 0, 1, 1], bool), np.array([0, 1, 0, 1], bool), known)
        self.afresh()

    def afresh(self) -> None:
        """Forget everything, as where the subtasks have been assigned anew."""
        self._learner = self._kind.make(len(SUBTASKS), _COLUMNS)
        self.updates = 0

    def update(self, subtask: str, *, before: str, takeover: bool, log_odds: float) -> None:
        """Take one decision.

        Args:
            subtask: The direction of the next step.
            before: Who makes the move at whose onset it was decoded, ``human`` or ``robot``.
            takeover: Whether the other one is expected to act next.
            log_odds: log P(score | takeover) / P(score | no takeover).

        Raises:
            ValueError: The direction is none of the four, or the log-odds are no finite number.
        """
        if subtask not in SUBTASKS:
            raise ValueError(f"{subtask!r} is no subtask; allowed: {', '.join(SUBTASKS)}")
        if not math.isfinite(log_odds):
            raise ValueError(f"log-odds of {log_odds}; they must be a finite number")
        by_human = before == HUMAN
        human_next = by_human != takeover
        if self._kind.evidence == "decision":
            odds = float(self._decision_odds[2 * by_human + human_next])
        else:
            odds = -log_odds if by_human else log_odds
        row = SUBTASKS.index(subtask) + (0 if human_next else len(SUBTASKS))
        entry = row * _COLUMNS + np.arange(_COLUMNS)
        self._learner.update(entry, np.full(_COLUMNS, odds))
        self.updates += 1

    def end_episode(self) -> None:
        """Take note that an episode has ended."""
        self._learner.end_episode()

    def margin(self) -> np.ndarray:
        """Return how much more the human's action is worth: ndarray, shape (4,), in the order of ``SUBTASKS``."""
        return np.array(self._learner.margin()[:, 0], float)

    def values(self) -> Values:
        """Return q(s, human) and q(s, robot) of each subtask; of learners by Bayes' rule their log-probabilities."""
        if isinstance(self._learner, PaperLearner):
            q = self._learner.q[:, 0]
            return {s: (float(q[i]), float(q[i + len(SUBTASKS)])) for i, s in enumerate(SUBTASKS)}
        return {
            s: (-float(np.logaddexp(0.0, -m)), -float(np.logaddexp(0.0, m)))
            for s, m in zip(SUBTASKS, self.margin(), strict=True)
        }

    def policy(self) -> Policy:
        """Return π(human | s) of each subtask (Eq 5), kept off 0 and 1 by the floor."""
        with np.errstate(over="ignore"):
            human = 1.0 / (1.0 + np.exp(-self.margin() / self._tau))
        human = self._floor + (1.0 - 2.0 * self._floor) * human
        return {s: float(p) for s, p in zip(SUBTASKS, human, strict=True)}


def rates_of(problems: Mapping[str, Mapping[str, float | str | None]]) -> Rates | None:
    """Return the rates of a decoder from its own figures: a mapping a problem, with ``actor``, ``tnr`` and ``tpr``, %.

    None where one of the two problems has no figures.
    """
    by_actor = {str(one.get("actor")): (one.get("tnr"), one.get("tpr")) for one in problems.values()}
    pairs = [by_actor.get(actor, (None, None)) for actor in (HUMAN, ROBOT)]
    numbers = [float(value) for pair in pairs for value in pair if isinstance(value, int | float)]
    if len(numbers) != 4 or not all(math.isfinite(value) for value in numbers):
        return None
    return Rates(tnr_hh=numbers[0], tpr_hr=numbers[1], tnr_rr=numbers[2], tpr_rh=numbers[3])
