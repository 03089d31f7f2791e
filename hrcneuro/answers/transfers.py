"""What came out of transfer: how well people are decoded whom no decoder has seen, and what calibration adds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hrcneuro.answers.words import UNKNOWN, cells, counted, indented, listed, number, p_value

Summary = Mapping[str, Any]
_LEVEL = 0.05
_ORDER = ("own", "pooled", "recentred, none", "recentred, all", "joint")


def subject(summary: Summary) -> list[str]:
    """Return which trials decoders see."""
    rows = [
        (scenario, problem, f"{counts[0]} and {counted(counts[1], 'trial')}")
        for scenario in sorted(summary["trials"])
        for problem, counts in sorted(summary["trials"][scenario].items())
    ]
    head = f"{listed(summary['signals'])}: trials of both classes at {counted(summary['channels'], 'channel')}"
    return [f"{head}; {counted(summary['lost'], 'epoch')} not seen by all", *indented(rows)]


def group(summary: Summary) -> list[str]:
    """Return mean balanced accuracies by way, with their interval, and how they differ from the subjects' own."""
    rows = [
        (scenario, place, way, _said(ways[way]))
        for scenario, place, ways in cells(summary["decoded"])
        for way in sorted(ways, key=_ORDER.index)
    ]
    control = ["labels were shuffled: a control, no result"] if summary["shuffled"] else []
    head = "mean balanced accuracy ± half its 95 % interval; p: above 50 %, Holm's; then less own, with Holm's p"
    return [*control, head, *indented(rows)] if rows else [*control, "nothing was decoded"]


def _said(one: Summary) -> str:
    half = "" if one["half_width"] is None else f" ± {number(one['half_width'])}"
    mean = UNKNOWN if one["bacc"] is None else f"{number(one['bacc'])}{half} %"
    text = f"{mean} after {number(one['minutes'])} min, n = {one['n']}, {p_value(one['p_holm'])}"
    if "difference_to_own" not in one:
        return text
    difference = number(one["difference_to_own"])
    sign = "" if difference.startswith("−") or difference == UNKNOWN else "+"
    text = f"{text}; {sign}{difference}, {p_value(one['p_holm_to_own'])}"
    # Where a way is not surely above chance, the minutes after which noise reaches it say nothing.
    if one["p_holm"] is None or one["p_holm"] >= _LEVEL:
        return text
    worth = one["worth_minutes"]
    return f"{text}; " + ("own never reaches it" if worth is None else f"own reaches it after {number(worth)} min")
