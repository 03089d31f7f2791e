"""The lines of ``experiment.jsonl`` as they are written: an object each, with kind and times."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import datetime
from importlib.metadata import version
from typing import Any

from hrcneuro.sources import experiments

_LIBRARIES = ("hrcneuro", "numpy", "pandas", "pyarrow")


def session(
    part: int, subject: str, options: Mapping[str, Any], about: Mapping[str, Any] | None, clock_s: float
) -> dict[str, Any]:
    """Return what the first line of a part of a session tells."""
    versions = {name: version(name) for name in _LIBRARIES}
    fields = {"subject": subject, "part": part, "options": options, "about": about or {}}
    return {**fields, "versions": versions, "clock_s": round(clock_s, 6)}


def entry_of(kind: str, session_s: float, wall: datetime, fields: Mapping[str, Any]) -> experiments.Entry:
    """Return a line's object.

    Args:
        kind: What it tells.
        session_s: When that was, seconds of the session.
        wall: The same as a time of day.
        fields: What else it says; see :func:`plain`.
    """
    at = wall.isoformat(timespec="milliseconds")
    return {"kind": kind, "s": round(session_s, 6), "at": at, **plain(fields)}


def line_of(entry: experiments.Entry) -> str:
    """Return an object as a line."""
    return json.dumps(entry, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def plain(value: Any) -> Any:
    """Return a value as JSON has it: a number that does not exist is null, what has no order is sorted."""
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, (set, frozenset)):
        return sorted(map(plain, value))
    if isinstance(value, (list, tuple)):
        return list(map(plain, value))
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value.item() if hasattr(value, "item") else value
