"""The grid of a design sweep: decoders, tasks and parameters. Light to import."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

from hrcneuro.learning.params import MOST_SUBTASKS


class AxisLimits(NamedTuple):
    """Inclusive limits of an axis, whether its values are whole numbers, and their unit."""

    low: float
    high: float
    whole: bool = False
    unit: str = ""


LIMITS: dict[str, AxisLimits] = {
    "accuracy": AxisLimits(0, 100, unit="%"),
    "subtasks": AxisLimits(2, MOST_SUBTASKS, whole=True),
    "chosen": AxisLimits(1, MOST_SUBTASKS - 1, whole=True),
    "alpha": AxisLimits(1e-6, 100),
    "tau": AxisLimits(1e-6, 100),
    "events": AxisLimits(2, 1000, whole=True),
    "period": AxisLimits(0, 100_000, whole=True),
}

WIDE: dict[str, tuple[float, ...]] = {
    "accuracy": (51.0, 52.0, 53.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 60.0, 62.0, 65.0, 70.0, 75.0, 80.0),
    "subtasks": (2.0, 4.0, 6.0, 8.0, 10.0),
    "alpha": (0.01, 0.02, 0.05, 0.1, 0.2),
    "tau": (0.05, 0.1, 0.3),
    "events": (5.0, 10.0, 20.0),
    "period": (0.0, 20.0, 40.0),
}
"""A grid for who asks for a sweep without naming one: 10,125 cells."""


@dataclass(frozen=True, order=True)
class GridPoint:
    """One point of the grid; ``period`` 0 means that tasks never change.

    The order of the fields is that of sorting: points that share their random draws come together.
    """

    events: int
    subtasks: int
    chosen: int
    period: int
    accuracy: float
    alpha: float
    tau: float


AXES = tuple(f.name for f in fields(GridPoint))


def grid(axes: Mapping[str, Sequence[float]], *, otherwise: GridPoint) -> list[GridPoint]:
    """Return the points of a full grid, sorted; axes that are not named stay as in ``otherwise``.

    Where n varies and m does not, m keeps its share of n. Pairs with m outside 1 … n − 1 are left out.

    Raises:
        ValueError: An axis does not exist.
    """
    for name in axes:
        if name not in AXES:
            raise ValueError(f"{name!r} is no axis; allowed: {', '.join(AXES)}")
    points = set()
    for combination in itertools.product(*axes.values()):
        at = {f.name: getattr(otherwise, f.name) for f in fields(GridPoint)} | dict(zip(axes, combination, strict=True))
        if "chosen" not in axes:
            at["chosen"] = max(1, round(otherwise.chosen / otherwise.subtasks * at["subtasks"]))
        whole = {name: int(at[name]) for name in AXES if LIMITS[name].whole}
        if 1 <= whole["chosen"] < whole["subtasks"]:
            points.add(GridPoint(**(at | whole)))
    return sorted(points)


def parts(points: Sequence[GridPoint], count: int) -> list[list[GridPoint]]:
    """Return the points in up to ``count`` runs of like size, for as many workers; results do not depend on it."""
    n = min(count, len(points))
    edges = [len(points) * i // n for i in range(n + 1)] if n else [0]
    return [list(points[a:b]) for a, b in itertools.pairwise(edges)]
