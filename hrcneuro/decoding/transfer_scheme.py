"""How decoders without calibration are compared with calibrated ones. Light to import."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option
from hrcneuro.decoding.scheme import SHRINKAGE

WAYS = ("own", "pooled", "recentred", "joint")
RECENTRING = ("recentred", "joint")
"""Those that need pyRiemann."""
NEEDS_LABELS = ("own", "joint")
"""Those that learn from the labels of calibration trials, so that they need some."""


@dataclass(frozen=True)
class TransferScheme:
    """The parameters of leave-one-subject-out decoding and of its learning curves."""

    ways: tuple[str, ...] = option(
        WAYS,
        "own: trained on the subject's calibration trials; pooled: on all others' trials; recentred: the same, all "
        "subjects recentred; joint: on all others' and the calibration trials",
        choices=WAYS,
    )
    pairs: tuple[int, ...] = option(
        (2, 5, 10, 20, 40),
        "calibration trials a class at the points of the learning curves; none and all stand beside them",
        low=2,
        high=100000,
    )
    draws: int = option(5, "balanced training sets that are drawn; a score is their decoders' mean", low=1, high=1000)
    prior_trials: float = option(
        10.0,
        "how many trials the others' centre counts as where a subject's own is found",
        low=0,
        open_low=True,
    )
    shrinkage: float = option(SHRINKAGE, "lambda of the regularised LDA", low=0, high=1, share=True, open_low=True)
    shuffled: bool = option(False, "shuffle labels within blocks: a control that must come out at chance")
    seed: int = option(2023, "seed of draws, shuffles and random sign flips", low=0)
