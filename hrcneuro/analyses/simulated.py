"""What the stage simulate simulates: the curves of SIM1-4 (paper, section 3), their task and their learner."""

from __future__ import annotations

from functools import partial
from typing import Any

from hrcneuro.analyses.empirical import Empirical
from hrcneuro.learning.learner import Make, PaperLearner
from hrcneuro.learning.params import TaskParams, values_of
from hrcneuro.learning.simulations import Variant, paper_simulations
from hrcneuro.learning.task import JointTask


def variants_of(config: Any, decoders: Empirical) -> list[Variant]:
    """Return the paper's curves as ``config`` has them, and in SIM1 one of each subject that has a decoder."""
    variants = paper_simulations(
        task_of(config),
        empirical=decoders.decoder,
        levels=config.levels,
        reassign=config.reassign,
        cases=[(n, m) for n, m in config.test_cases],
    )
    # A mean of rates hides who teaches well and who does not.
    return variants + [Variant("SIM1", unit, task_of(config), decoder) for unit, decoder in decoders.subjects.items()]


def task_of(config: Any) -> JointTask:
    """Return the configured task."""
    return JointTask(**values_of(TaskParams, config))


def paper_learner(config: Any) -> Make:
    """Return what makes learners by Eq 3-6, as configured."""
    return partial(PaperLearner, alpha=config.alpha, ddof=config.ddof)
