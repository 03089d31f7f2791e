"""The tables of the chapter on decoders without calibration."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hrcneuro.contract import GROUP
from hrcneuro.report.markup import Cell, PageTable
from hrcneuro.report.results import Results


def values(results: Results) -> Mapping[str, Any]:
    """Return what the chapter's template shows; empty where the group has not run."""
    names = ("tests", "compared", "curves")
    tests, compared, curves = (results.table("transfer", GROUP, f"{name}.parquet") for name in names)
    if tests is None or compared is None or curves is None or tests.empty:
        return {}
    return {
        "shuffled": bool(results.summary("transfer").get("shuffled")),
        "tests": _tests(tests),
        "compared": _compared(compared),
        "curves": _curves(curves),
    }


_WHERE = ["scenario", "problem", "signal", "way", "calibration"]


def _tests(tests: Any) -> PageTable:
    rows: list[list[Cell]] = [
        [*_where(r), r["n"], _number(r["minutes"]), f"{r['bacc']:.1f}{_half(r)}", _p(r["p"]), _p(r["p_holm"])]
        for r in _sorted(tests)
    ]
    return PageTable([*_WHERE, "n", "minutes", "balanced accuracy (%)", "p, sign flips", "p (Holm)"], rows)


def _compared(compared: Any) -> PageTable:
    rows: list[list[Cell]] = []
    for r in _sorted(compared):
        worth = _number(r["worth_minutes"]) if math.isfinite(r["worth_minutes"]) else "never reached"
        rows.append([*_where(r), r["n"], f"{r['difference']:+.1f}{_half(r)}", _p(r["p"]), _p(r["p_holm"]), worth])
    return PageTable([*_WHERE, "n", "less own (points)", "p, sign flips", "p (Holm)", "own needs (min)"], rows)


def _curves(curves: Any) -> PageTable:
    rows: list[list[Cell]] = [
        [*_where(r), r["n"], _number(r["pairs"]), _number(r["minutes"]), f"{r['bacc']:.1f}{_half(r)}",
         _number(r["minutes_per_point"])]
        for r in _sorted(curves)
    ]  # fmt: skip
    return PageTable([*_WHERE, "n", "trials a class", "minutes", "balanced accuracy (%)", "minutes a point"], rows)


def _sorted(table: Any) -> list[dict[str, Any]]:
    """Return rows by scenario, problem and signal; within them as they are."""
    rows: list[dict[str, Any]] = table.to_dict("records")
    return sorted(rows, key=lambda r: (r["scenario"], r["problem"], r["signal"]))


def _where(row: Mapping[str, Any]) -> list[Cell]:
    return [row[name] for name in _WHERE]


def _half(row: Mapping[str, Any]) -> str:
    return f" ± {row['half_width']:.1f}" if math.isfinite(row["half_width"]) else ""


def _number(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "-"


def _p(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"
