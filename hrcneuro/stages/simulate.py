"""Simulated robot learning from decoded anticipation (paper §3): SIM1–4, Fig 4 and its milestones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.contract import EVIDENCE, SWEEP, Inputs, Of, Read, Reads, SideResult, Stage, Work, option
from hrcneuro.learning.grid import LIMITS
from hrcneuro.learning.params import LEARNERS, PARTNERS, LearnerParams, RateParams, TaskParams

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hrcneuro.analyses.empirical import Empirical
    from hrcneuro.learning.simulations import Variant

# Ten times the wide one.
MOST_CELLS = 100_000
# So many take minutes, and are told before they start.
MANY_CELLS = 1000
# More than any machine's workers, few enough that each part is worth a process.
SWEEP_PARTS = 16


@dataclass(frozen=True)
class Config(LearnerParams, TaskParams, RateParams):
    """The values of §3.2 and the choices that the paper leaves open."""

    rates: str = option("paper", "where the empirical decoder comes from", choices=("paper", "decode", "replay"))
    levels: tuple[float, ...] = option(published.LEVELS.value, "hypothetical decoders", unit="%", low=0, high=100)
    test_cases: tuple[tuple[int, ...], ...] = option(
        (*published.SUBTASK_CASES.value, (10, 8)), "pairs [n, m] of SIM4; the last is not the paper's", low=1, high=32
    )
    repetitions: int = option(
        published.REPETITIONS.value, "restarts of learning a curve averages over", low=2, high=1_000_000
    )
    reassign: str = option("every", "SIM3: new tasks once, or every period", choices=("once", "every"))
    trial_s: tuple[float, ...] = option((1.0, 2.0), "durations of a trial for the milestones", unit="s", low=0.01)
    seed: int = option(2023, "seed of every draw", low=0)
    scenario: str = option("iC", "scenario of the decode artifacts (rates = decode, replay)")
    after_human: str = option("HHvsHR", "decoding problem that is heard after a human's action")
    after_robot: str = option("RRvsRH", "decoding problem that is heard after a robot's action")
    decoder: str = option("", "decoder of the decode artifacts; empty for the first one")
    learner_repetitions: int = option(
        100, "restarts of each learner that is compared with Eq 3-6; 0 for no comparison", low=0, high=100_000
    )
    confound: bool = option(True, "also learn from a decoder that answers to errors")
    sweep: dict[str, tuple[float, ...]] = option(
        {},
        "axis -> values of the design sweep: accuracy (%), subtasks, chosen, alpha, tau, events, period (0: never)",
        keys={axis: limits._asdict() for axis, limits in LIMITS.items()},
    )
    sweep_learner: str = option("paper", "who learns in the sweep", choices=LEARNERS)
    sweep_repetitions: int = option(100, "restarts a cell of the sweep", low=2, high=100_000)
    evidence: str = option(
        "", "folder of the session logs of Ehrlich & Cheng 2018, a closed loop with people", path=True, keyed=False
    )
    evidence_partners: tuple[str, ...] = option(
        PARTNERS, "who guesses in the simulated sessions beside the logged ones", choices=PARTNERS
    )
    evidence_repetitions: int = option(500, "simulated sessions beside each logged one", low=2, high=100_000)


def check(config: Config) -> list[str]:
    """Return the contradictions between values."""
    mistakes = []
    if config.chosen >= config.subtasks:
        mistakes.append(
            f"chosen = {config.chosen} of subtasks = {config.subtasks}: the human takes some and leaves some; "
            f"allowed: 1 <= chosen <= {config.subtasks - 1}"
        )
    for i, pair in enumerate(config.test_cases):
        if len(pair) != 2 or not 1 <= pair[1] < pair[0]:
            mistakes.append(f"test_cases[{i}] = {list(pair)}; allowed: [n, m] with 2 <= n <= 32 and 1 <= m <= n - 1")
    if config.events == 1 and not config.carry_over:
        mistakes.append(
            "events = 1 with carry_over = false: an episode's only event has none before it, so nothing is learned; "
            "allowed: events >= 2, or carry_over = true"
        )
    for name in ("levels", "test_cases"):
        values = getattr(config, name)
        if len(set(values)) < len(values):
            mistakes.append(f"{name} = {list(values)} names one of them twice; allowed: each once")
    if config.learner_repetitions == 1:
        mistakes.append("learner_repetitions = 1 gives no confidence interval; allowed: 0 (none), or 2 and more")
    if len(set(config.evidence_partners)) < max(len(config.evidence_partners), 1):
        mistakes.append(
            f"evidence_partners = {list(config.evidence_partners)}; allowed: one or both of {', '.join(PARTNERS)}"
        )
    return mistakes + _check_sweep(config)


def _check_sweep(config: Config) -> list[str]:
    mistakes = []
    if cells(config) > MOST_CELLS:
        mistakes.append(f"sweep has {_size(config)}; allowed: up to {MOST_CELLS:,} cells; name fewer values")
    if "chosen" in config.sweep:
        subtasks = config.sweep.get("subtasks", (config.subtasks,))
        if min(config.sweep["chosen"]) >= max(subtasks):
            mistakes.append(
                f"sweep.chosen = {list(config.sweep['chosen'])} is nowhere below the subtasks {list(subtasks)}; "
                "allowed: some m < n"
            )
    return mistakes


def cells(config: Config) -> int:
    """Return the number of cells of the sweep; 0 without one."""
    return math.prod(len(values) for values in config.sweep.values()) if config.sweep else 0


def _size(config: Config) -> str:
    return f"{cells(config):,} cells ({' × '.join(f'{axis} {len(values):,}' for axis, values in config.sweep.items())})"


def notes(config: Config) -> list[str]:
    """Return how large the sweep is, where it is large."""
    if cells(config) < MANY_CELLS:
        return []
    return [
        f"the sweep has {_size(config)}, each of {config.sweep_repetitions:,} repetitions of {config.episodes:,} "
        "episodes; finished parts of it are kept: after Ctrl-C the same command goes on"
    ]


def parts(config: Config) -> tuple[str, ...]:
    """Return the units that a sweep is cut into; none without a sweep. Results do not depend on their number."""
    return tuple(f"sweep-{i + 1:02d}" for i in range(min(cells(config), SWEEP_PARTS)))


def run_part(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Run one part of the sweep; write its ``sweep.parquet``."""
    from hrcneuro.analyses.sweep import part_table
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables.simulate import SWEEP

    units = parts(config)
    table = part_table(config, units.index(inputs.unit), len(units))
    write_table(table, out / "sweep.parquet", SWEEP)
    return {"cells": len(table)}


def run_sweep(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Join the parts of the sweep and tell how good a decoder must be; write sweep.parquet and needed.parquet."""
    import pandas as pd

    from hrcneuro.analyses.sweep import needed_rows
    from hrcneuro.analyses.sweep import summary as told
    from hrcneuro.io.tables import read_table, write_table
    from hrcneuro.tables.simulate import NEEDED, SWEEP

    tables = [read_table(inputs.path("simulate", "sweep.parquet", unit=unit)) for unit in parts(config)]
    table = pd.concat([t for t in tables if len(t)], ignore_index=True)
    rows = needed_rows(table, config.episodes)
    write_table(table, out / "sweep.parquet", SWEEP)
    write_table(rows, out / "needed.parquet", NEEDED)
    return told(table, rows, config)


def ready(config: Config) -> None:
    """Refuse logs that are no evidence, before anything runs.

    Raises:
        DataError: As :func:`hrcneuro.sources.gaze_logs.read_sessions`.
    """
    if config.evidence:
        from hrcneuro.sources.gaze_logs import read_sessions

        read_sessions(config.evidence)


def _logs(config: Config, unit: str) -> Mapping[str, Path]:
    from hrcneuro.sources.gaze_layout import log_files

    return log_files(config.evidence) if unit == EVIDENCE and config.evidence else {}


def run_evidence(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Hold what is simulated against a closed loop with people; write the tables of the evidence."""
    from hrcneuro.analyses.evidence import evidence
    from hrcneuro.io.tables import write_table
    from hrcneuro.sources.gaze_logs import read_sessions
    from hrcneuro.tables import evidence as schemas

    tables, told = evidence(read_sessions(config.evidence), config)
    for name, table in tables.items():
        write_table(table, out / f"{name}.parquet", getattr(schemas, name.upper()))
    return told


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Run SIM1-4, compare learners, show the confound; write their tables.

    Raises:
        DataError: This run's decode artifacts lack what ``rates`` asks for.
    """
    from hrcneuro.analyses import learning_curves
    from hrcneuro.analyses.empirical import empirical
    from hrcneuro.analyses.simulated import paper_learner, variants_of
    from hrcneuro.io.tables import write_table
    from hrcneuro.learning.simulations import run_curves
    from hrcneuro.tables import simulate as schemas

    decoders = empirical(config, inputs)
    variants = variants_of(config, decoders)
    curves = run_curves(
        variants, paper_learner(config), repetitions=config.repetitions, seed=config.seed, tau=config.tau
    )
    marks = learning_curves.milestone_rows(variants, curves, events=config.events, trial_s=config.trial_s)
    analytic = learning_curves.analytic_rows(variants, curves, learning_curves.expected(variants, config))
    relearning = learning_curves.relearning_rows(variants, curves)
    write_table(learning_curves.curve_rows(variants, curves), out / "curves.parquet", schemas.CURVES)
    write_table(marks, out / "milestones.parquet", schemas.MILESTONES)
    write_table(relearning, out / "relearning.parquet", schemas.RELEARNING)
    write_table(analytic, out / "analytic.parquet", schemas.ANALYTIC)
    if config.learner_repetitions:
        _compare_learners(variants, config, out)
    if config.confound:
        _learn_from_errors(decoders, config, out)
    return learning_curves.curve_summary(variants, curves) | {"milestones": learning_curves.milestone_summary(marks)}


def _compare_learners(variants: Sequence[Variant], config: Config, out: Path) -> None:
    from hrcneuro.analyses import learners
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables.simulate import LEARNER_CURVES, LEARNERS

    chosen = learners.compared_in(variants)
    compared = learners.comparison(chosen, config, repetitions=config.learner_repetitions, seed=config.seed)
    write_table(learners.learner_rows(chosen, compared), out / "learners.parquet", LEARNERS)
    write_table(learners.learner_curve_rows(chosen, compared), out / "learner_curves.parquet", LEARNER_CURVES)


def _learn_from_errors(decoders: Empirical, config: Config, out: Path) -> None:
    from hrcneuro.analyses.learning_curves import curve_rows
    from hrcneuro.analyses.simulated import paper_learner, task_of
    from hrcneuro.io.tables import write_table
    from hrcneuro.learning.confound import same_rates
    from hrcneuro.learning.simulations import run_curves
    from hrcneuro.tables.simulate import CONFOUND

    variants = same_rates(decoders.rates, task_of(config))
    curves = run_curves(
        variants, paper_learner(config), repetitions=config.repetitions, seed=config.seed, tau=config.tau
    )
    write_table(curve_rows(variants, curves).drop(columns="simulation"), out / "confound.parquet", CONFOUND)


def _group_reads(config: Config) -> Reads:
    """Return the files that the group reads; none where the rates are the paper's."""
    names = {"paper": (), "decode": ("scores.parquet",), "replay": ("predictions.parquet",)}
    files = names[config.rates]
    return (Read("decode", files, Of.INCLUDED),) if files else ()


STAGE = Stage(
    name="simulate",
    title="The robot that learns",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow"),
    check=check,
    group=Work(run_group, _group_reads),
    sides=(
        SideResult(
            SWEEP,
            asked=lambda config: bool(parts(config)),
            run=run_sweep,
            options=("sweep", "sweep_learner", "sweep_repetitions"),
            parts=parts,
            run_part=run_part,
        ),
        SideResult(
            EVIDENCE,
            asked=lambda config: bool(config.evidence),
            run=run_evidence,
            options=("evidence", "evidence_partners", "evidence_repetitions"),
            place="evidence",
        ),
    ),
    sources=_logs,
    notes=notes,
    ready=ready,
    moves=True,
)
