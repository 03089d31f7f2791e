"""The design sweep of the stage simulate: its points, and what learning comes to in a part of them, as rows.

Each part is a unit of its own in the pipeline, so that parts run side by side and a finished one is kept.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from hrcneuro.learning.grid import GridPoint, grid, parts
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.sweep import columns, run_points
from hrcneuro.tables.simulate import SWEEP


def points(config: Any) -> list[GridPoint]:
    """Return the points of ``config.sweep``, sorted; axes that it does not name stay as configured."""
    otherwise = GridPoint(
        events=config.events,
        subtasks=config.subtasks,
        chosen=config.chosen,
        period=0,
        accuracy=57.0,
        alpha=config.alpha,
        tau=config.tau,
    )
    return grid(config.sweep, otherwise=otherwise)


def part_table(config: Any, index: int, count: int) -> pd.DataFrame:
    """Return what learning comes to in one of ``count`` parts of the points; it does not depend on how they are cut."""
    runs = parts(points(config), count)
    some = runs[index] if index < len(runs) else []
    kind = None
    if config.sweep_learner != "paper":
        kind = kinds(alpha=config.alpha, ddof=config.ddof, horizon=config.horizon)[config.sweep_learner]
    reached = run_points(
        some,
        kind,
        episodes=config.episodes,
        repetitions=config.sweep_repetitions,
        seed=config.seed,
        ddof=config.ddof,
        carry_over=config.carry_over,
    )
    table = pd.DataFrame(columns(reached))
    table["trials"] = table["episode"] * table["events"]
    table["minutes_1s"], table["minutes_2s"] = table["trials"] / 60.0, table["trials"] / 30.0
    whole = ["events", "subtasks", "chosen", "period"]
    table[whole] = table[whole].astype(int)
    return table[list(SWEEP.columns)]
