"""What came out of simulate and robot: when a robot has learned, and how exact and punctual the arm was."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hrcneuro.answers.words import UNKNOWN, counted, indented, listed, natural, number

Summary = Mapping[str, Any]


def simulate(summary: Summary, every: bool) -> list[str]:
    """Return the milestones: when a robot first chooses right so often, and how often in the end."""
    rows, of = [], summary["milestones"]
    for simulation in sorted(of, key=natural)[: None if every else 1]:
        for variant in sorted(of[simulation], key=natural):
            curve = summary.get(simulation, {}).get(variant, {})
            last = max(curve, key=int, default="")
            end = [f"{number(100 * curve[last])} % at episode {last}"] if last else []
            levels = of[simulation][variant]
            said = [_milestone(level, levels[level]) for level in sorted(levels, key=natural)]
            rows.append((simulation, variant, "; ".join([*said, *end])))
    return ["right choices, by simulation and decoder; the minutes are for trials of so many seconds:", *indented(rows)]


def sweep(summary: Summary, every: bool) -> list[str]:
    """Return how good a decoder must be, a line a design and duration of a trial; or which design learns soonest."""
    if "soonest" in summary:
        return _soonest(summary)
    rows = summary["needed"]
    # A design that says nothing of the duration of a trial (tasks change) is told once.
    rows = [row for row in rows if not row["period"] or row["trial_s"] == min(one["trial_s"] for one in rows)]
    lines = [(design(row["design"]), _asked(row, summary), _enough(row)) for row in rows]
    if len({line[0] for line in lines}) == 1 and not lines[0][0]:
        return [
            f"{_level(summary)} right choices {asked} needs a decoder that is right in {enough}"
            for _, asked, enough in lines
        ]
    left = len(lines) - _FEW
    shown = lines if every or left < 2 else lines[:_FEW]
    more = [f"… {left} more: hrcneuro show simulate sweep"] if len(shown) < len(lines) else []
    return [f"{_level(summary)} right choices needs a decoder that is right in:", *indented(shown), *more]


_FEW = 12


def design(axes: Mapping[str, float]) -> str:
    """Return what is special of a design, ``alpha 0.1, events 20``; empty where nothing is."""
    return ", ".join(f"{name} {axes[name]:g}" for name in sorted(axes))


def _level(summary: Summary) -> str:
    return f"{summary['level']:g} %"


def _asked(row: Summary, summary: Summary) -> str:
    if row["period"]:
        return f"after {row['episode']:g} episodes, tasks changing every {row['period']:g}"
    if row["episode"] >= summary["episodes"]:
        return f"within {row['episode']:g} episodes"
    return f"within {summary['goal_min']:g} minutes at {row['trial_s']:g} s a trial"


def _enough(row: Summary) -> str:
    """Return the smallest accuracy that is enough, with what the Monte-Carlo draws leave open."""
    if row["accuracy"] is None:
        return f"more than {row['below']:g} %, the best that was swept"
    if row["below"] is None:
        return f"{row['above']:g} % or less, the least that was swept"
    between = f"between {row['below']:g} and {row['above']:g} % of those swept"
    high = f"more than {number(row['above'])}" if row["high"] is None else number(row["high"])
    return f"{number(row['accuracy'])} % or more (95 % band {number(row['low'])} to {high}; {between})"


def _soonest(summary: Summary) -> list[str]:
    best, decoder = summary["soonest"], f"a decoder that is right in {summary['accuracy']:g} %"
    where = f" with {design(best['design'])}" if best["design"] else ""
    if best["minutes_1s"] is None:
        end = f"{number(100 * best['final'])} ± {number(100 * best['final_half_width'])} %"
        return [
            f"{decoder}: {_level(summary)} right choices never within {summary['episodes']} episodes; "
            f"most{where}: {end} in the end"
        ]
    return [
        f"{decoder}: {_level(summary)} right choices soonest{where}: after {number(best['minutes_1s'])} minutes at 1 s "
        f"a trial, {number(best['minutes_2s'])} at 2 s"
    ]


def robot(summary: Summary) -> list[str]:
    """Return a session's largest errors and its timing."""
    stops = summary["stops"]
    return [
        f"{counted(summary['moves'], 'move')}, {counted(stops, 'stop') if stops else 'never stopped'}",
        f"largest distance from the path {_unit(summary['max_error_mm'], 'mm', 3)}, at the end of a move "
        f"{_unit(summary['end_error_mm'], 'mm', 3)}; within 2 mm after {_unit(summary['t_2mm_s'], 's', 3)} (median)",
        f"control loop {_unit(summary['loop_hz'], 'Hz', 1)}, 99 % of its cycles within "
        f"{_unit(summary['jitter_p99_ms'], 'ms', 3)} of their time; lead {_unit(summary['lead_ms'], 'ms', 1)}",
        *_late_packets(summary),
    ]


def _late_packets(summary: Summary) -> list[str]:
    if not summary.get("late_packets"):
        return []
    oldest = _unit(summary["oldest_packet_ms"], "ms", 0)
    return [f"late packets were borne in {counted(summary['late_packets'], 'cycle')}, the oldest of {oldest}"]


def robot_together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return the largest errors and the worst timing of several sessions."""
    ones = list(summaries.values())
    stopped = sorted(unit for unit, one in summaries.items() if one["stops"])
    return [
        f"{counted(len(ones), 'session')}, {counted(sum(one['moves'] for one in ones), 'move')}; "
        + (f"stopped: {listed(stopped)}" if stopped else "never stopped"),
        f"largest distance from the path {_unit(_worst(ones, 'max_error_mm'), 'mm', 3)}, at the end of a move "
        f"{_unit(_worst(ones, 'end_error_mm'), 'mm', 3)}",
        f"worst session: 99 % of the cycles within {_unit(_worst(ones, 'jitter_p99_ms'), 'ms', 3)} of their time",
    ]


def _milestone(level: str, one: Summary) -> str:
    if one["episode"] is None:
        return f"{level} % never"
    times = one["minutes"]
    said = ", ".join(f"{number(times[s])} at {s} s" for s in sorted(times, key=float) if times[s] is not None)
    return f"{level} % at episode {one['episode']}" + (f" (minutes: {said})" if said else "")


def _worst(ones: list[Summary], name: str) -> float | None:
    return max((one[name] for one in ones if one[name] is not None), default=None)


def _unit(value: float | None, unit: str, digits: int) -> str:
    return UNKNOWN if value is None else f"{number(value, digits)} {unit}"
