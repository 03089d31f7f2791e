"""How problems are decoded: what features remove, how strongly is regularised, folds, chance. Light to import."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.contract import option

MEAN_WINDOW_S = published.REMOVED_MEAN_S.value
SHRINKAGE = published.SHRINKAGE.value
FEATURES_END_S = 0.6
"""The end of the last of the 15 windows (paper 2.5.4), seconds."""


@dataclass(frozen=True)
class Scheme:
    """The parameters of decoding (paper 2.5.4, 2.6.2)."""

    mean_window_s: tuple[float, ...] = option(MEAN_WINDOW_S, "start and end of the mean that is removed", unit="s")
    shrinkage: float = option(SHRINKAGE, "lambda of the regularised LDA", low=0, high=1, share=True, open_low=True)
    folds: int = option(
        published.REPEATS_FOLDS.value[1], "folds; fewer where the smaller class has fewer trials", low=2, high=1000
    )
    repeats: int = option(published.REPEATS_FOLDS.value[0], "how often the folds are drawn anew", low=1, high=1000)
    balance: str = option(
        "undersample",
        "how training sets are balanced; oversampling biases towards the larger class",
        choices=("undersample", "oversample", "none"),
    )
    permutations: int = option(199, "label permutations for a subject's p value; 0 for none", low=0, high=100000)
    min_stratum: int = option(5, "trials a class below which a stratum is not scored", low=1)


PAPER = Scheme()
