"""What the stage simulate adds to the paper: analytic expectation, other learners, the confound, the sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.figures import beyond as simulate_beyond_figures
from hrcneuro.io.tables import Column, Table, write_table
from hrcneuro.learning.analytic import expected_together
from hrcneuro.learning.compare import Comparison, compare, paired
from hrcneuro.learning.confound import Mixture, error_reader
from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.simulations import Curve, Variant, run_curves
from hrcneuro.learning.task import Task
from hrcneuro.tables.simulate import CURVES, curve_rows

if TYPE_CHECKING:
    from hrcneuro.analyses.empirical import Empirical

Expected = dict[tuple[str, str], np.ndarray]

ANALYTIC = Table(
    1,
    "one row a curve without reassignment and episode",
    {
        "simulation": CURVES.columns["simulation"],
        "variant": CURVES.columns["variant"],
        "episode": CURVES.columns["episode"],
        "expected": Column("float", "", "choice accuracy expected from drift and variance alone"),
        "difference": Column("float", "", "Monte-Carlo mean minus expected"),
        "half_width": Column("float", "", "half the width of the Monte-Carlo mean's 95 % band"),
    },
)
LEARNERS = Table(
    1,
    "one row a curve, learner and measure; learners of a curve hear the same draws",
    {
        "simulation": CURVES.columns["simulation"],
        "variant": CURVES.columns["variant"],
        "learner": Column("category", "", "name of the learner; paper is Eq 3-6"),
        "measure": Column("category", "", "mean over all episodes, or an episode"),
        "value": Column("float", "", "choice accuracy, mean over repetitions"),
        "greedy": Column("float", "", "share of subtasks whose better-valued action is correct"),
        "difference": Column("float", "", "value minus the paper's learner's, paired"),
        "half_width": Column("float", "", "half the width of the difference's 95 % interval"),
        "behind_best": Column("float", "", "value minus the best learner's of this curve and measure, paired"),
        "behind_half_width": Column("float", "", "half the width of its 95 % interval"),
        "n": Column("int", "", "repetitions"),
    },
)
CONFOUND = Table(
    1,
    "one row a decoder and episode; n = 4, m = 2 unless configured",
    {
        "variant": Column("category", "", "what the decoder answers to, and in what task"),
        **{name: CURVES.columns[name] for name in ("episode", "mean", "sd", "n")},
    },
)


def expected(variants: Sequence[Variant], config: Any) -> Expected:
    """Return the analytic curve of every variant that has one: coin flips, and an assignment that stays."""
    known = {
        (v.simulation, v.name): (v.task, v.decoder.rates)
        for v in variants
        if isinstance(v.decoder, CoinFlips) and v.task.reassign == "never"
    }
    tasks, rates = [t for t, _ in known.values()], [r for _, r in known.values()]
    curves = expected_together(tasks, rates, alpha=config.alpha, tau=config.tau, ddof=config.ddof)
    return dict(zip(known, curves, strict=True))


def analytic_table(
    variants: Sequence[Variant], curves: Sequence[Curve], expectation: Expected
) -> dict[str, tuple[Table, pd.DataFrame]]:
    """Return ``analytic.parquet``: the expectation beside the Monte-Carlo mean."""
    rows = curve_rows(variants, curves)
    rows["half_width"] = np.concatenate([c.half_width for c in curves])
    known = [
        expectation.get((v.simulation, v.name), np.full(len(c.mean), np.nan))
        for v, c in zip(variants, curves, strict=True)
    ]
    rows["expected"] = np.concatenate(known)
    rows["difference"] = rows["mean"] - rows["expected"]
    rows = rows[rows["expected"].notna()]
    return {"analytic.parquet": (ANALYTIC, rows[list(ANALYTIC.columns)].reset_index(drop=True))}


def write(variants: Sequence[Variant], heard: Empirical, task: Task, config: Any, out: Path) -> None:
    """Write what goes beyond the paper, as far as the configuration asks for it."""
    if config.learner_repetitions:
        chosen = [v for v in variants if v.name.endswith("emp") or v.simulation in ("SIM2", "SIM3")]
        found = compare(
            chosen,
            kinds(alpha=config.alpha, ddof=config.ddof, horizon=config.horizon),
            repetitions=config.learner_repetitions,
            seed=config.seed,
            tau=config.tau,
        )
        write_table(learner_rows(chosen, found), out / "learners.parquet", LEARNERS)
        simulate_beyond_figures.learners(chosen, found, out / "learners.png")
    if config.confound:
        worlds = confound_variants(heard.rates, task)
        curves = run_curves(
            worlds,
            partial(PaperLearner, alpha=config.alpha, ddof=config.ddof),
            repetitions=config.repetitions,
            seed=config.seed,
            tau=config.tau,
        )
        rows = curve_rows(worlds, curves).drop(columns="simulation")
        write_table(rows, out / "confound.parquet", CONFOUND)
        simulate_beyond_figures.confound(worlds, curves, out / "confound.png")


def confound_variants(rates: Rates, task: Task) -> list[Variant]:
    """Return learning from decoders of the same rates that answer to different things."""
    anticipation, anyhow = CoinFlips(rates), error_reader(rates, as_logged=False)
    worlds: Mapping[str, Any] = {
        "anticipation": anticipation,
        "errors, before takeovers as logged": error_reader(rates, as_logged=True),
        "half errors, half anticipation": Mixture(anyhow, anticipation, 0.5),
        "errors, whoever acts next": anyhow,
    }
    return [Variant("confound", name, task, decoder) for name, decoder in worlds.items()]


def learner_rows(variants: Sequence[Variant], found: Comparison) -> pd.DataFrame:
    """Return the rows of ``learners.parquet``."""
    difference, half = paired(found.values)
    mean, greedy = found.values.mean(axis=-1), found.greedy.mean(axis=-1)
    best = mean.argmax(axis=1)
    rows: list[dict[str, Any]] = []
    for i, variant in enumerate(variants):
        for m, measure in enumerate(found.measures):
            behind, behind_half = paired(found.values[i : i + 1, :, m : m + 1], int(best[i, m]))
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
                    "n": found.values.shape[-1],
                }
                for k, learner in enumerate(found.learners)
            ]
    return pd.DataFrame(rows)
