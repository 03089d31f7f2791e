"""Learners compared on the same draws, as rows of tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses.learning_curves import task_columns
from hrcneuro.learning.compare import Comparison, compare, paired
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.params import LearnerParams
from hrcneuro.learning.simulations import Variant


def compared_in(variants: Sequence[Variant]) -> list[Variant]:
    """Return the curves in which learners are compared: all of the empirical decoder, and SIM2's and SIM3's."""
    return [v for v in variants if v.name.endswith("emp") or v.simulation in ("SIM2", "SIM3")]


def comparison(variants: Sequence[Variant], params: LearnerParams, *, repetitions: int, seed: int) -> Comparison:
    """Return what every learner reaches in every variant."""
    every = kinds(alpha=params.alpha, ddof=params.ddof, horizon=params.horizon)
    return compare(variants, every, repetitions=repetitions, seed=seed, tau=params.tau)


def learner_rows(variants: Sequence[Variant], compared: Comparison) -> pd.DataFrame:
    """Return the rows of ``learners.parquet``."""
    difference, half = paired(compared.values)
    mean, greedy = compared.values.mean(axis=-1), compared.greedy.mean(axis=-1)
    best = mean.argmax(axis=1)
    rows: list[dict[str, Any]] = []
    for i, variant in enumerate(variants):
        for m, measure in enumerate(compared.measures):
            behind, behind_half = paired(compared.values[i : i + 1, :, m : m + 1], int(best[i, m]))
            rows += [
                {
                    "simulation": variant.simulation,
                    "variant": variant.name,
                    "learner": learner,
                    "measure": measure,
                    "value": mean[i, k, m],
                    "greedy": greedy[i, k, m],
                    "difference": difference[i, k, m],
                    "half_width": half[i, k, m],
                    "behind_best": behind[0, k, 0],
                    "behind_half_width": behind_half[0, k, 0],
                    "n": compared.values.shape[-1],
                    **task_columns(variant.task),
                }
                for k, learner in enumerate(compared.learners)
            ]
    return pd.DataFrame(rows)


def learner_curve_rows(variants: Sequence[Variant], compared: Comparison) -> pd.DataFrame:
    """Return the rows of ``learner_curves.parquet``."""
    episode = np.arange(1, compared.curves.shape[-1] + 1)
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "simulation": variant.simulation,
                    "variant": variant.name,
                    "learner": learner,
                    "episode": episode,
                    "mean": compared.curves[i, k],
                }
            )
            for i, variant in enumerate(variants)
            for k, learner in enumerate(compared.learners)
        ],
        ignore_index=True,
    )
