"""The sweep of the stage simulate: its cells, how they are shared among workers, its table and its picture.

Each part is a unit of its own in the pipeline, so that parts run side by side and a finished one is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table, read_table, write_table
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.sweep import AXES, Cell, columns, grid, parts, run_cells

LEVEL = 0.8
SWEEP = Table(
    1,
    "one row a cell of the grid",
    {
        "events": Column("int", "", "events in an episode"),
        "subtasks": Column("int", "", "n"),
        "chosen": Column("int", "", "m, the human's"),
        "period": Column("int", "", "episodes between reassignments, 0 for none"),
        "accuracy": Column("float", "%", "correct decisions, the same in all four situations"),
        "alpha": Column("float", "", "learning rate"),
        "tau": Column("float", "", "temperature"),
        "episode": Column("float", "", "first episode with 80 % choice accuracy, missing where none"),
        "expected_episode": Column("float", "", "the same of the analytic expectation, where there is one"),
        "trials": Column("float", "", "trials until then (episode x events)"),
        "minutes_1s": Column("float", "min", "time until then at 1 s a trial"),
        "minutes_2s": Column("float", "min", "time until then at 2 s a trial"),
        "final": Column("float", "", "choice accuracy after the last episode"),
        "final_half_width": Column("float", "", "half the width of its 95 % band"),
    },
)


def cells(config: Any) -> list[Cell]:
    """Return the cells of ``config.sweep``, sorted; axes that it does not name stay as configured."""
    otherwise = Cell(
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
    """Return what learning comes to in one of ``count`` parts of the cells; it does not depend on how they are cut."""
    all_cells = cells(config)
    runs = parts(all_cells, count)
    some = runs[index] if index < len(runs) else []
    kind = None
    if config.sweep_learner != "paper":
        kind = kinds(alpha=config.alpha, ddof=config.ddof, horizon=config.horizon)[config.sweep_learner]
    found = run_cells(
        some,
        kind,
        episodes=config.episodes,
        repetitions=config.sweep_repetitions,
        seed=config.seed,
        level=LEVEL,
        ddof=config.ddof,
        carry_over=config.carry_over,
    )
    table = pd.DataFrame(columns(found))
    table["trials"] = table["episode"] * table["events"]
    table["minutes_1s"], table["minutes_2s"] = table["trials"] / 60.0, table["trials"] / 30.0
    whole = ["events", "subtasks", "chosen", "period"]
    table[whole] = table[whole].astype(int)
    return table[list(SWEEP.columns)]


def write_part(table: pd.DataFrame, out: Path) -> None:
    """Write one part's ``sweep.parquet``."""
    write_table(table, out / "sweep.parquet", SWEEP)


def write(paths: Sequence[Path], config: Any, out: Path) -> pd.DataFrame:
    """Join the parts' tables; write ``sweep.parquet`` and ``sweep.png``; return the table."""
    from hrcneuro.figures import beyond as simulate_beyond_figures

    tables = [table for table in map(read_table, paths) if len(table)]
    table = pd.concat(tables, ignore_index=True)
    write_table(table, out / "sweep.parquet", SWEEP)
    simulate_beyond_figures.sweep(slices(table, config), config, out / "sweep.png")
    return table


def slices(table: pd.DataFrame, config: Any) -> list[tuple[str, pd.DataFrame]]:
    """Return, for every axis but accuracy that varies, its cells with all other axes at their usual value.

    Where the usual value is not in the grid, the nearest one stands for it.
    """
    usual = {name: getattr(config, name) for name in ("events", "subtasks", "alpha", "tau")} | {"period": 0}
    found = []
    for axis in AXES:
        if axis == "accuracy" or table[axis].nunique() < 2 or (axis == "chosen" and "chosen" not in config.sweep):
            continue
        part = table
        for other in ("subtasks", "chosen", "events", "period", "alpha", "tau"):
            # m follows n where it has no axis of its own.
            if other == axis or (other == "chosen" and axis == "subtasks"):
                continue
            want = usual.get(other, config.chosen)
            near = part[other].iloc[int(np.argmin(np.abs(part[other].to_numpy() - want)))]
            part = part[part[other] == near]
        if axis == "subtasks":
            share = config.chosen / config.subtasks
            off = (part["chosen"] - share * part["subtasks"]).abs()
            part = part[off == off.groupby(part["subtasks"]).transform("min")]
        found.append((axis, part))
    return found
