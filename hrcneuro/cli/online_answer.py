"""What the command online answers in the end: what was decided, how soon, and what the robot has learned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.live.online import Online


def told(loops: Sequence[Online], *, subject: str, mode: str, log: Path | None) -> dict[str, Any]:
    """Return the answer for JSON.

    Args:
        loops: Of one session, in their order; at least one.
        subject, mode: Whose it was, and in which mode.
        log: Where each move is told of, where there is such a file.
    """
    causes: dict[str, int] = {}
    for loop in loops:
        for cause, n in loop.deciding.causes.items():
            causes[cause] = causes.get(cause, 0) + n
    updates = causes.pop("", 0)
    last = loops[-1]
    return {
        "command": "online",
        "subject": subject,
        "mode": mode,
        "log": str(log) if log is not None else None,
        "moves": updates + sum(causes.values()),
        "updates": updates,
        "causes": dict(sorted(causes.items())),
        "not_heeded": {why: n for loop in loops for why, n in loop.hearing.strange.items()},
        "events": {kind: n for loop in loops for kind, n in loop.events.items()},
        "decided": sum(loop.decided for loop in loops),
        "in_time": sum(loop.in_time for loop in loops),
        "latency_ms": latencies(loops),
        "policy": last.deciding.policy,
        "learned": last.deciding.learner.policy(),
    }


def lines(told: Mapping[str, Any]) -> list[str]:
    """Return the same for people; ``told`` is of :func:`told`, with ``against_log`` after a replay."""
    causes = ", ".join(f"{cause} {n}" for cause, n in told["causes"].items())
    found = [
        f"{told['subject']}: {told['moves']} moves, {told['decided']} decided, {told['in_time']} in time, "
        f"{told['updates']} taught" + (f" (not: {causes})" if causes else "")
    ]
    found += [f"  {name}: median {one['median']:.1f} ms, 99 % {one['p99']:.1f}, most {one['max']:.1f}"
              for name, one in told["latency_ms"].items()]  # fmt: skip
    found.append("  who does it: " + ", ".join(f"{s} human {p:.2f}" for s, p in told["learned"].items()))
    if "against_log" in told:
        same = told["against_log"]
        found.append(
            f"  {same['equal']} scores as live, {same['different']} other; {same['undecided']} had none live, "
            f"{same['unrecorded']} lie before what the recording can tell, {same['unknown']} are not in the log"
        )
    if told["log"]:
        found.append(f"  log: {told['log']}")
    return found


def latencies(loops: Sequence[Online]) -> dict[str, dict[str, float]]:
    """Return stage -> median, p99 and largest duration, ms; the stages that were measured."""
    found = {}
    names = dict.fromkeys(name for loop in loops for name in loop.durations)
    for name in names:
        values = np.concatenate([np.asarray(loop.durations.get(name, ()), float) for loop in loops])
        found[name] = {
            "median": float(np.median(values)),
            "p99": float(np.percentile(values, 99)),
            "max": float(values.max()),
        }
    return found
