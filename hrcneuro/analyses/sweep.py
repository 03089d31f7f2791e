"""The design sweep of the stage simulate: its points, what learning comes to in them, and how good a decoder must be.

Each part is a unit of its own in the pipeline, so that parts run side by side and a finished one is kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.learning.grid import AXES, GridPoint, grid, parts
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.sweep import GOAL_MIN, LEVEL, TRIALS_S, columns, episodes_in_time, needed, run_points
from hrcneuro.tables.simulate import NEEDED, SWEEP

# A result told in words names so many designs; all of them are in the table.
_TOLD = 24


def points(config: Any) -> list[GridPoint]:
    """Return the points of ``config.sweep``, sorted; axes that it does not name stay as configured."""
    return grid(config.sweep, otherwise=usual(config))


def usual(config: Any) -> GridPoint:
    """Return the point at which axes stay that are not swept: as configured, tasks that stay, a decoder of 57 %."""
    return GridPoint(
        events=config.events,
        subtasks=config.subtasks,
        chosen=config.chosen,
        period=0,
        accuracy=57.0,
        alpha=config.alpha,
        tau=config.tau,
    )


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


def needed_rows(table: pd.DataFrame, episodes: int) -> pd.DataFrame:
    """Return how good a decoder must be in every design, which is a cell without its accuracy.

    Where tasks change, being good once says little: there the accuracy after the last episode counts.

    Args:
        table: Rows of sweep.parquet.
        episodes: How many were learned.
    """
    design = [axis for axis in AXES if axis != "accuracy"]
    rows = []
    for at, part in table.sort_values("accuracy").groupby(design, sort=True):
        named: dict[str, float] = dict(zip(design, at, strict=True))  # type: ignore[arg-type]
        for trial_s in TRIALS_S:
            last = episodes if named["period"] else episodes_in_time(int(named["events"]), trial_s, episodes)
            seen = "final" if named["period"] else f"in_time_{trial_s:g}s"
            accuracy, reached, half = (part[n].to_numpy(float) for n in ("accuracy", seen, f"{seen}_half_width"))
            found = needed(accuracy, reached, half)
            rows.append({**named, "trial_s": trial_s, "episode": last, **asdict(found)})
    return pd.DataFrame(rows)[list(NEEDED.columns)]


def summary(table: pd.DataFrame, rows: pd.DataFrame, config: Any) -> dict[str, Any]:
    """Return the sweep in a few numbers: how good a decoder must be, or which design learns soonest with a usual one.

    Where there are many designs, those are told that differ from the usual one in one axis.

    Args:
        table, rows: Rows of sweep.parquet and of needed.parquet.
        config: The options of the stage.
    """
    varied = [axis for axis in AXES if table[axis].nunique() > 1]
    told = {
        "cells": len(table),
        "axes": varied,
        "level": 100 * LEVEL,
        "goal_min": GOAL_MIN,
        "episodes": config.episodes,
        "learner": config.sweep_learner,
    }
    if "accuracy" not in varied:
        return told | {"accuracy": float(table["accuracy"].iloc[0]), "soonest": _soonest(table, varied)}
    axes = [axis for axis in varied if axis != "accuracy"]
    if len(rows) > _TOLD:
        rows = rows[_steps_away(rows, asdict(usual(config)), axes) <= 1]
    shown = [
        {"design": {axis: float(row[axis]) for axis in axes}, **{name: _plain(row[name]) for name in _SAID}}
        for row in rows.to_dict("records")
    ]
    return told | {"needed": shown}


_SAID = ("trial_s", "episode", "period", "accuracy", "low", "high", "below", "above")


def _soonest(table: pd.DataFrame, varied: list[str]) -> dict[str, Any]:
    """Return the design that reaches the level first; where none does, the one that ends best."""
    reached = table[table["minutes_1s"].notna()]
    best = reached.nsmallest(1, "minutes_1s") if len(reached) else table.nlargest(1, "final")
    values = ("minutes_1s", "minutes_2s", "final", "final_half_width")
    row = best.to_dict("records")[0]
    return {"design": {axis: float(row[axis]) for axis in varied}, **{name: _plain(row[name]) for name in values}}


def _steps_away(rows: pd.DataFrame, usual: Mapping[str, float], axes: list[str]) -> np.ndarray:
    """Return in how many axes each design differs from the one nearest to the usual; m that follows n is none."""
    away = np.zeros(len(rows), int)
    for axis in axes:
        values = rows[axis].to_numpy(float)
        if axis == "chosen" and "subtasks" in axes:
            share = usual["chosen"] / usual["subtasks"]
            off = (rows["chosen"] - share * rows["subtasks"]).abs()
            away += (off > off.groupby(rows["subtasks"]).transform("min")).to_numpy()
        else:
            away += values != values[np.argmin(np.abs(values - usual[axis]))]
    return away


def _plain(value: float) -> float | None:
    return None if math.isnan(value) else round(float(value), 6)
