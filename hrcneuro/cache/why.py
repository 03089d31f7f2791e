"""Why an entry is stale: each cause named, in words that a person can read before running."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def causes(old: Mapping[str, Any] | None, new: Mapping[str, Any], *, prefix: str = "") -> list[str]:
    """Return the differences between the parts of the last key and of the one wanted now.

    ``old`` is None where the unit never ran. Parts are params, inputs, sources, code and libs; ``prefix`` stands before
    the names of params.
    """
    if old is None:
        return ["never run"]
    lines = [f"params: {line}" for line in _changes(old.get("params", {}), new["params"], prefix)]
    lines += [f"inputs: {line}" for line in _names(old.get("inputs", {}), new["inputs"])]
    lines += [f"sources: {line}" for line in _names(old.get("sources", {}), new.get("sources", {}))]
    lines += [f"code: {line}" for line in _names(old.get("code", {}), new["code"])]
    lines += [f"libs: {line}" for line in _changes(old.get("libs", {}), new["libs"])]
    return lines


def _changes(old: Mapping[str, Any], new: Mapping[str, Any], prefix: str = "") -> list[str]:
    lines: list[str] = []
    for name in sorted(set(old) | set(new)):
        was, now = old.get(name), new.get(name)
        if was == now:
            continue
        if isinstance(was, Mapping) and isinstance(now, Mapping):
            lines += _changes(was, now, f"{prefix}{name}.")
        else:
            lines.append(f"{prefix}{name} {_short(was)} -> {_short(now)}")
    return lines


def _names(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    lines = []
    for name in sorted(set(old) | set(new)):
        if name not in old:
            lines.append(f"{name} (new)")
        elif name not in new:
            lines.append(f"{name} (gone)")
        elif old[name] != new[name]:
            lines.append(name)
    return lines


def _short(value: Any) -> str:
    text = "absent" if value is None else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
