"""Simulated curves as rows of tables: when they reach a level, what reassignment costs, what was to be expected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.learning import milestones
from hrcneuro.learning.analytic import expected_together
from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.params import LearnerParams
from hrcneuro.learning.simulations import Curve, Variant
from hrcneuro.learning.task import JointTask
from hrcneuro.tables.simulate import ANALYTIC, MILESTONES, RELEARNING

_SUMMARY_EPISODES = (20, 35, 40, 80, 100, 120, 160, 200)

Expected = dict[tuple[str, str], np.ndarray]
"""(simulation, variant) -> expected choice accuracy, ndarray, shape (n_episodes,)."""


def task_columns(task: JointTask) -> dict[str, Any]:
    """Return what tells a curve's task from others, by column."""
    return {name: getattr(task, name) for name in ("subtasks", "chosen", "reassign", "period")}


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
                    "half_width": c.half_width,
                    **task_columns(v.task),
                }
            )
            for v, c in zip(variants, curves, strict=True)
        ],
        ignore_index=True,
    )


def curve_summary(variants: Sequence[Variant], curves: Sequence[Curve]) -> dict[str, Any]:
    """Return simulation -> variant -> episode -> mean choice accuracy, at a few episodes."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for variant, curve in zip(variants, curves, strict=True):
        shown = [e for e in _SUMMARY_EPISODES if e <= len(curve.mean)] or [len(curve.mean)]
        found.setdefault(variant.simulation, {})[variant.name] = {
            str(e): round(float(curve.mean[e - 1]), 6) for e in shown
        }
    return found


def milestone_rows(
    variants: Sequence[Variant], curves: Sequence[Curve], *, events: int, trial_s: Sequence[float]
) -> pd.DataFrame:
    """Return the rows of ``milestones.parquet``."""
    rows: list[dict[str, Any]] = []
    for variant, curve in zip(variants, curves, strict=True):
        for level in milestones.LEVELS:
            reached = milestones.milestone(curve, level)
            printed = milestones.PRINTED.get((variant.simulation, variant.name, level), (None, None))
            rows += [
                {
                    "simulation": variant.simulation,
                    "variant": variant.name,
                    "level": level,
                    "trial_s": seconds,
                    "episode": reached.episode,
                    "earliest": reached.earliest,
                    "latest": reached.latest,
                    "minutes": milestones.minutes(reached.episode, events=events, trial_s=seconds),
                    "printed_episode": printed[0],
                    "printed_minutes": printed[1],
                }
                for seconds in trial_s
            ]
    return pd.DataFrame(rows, columns=list(MILESTONES.columns))


def milestone_summary(rows: pd.DataFrame) -> dict[str, Any]:
    """Return simulation -> variant -> level (%) -> episode, its 95 % band and minutes by trial duration (s), as JSON.

    ``rows`` are those of :func:`milestone_rows`; None stands for a level that is not reached.
    """
    summary: dict[str, Any] = {}
    for row in rows.to_dict("records"):
        levels = summary.setdefault(str(row["simulation"]), {}).setdefault(str(row["variant"]), {})
        reached = {name: _whole(row[name]) for name in ("episode", "earliest", "latest")}
        level = levels.setdefault(f"{100 * row['level']:g}", reached | {"minutes": {}})
        level["minutes"][f"{row['trial_s']:g}"] = None if pd.isna(row["minutes"]) else round(float(row["minutes"]), 2)
    return summary


def _whole(number: Any) -> int | None:
    return None if pd.isna(number) else int(number)


def relearning_rows(variants: Sequence[Variant], curves: Sequence[Curve]) -> pd.DataFrame:
    """Return the rows of ``relearning.parquet``: the honest verdict on "without notable loss" (§3.3)."""
    parts = []
    for variant, curve in zip(variants, curves, strict=True):
        if variant.simulation != "SIM3":
            continue
        terms = milestones.relearned(curve, variant.task.segment)
        parts.append(
            pd.DataFrame(
                {
                    "variant": variant.name,
                    "assignment": np.arange(1, len(terms.episode) + 1),
                    **{name: getattr(terms, name) for name in list(RELEARNING.columns)[2:]},
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def expected(variants: Sequence[Variant], params: LearnerParams) -> Expected:
    """Return the analytic curve of every variant that has one: coin flips, and an assignment that stays."""
    known = {
        (v.simulation, v.name): (v.task, v.decoder.rates)
        for v in variants
        if isinstance(v.decoder, CoinFlips) and v.task.reassign == "never"
    }
    tasks, rates = [t for t, _ in known.values()], [r for _, r in known.values()]
    curves = expected_together(tasks, rates, alpha=params.alpha, tau=params.tau, ddof=params.ddof)
    return dict(zip(known, curves, strict=True))


def analytic_rows(variants: Sequence[Variant], curves: Sequence[Curve], expectation: Expected) -> pd.DataFrame:
    """Return the rows of ``analytic.parquet``: the expectation beside the Monte-Carlo mean."""
    rows = curve_rows(variants, curves)
    known = [
        expectation.get((v.simulation, v.name), np.full(len(c.mean), np.nan))
        for v, c in zip(variants, curves, strict=True)
    ]
    rows["expected"] = np.concatenate(known)
    rows["difference"] = rows["mean"] - rows["expected"]
    rows = rows[rows["expected"].notna()]
    return rows[list(ANALYTIC.columns)].reset_index(drop=True)
