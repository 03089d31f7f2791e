"""The parameters of §3, declared once: values only, so that a configuration loads without NumPy."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from hrcneuro import published
from hrcneuro.contract import option

MOST_SUBTASKS = 32
PARTNERS = (FIXED, ADAPTING) = ("fixed", "adapting")
LEARNERS = ("paper", "votes", "confidence", "bayes", "bayes_graded", "forgetting", "adaptive")


@dataclass(frozen=True)
class RateParams:
    """How often a decoder is right in the four situations of Table 1; the defaults are Table 2's, iC."""

    tnr_hh: float = option(
        published.SIM1_RATES.value[0], "TNR_HH of Table 2, iC (rates = paper)", unit="%", low=0, high=100
    )
    tpr_hr: float = option(published.SIM1_RATES.value[1], "TPR_HR of Table 2, iC", unit="%", low=0, high=100)
    tnr_rr: float = option(published.SIM1_RATES.value[2], "TNR_RR of Table 2, iC", unit="%", low=0, high=100)
    tpr_rh: float = option(published.SIM1_RATES.value[3], "TPR_RH of Table 2, iC", unit="%", low=0, high=100)


@dataclass(frozen=True)
class LearnerParams:
    """How a learner takes in answers (Eq 3, 5 and 6), and what the learner 'forgetting' expects."""

    alpha: float = option(published.LEARNING_RATE.value, "learning rate of Eq 3", low=0, high=100, open_low=True)
    tau: float = option(published.TEMPERATURE.value, "temperature of Eq 5", low=0, high=100, open_low=True)
    ddof: int = option(0, "Eq 6 divides by the SD with N - ddof", low=0, high=1)
    horizon: float = option(40.0, "episodes between reassignments that the learner 'forgetting' expects", low=1)


@dataclass(frozen=True)
class TaskParams:
    """The size of the joint task (§3.1), and how long it is learned."""

    subtasks: int = option(published.SUBTASKS.value, "subtasks n of SIM1-3", low=2, high=MOST_SUBTASKS)
    chosen: int = option(
        published.CHOSEN.value, "subtasks m of SIM1-3 that the human takes", low=1, high=MOST_SUBTASKS - 1
    )
    episodes: int = option(published.EPISODES.value, "episodes", low=1, high=100_000)
    events: int = option(published.EVENTS.value, "events in an episode", low=1, high=1000)
    period: int = option(published.REASSIGNED_AFTER.value, "episodes between reassignments", low=1, high=100_000)
    carry_over: bool = option(False, "an episode's first event follows the last of the episode before")


def values_of(params: type, of: Any) -> dict[str, Any]:
    """Return the values that ``of``, which derives from ``params``, has for its fields."""
    return {f.name: getattr(of, f.name) for f in fields(params)}
