"""The tables of the stage simulate: their schemas and their rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table
from hrcneuro.learning import milestones
from hrcneuro.learning.simulations import Curve, Variant

LEVELS = (0.7, 0.8)

_SIMULATION = Column("category", "", "SIM1 ... SIM4 of paper 3.2")
_VARIANT = Column("category", "", "emp (empirical decoder) or per cent correct; in SIM4 n/m before it")
CURVES = Table(
    1,
    "one row a curve and episode",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "episode": Column("int", "", "episodes learned so far, from 1"),
        "mean": Column("float", "", "choice accuracy: mean over subtasks of pi(correct action), then over repetitions"),
        "sd": Column("float", "", "its SD over repetitions"),
        "n": Column("int", "", "repetitions"),
    },
)
MILESTONES = Table(
    1,
    "one row a curve, level and duration of a trial",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "level": Column("float", "", "choice accuracy to reach"),
        "trial_s": Column("float", "s", "duration of a trial"),
        "episode": Column("float", "", "first episode whose mean reaches the level, missing where none does"),
        "earliest": Column("float", "", "the same for the upper edge of the 95 % Monte-Carlo band"),
        "latest": Column("float", "", "the same for the lower edge"),
        "minutes": Column("float", "min", "time until then"),
        "printed_episode": Column("float", "", "the paper's figure"),
        "printed_minutes": Column("float", "min", "the paper's figure; it says 2 s a trial, which fits 1 s"),
    },
)
RELEARNING = Table(
    1,
    "one row a SIM3 curve and assignment",
    {
        "variant": _VARIANT,
        "assignment": Column("int", "", "1 for the first tasks, 2 after the first reassignment, ..."),
        "episode": Column("int", "", "the assignment's last episode"),
        "mean": Column("float", "", "choice accuracy there"),
        "half_width": Column("float", "", "half the width of its 95 % band"),
        "loss": Column("float", "", "accuracy at the end of the first assignment minus accuracy here"),
        "loss_half_width": Column("float", "", "half the width of the loss's 95 % band"),
    },
)


def all_tables(
    variants: Sequence[Variant], curves: Sequence[Curve], *, events: int, trial_s: Sequence[float]
) -> dict[str, tuple[Table, pd.DataFrame]]:
    """Return file name -> (schema, rows)."""
    return {
        "curves.parquet": (CURVES, curve_rows(variants, curves)),
        "milestones.parquet": (MILESTONES, milestone_rows(variants, curves, events=events, trial_s=trial_s)),
        "relearning.parquet": (RELEARNING, relearning_rows(variants, curves)),
    }


def curve_rows(variants: Sequence[Variant], curves: Sequence[Curve]) -> pd.DataFrame:
    """Return the rows of ``curves.parquet``."""
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "simulation": v.simulation,
                    "variant": v.name,
                    "episode": np.arange(1, len(c.mean) + 1),
                    "mean": c.mean,
                    "sd": c.sd,
                    "n": c.n,
                }
            )
            for v, c in zip(variants, curves, strict=True)
        ],
        ignore_index=True,
    )


def milestone_rows(
    variants: Sequence[Variant], curves: Sequence[Curve], *, events: int, trial_s: Sequence[float]
) -> pd.DataFrame:
    """Return the rows of ``milestones.parquet``."""
    rows: list[dict[str, Any]] = []
    for variant, curve in zip(variants, curves, strict=True):
        for level in LEVELS:
            found = milestones.milestone(curve, level)
            printed = milestones.PRINTED.get((variant.simulation, variant.name, level), (None, None))
            rows += [
                {
                    "simulation": variant.simulation,
                    "variant": variant.name,
                    "level": level,
                    "trial_s": seconds,
                    "episode": found.episode,
                    "earliest": found.earliest,
                    "latest": found.latest,
                    "minutes": milestones.minutes(found.episode, events=events, trial_s=seconds),
                    "printed_episode": printed[0],
                    "printed_minutes": printed[1],
                }
                for seconds in trial_s
            ]
    return pd.DataFrame(rows, columns=list(MILESTONES.columns))


def relearning_rows(variants: Sequence[Variant], curves: Sequence[Curve]) -> pd.DataFrame:
    """Return the rows of ``relearning.parquet``: the honest verdict on "without notable loss" (§3.3)."""
    parts = []
    for variant, curve in zip(variants, curves, strict=True):
        if variant.simulation != "SIM3":
            continue
        found = milestones.relearned(curve, variant.task.segment)
        parts.append(
            pd.DataFrame(
                {
                    "variant": variant.name,
                    "assignment": np.arange(1, len(found.episode) + 1),
                    **{name: getattr(found, name) for name in list(RELEARNING.columns)[2:]},
                }
            )
        )
    return pd.concat(parts, ignore_index=True)
