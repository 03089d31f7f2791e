"""The tables of the chapter on regression: coefficients, what plain differences are made of, the strata beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.contract import GROUP
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.figures.notes import contrast_title
from hrcneuro.report.markup import Cell, PageTable
from hrcneuro.report.measured_brain import BEFORE, POSITIVITY
from hrcneuro.report.results import Results
from hrcneuro.tables.maps import read_tested as read_contrasts
from hrcneuro.tables.rerp import PLAIN, REST, Part, read_parts, read_tested

_TAKEOVER = "takeover"


def values(results: Results) -> Mapping[str, Any]:
    """Return what the chapter's template shows; empty where the group has not run."""
    stats, parts = (results.path("rerp", GROUP, f"rerp_{name}.parquet") for name in ("stats", "parts"))
    if stats is None or parts is None:
        return {}
    tested = read_tested(stats)
    channels = next(iter(tested.maps.values())).channels
    shown = [name for name in POSITIVITY.channels if name in channels] or channels
    made = read_parts(parts, shown)
    times = next(iter(tested.maps.values())).times
    return {
        "formula": results.summary("rerp").get("formula", ""),
        "where": POSITIVITY.region if len(shown) < len(channels) else "all channels",
        "span": f"{1000 * POSITIVITY.s[0]:.0f} to {1000 * POSITIVITY.s[1]:.0f} ms" if POSITIVITY.s else "",
        "coefficients": _coefficients(results),
        "parts": _parts(made, times),
        "beside": _beside(results, tested.maps, made, times),
    }


def _coefficients(results: Results) -> PageTable:
    rows: list[list[Cell]] = []
    path = results.path("rerp", GROUP, "rerp_stats.parquet")
    maps = read_tested(path).maps if path else {}
    for (scenario, name), one in maps.items():
        peak = results.summary("rerp")["coefficients"][scenario][name]["peak"]
        largest = f"{peak['difference_uv']:.2f} µV at {peak['channel']}, {1000 * peak['time_s']:.0f} ms"
        rows.append([scenario, name, one.n, largest, one.describe() if one.tested else "one subject: not tested"])
    return PageTable(["scenario", "coefficient", "subjects", "largest", "significant"], rows)


def _parts(parts: list[Part], times: np.ndarray) -> PageTable:
    """Return a row a scenario and contrast, a column a part."""
    names = [PLAIN, *dict.fromkeys(p.name for p in parts if p.name not in (PLAIN, REST)), REST]
    rows: list[list[Cell]] = []
    for key in dict.fromkeys((p.scenario, p.contrast) for p in parts):
        own = {p.name: f"{_level(p.map, times):.2f}" for p in parts if (p.scenario, p.contrast) == key}
        rows.append([*key, *(own.get(name, "-") for name in names)])
    return PageTable(["scenario", "contrast", *names], rows)


def _beside(
    results: Results, maps: Mapping[tuple[str, str], SignificanceMap], parts: list[Part], times: np.ndarray
) -> PageTable:
    """Return the takeover's difference of all trials, of each stratum, and of all trials in one model, by scenario."""
    rows: list[list[Cell]] = []
    of_erp = (results.path("erp", GROUP, f"erp_{name}.parquet") for name in ("stats", "strata"))
    found = [(key, one) for path in of_erp if path for key, one in _contrasts(path).items() if key[1] == BEFORE]
    for scenario in dict.fromkeys(p.scenario for p in parts if p.contrast == BEFORE):
        for (place, contrast), one in found:
            if place == scenario or place.startswith(f"{scenario}, "):
                own = one.within(POSITIVITY.channels)
                level = _level((own if own.channels else one).difference, one.times)
                rows.append([contrast_title(place, contrast, one.n), f"{level:.2f}", one.describe()])
        own_parts = [p for p in parts if (p.scenario, p.contrast) == (scenario, BEFORE) and _TAKEOVER in p.name]
        if own_parts:
            level = sum(_level(p.map, times) for p in own_parts)
            sure = [f"{p.name}: {maps[scenario, p.name].describe()}" for p in own_parts if (scenario, p.name) in maps]
            rows.append([f"{scenario}: all trials in one model", f"{level:.2f}", "; ".join(sure)])
    return PageTable(["trials", "µV", "significant anywhere"], rows)


def _contrasts(path: Path) -> Mapping[tuple[str, str], SignificanceMap]:
    return read_contrasts(path).maps


def _level(one: np.ndarray, times: np.ndarray) -> float:
    """Return the mean over channels and the positivity's time."""
    start, stop = POSITIVITY.s or (times[0], times[-1])
    return float(one[:, (times >= start) & (times <= stop)].mean())
