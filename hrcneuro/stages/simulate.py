"""Simulated robot learning from decoded anticipation (paper §3): SIM1–4, Fig 4 and its milestones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Inputs, Patterns, option
from hrcneuro.errors import StageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hrcneuro.learning.decoder import Decoder
    from hrcneuro.learning.learner import Make
    from hrcneuro.learning.simulations import Curve, Variant
    from hrcneuro.learning.task import Task

LIBS = ("numpy", "scipy", "pandas", "pyarrow", "matplotlib")
INPUTS: Patterns = {}
GROUP_INPUTS: Patterns = {}  # of rates = "paper"; see inputs()
FIGURES = {
    "fig4.png": "Fig 4: choice accuracy of the simulated robot (mean, 95 % Monte-Carlo band): A empirical decoder, "
    "B better and worse decoders, C tasks reassigned, D more subtasks"
}
SUMMARY_EPISODES = (20, 35, 40, 80, 100, 120, 160, 200)


@dataclass(frozen=True)
class Config:
    """The values of §3.2 and the choices that the paper leaves open."""

    rates: str = option("paper", "where the empirical decoder comes from", choices=("paper", "decode", "replay"))
    tnr_hh: float = option(51.5, "TNR_HH of Table 2, iC (rates = paper)", unit="%", low=0, high=100)
    tpr_hr: float = option(51.4, "TPR_HR of Table 2, iC", unit="%", low=0, high=100)
    tnr_rr: float = option(57.9, "TNR_RR of Table 2, iC", unit="%", low=0, high=100)
    tpr_rh: float = option(56.1, "TPR_RH of Table 2, iC", unit="%", low=0, high=100)
    levels: tuple[float, ...] = option((50.0, 60.0, 70.0, 80.0), "hypothetical decoders", unit="%", low=0, high=100)
    alpha: float = option(0.05, "learning rate of Eq 3", low=0, high=100, open_low=True)
    tau: float = option(0.1, "temperature of Eq 5", low=0, high=100, open_low=True)
    subtasks: int = option(4, "subtasks n of SIM1-3", low=2, high=32)
    chosen: int = option(2, "subtasks m of SIM1-3 that the human takes", low=1, high=31)
    test_cases: tuple[tuple[int, ...], ...] = option(
        ((6, 3), (10, 5), (10, 2), (10, 8)), "pairs [n, m] of SIM4; the last is not the paper's", low=1, high=32
    )
    episodes: int = option(200, "episodes", low=1, high=100_000)
    events: int = option(10, "events in an episode", low=1, high=1000)
    repetitions: int = option(100, "restarts of learning a curve averages over", low=2, high=1_000_000)
    reassign: str = option("every", "SIM3: new tasks once, or every period", choices=("once", "every"))
    period: int = option(40, "episodes between reassignments", low=1, high=100_000)
    carry_over: bool = option(False, "an episode's first event follows the last of the episode before")
    ddof: int = option(0, "Eq 6 divides by the SD with N - ddof", low=0, high=1)
    trial_s: tuple[float, ...] = option((1.0, 2.0), "durations of a trial for the milestones", unit="s", low=0.01)
    seed: int = option(2023, "seed of every draw", low=0)


def inputs(config: Config) -> Patterns:
    """Return the files that the group reads; none where the rates are the paper's."""
    return {
        "paper": {},
        "decode": {"decode": ("scores.parquet",)},
        "replay": {"decode": ("predictions.parquet",)},
    }[config.rates]


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
            mistakes.append(f"{name} = {values} names one of them twice; allowed: each once")
    return mistakes


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Run SIM1–4 and write ``curves.parquet``, ``milestones.parquet``, ``relearning.parquet`` and ``fig4.png``."""
    from hrcneuro.io.tables import write_table
    from hrcneuro.learning.simulations import run_curves
    from hrcneuro.stages import _simulate_figures, _simulate_tables

    variants = _variants(config, _empirical(config, inputs))
    curves = run_curves(
        variants, _paper_learner(config), repetitions=config.repetitions, seed=config.seed, tau=config.tau
    )
    for name, (table, rows) in _simulate_tables.all_tables(
        variants, curves, events=config.events, trial_s=config.trial_s
    ).items():
        write_table(rows, out / name, table)
    _simulate_figures.fig4(variants, curves, out / "fig4.png")
    return summary(variants, curves)


def summary(variants: Sequence[Variant], curves: Sequence[Curve]) -> dict[str, Any]:
    """Return simulation -> variant -> episode -> mean choice accuracy."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for variant, curve in zip(variants, curves, strict=True):
        shown = [e for e in SUMMARY_EPISODES if e <= len(curve.mean)] or [len(curve.mean)]
        found.setdefault(variant.simulation, {})[variant.name] = {
            str(e): round(float(curve.mean[e - 1]), 6) for e in shown
        }
    return found


def _variants(config: Config, empirical: Decoder) -> list[Variant]:
    from hrcneuro.learning.simulations import paper_simulations

    cases = [(n, m) for n, m in config.test_cases]
    return paper_simulations(
        _task(config), empirical=empirical, levels=config.levels, reassign=config.reassign, cases=cases
    )


def _task(config: Config) -> Task:
    from hrcneuro.learning.task import Task

    return Task(
        subtasks=config.subtasks,
        chosen=config.chosen,
        episodes=config.episodes,
        events=config.events,
        period=config.period,
        carry_over=config.carry_over,
    )


def _empirical(config: Config, inputs: Inputs) -> Decoder:
    from hrcneuro.learning.decoder import CoinFlips, Rates

    if config.rates != "paper":
        raise StageError(f"rates = {config.rates!r} is not built yet", cure="use --set simulate.rates=paper")
    return CoinFlips(Rates(config.tnr_hh, config.tpr_hr, config.tnr_rr, config.tpr_rh))


def _paper_learner(config: Config) -> Make:
    from functools import partial

    from hrcneuro.learning.learner import PaperLearner

    return partial(PaperLearner, alpha=config.alpha, ddof=config.ddof)
