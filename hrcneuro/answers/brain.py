"""What came out of erp and ersp: where, when and how large a difference between two conditions is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hrcneuro.answers.words import ALL, cells, counted, counts, indented, listed, natural, number, p_value

Summary = Mapping[str, Any]


def subject(summary: Summary, every: bool) -> list[str]:
    """Return trials by condition, and where each difference of one subject is largest."""
    trials, found = summary["trials"], []
    for scenario in _chosen(trials, every):
        name = "" if list(trials) == [ALL] else f", {scenario}"
        found.append(f"trials by condition{name}: {counts(trials[scenario])}")
    gap_s = summary.get("shortest_gap_s")
    rows = [
        (scenario, name, peak_words(one["peak"]) + when(one["peak"]["time_s"], gap_s))
        for scenario, name, one in _contrasts(summary, every)
    ]
    return [*found, *(["largest difference, of one subject, so not tested:", *indented(rows)] if rows else [])]


def group(summary: Summary, every: bool) -> list[str]:
    """Return where each difference over subjects is largest, how sure it is, and which are significant anywhere."""
    contrasts = cells(summary["contrasts"])
    gap_s = summary.get("shortest_gap_s")
    rows = [(scenario, name, tested_words(one, gap_s)) for scenario, name, one in _contrasts(summary, every)]
    sure = [f"{scenario} {name}" for scenario, name, one in contrasts if one["significant"]]
    tested = sum(one["p_min"] is not None for _, _, one in contrasts)
    return [
        f"{counted(len(summary['subjects']), 'subject')}; largest difference, p corrected over the whole map:",
        *indented(rows),
        f"significant at {summary['alpha']:g} somewhere on the map: {len(sure)} of {tested} contrasts"
        + (f" ({listed(sure)})" if sure else ""),
    ]


def _chosen(scenarios: Summary, every: bool) -> list[str]:
    """Return the scenarios that are told: all of them together, where there is such a thing, or every one."""
    return [ALL] if ALL in scenarios and not every else sorted(scenarios, key=natural)


def _contrasts(summary: Summary, every: bool) -> list[tuple[str, str, Summary]]:
    of = summary["contrasts"]
    return cells({scenario: of[scenario] for scenario in _chosen(of, every)})


def when(time_s: float, gap_s: float | None) -> str:
    """Return what is said of a time before the onset, or after the shortest gap to the next one; empty of others."""
    if time_s < 0:
        return ", before the onset"
    return f", after the earliest next onset ({number(1000 * gap_s, 0)} ms)" if gap_s and time_s > gap_s else ""


def tested_words(one: Summary, gap_s: float | None) -> str:
    """Return where a tested map is largest, and how sure that is."""
    peak, text = one["peak"], peak_words(one["peak"]) + when(one["peak"]["time_s"], gap_s)
    if one["p_min"] is None:
        return f"{text}; not tested, n = {one['n']}"
    text += f"; t = {number(peak['t'], 2)}, {p_value(peak['p'])}, n = {one['n']}"
    # The effect sizes of a group of two are often beyond all bounds.
    if peak["dz"] is not None and peak["dz_low"] is not None and peak["dz_high"] is not None:
        text += f"; dz = {number(peak['dz'], 2)} [{number(peak['dz_low'], 2)}, {number(peak['dz_high'], 2)}]"
    return text


def peak_words(peak: Summary) -> str:
    """Return how large a map is at most, where and when."""
    sign = "+" if peak["difference_uv"] >= 0 else ""
    hertz = f", {peak['frequency_hz']:g} Hz" if "frequency_hz" in peak else ""
    time = f"{number(1000 * peak['time_s'], 0)} ms"
    return f"{sign}{number(peak['difference_uv'], 2)} µV at {peak['channel']}{hertz}, {time}"
