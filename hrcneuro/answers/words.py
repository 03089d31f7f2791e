"""Numbers in words: percent, p values, means with their spread, lists. What is missing is called "not known"."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

UNKNOWN = "not known"
ALL = "all"
"""The scenario that is all of them together."""


def number(value: float | None, digits: int = 1) -> str:
    """Return a number with so many digits behind its point."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    # Adding 0.0 makes -0.0 a plain zero; a minus is longer than a hyphen.
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def percent(value: float | None) -> str:
    """Return ``61.2 %``."""
    return UNKNOWN if value is None else f"{number(value)} %"


def p_value(value: float | None, name: str = "p") -> str:
    """Return ``p = 0.012``, ``p < 0.001`` or that there is none."""
    if value is None:
        return f"{name} {UNKNOWN}"
    return f"{name} < 0.001" if value < 0.001 else f"{name} = {value:.3f}"


def counted(n: int, noun: str, nouns: str = "") -> str:
    """Return ``1 epoch`` or ``1,623 epochs``."""
    return f"{n:,} {noun if n == 1 else nouns or noun + 's'}"


def roughly(seconds: float) -> str:
    """Return a duration as people say it: ``40 s``, ``12 min`` or ``1.6 h``."""
    if seconds < 90:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60)} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def counts(of: Mapping[str, int]) -> str:
    """Return ``HH 32, HR 12``, sorted by name."""
    return ", ".join(f"{name} {n:,}" for name, n in sorted(of.items(), key=lambda item: natural(item[0])))


def listed(names: Iterable[str]) -> str:
    """Return ``A, B and C``."""
    *most, last = list(names) or ["none"]
    return f"{', '.join(most)} and {last}" if most else last


def spread(values: Sequence[float], digits: int = 1) -> str:
    """Return ``mean ± SD`` of several values; the one value where there is one."""
    if len(values) < 2:
        return number(values[0], digits) if values else UNKNOWN
    return f"{number(statistics.fmean(values), digits)} ± {number(statistics.stdev(values), digits)}"


def span(values: Sequence[float], digits: int = 1) -> str:
    """Return ``3.6 to 4.0``, or the one number that all have."""
    texts = list(dict.fromkeys((number(min(values), digits), number(max(values), digits))))
    return " to ".join(texts)


def interval(share: float, n: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share of ``n`` draws (J. Am. Stat. Assoc. 22:209, 1927)."""
    z2 = 1.959964**2
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = math.sqrt(z2 * (share * (1 - share) / n + z2 / (4 * n * n))) / (1 + z2 / n)
    return max(0.0, middle - half), min(1.0, middle + half)


def natural(text: str) -> tuple[Any, ...]:
    """Return a key that sorts ``all`` first and ``8/2`` before ``10/2``."""
    pieces = re.split(r"(\d+)", text)
    return text != ALL, [(not piece.isdigit(), int(piece) if piece.isdigit() else 0, piece) for piece in pieces]


def cells(summary: Mapping[str, Any]) -> list[tuple[str, str, Mapping[str, Any]]]:
    """Return (scenario, name, what is said of it) of a table of tables, ``all`` first."""
    return [
        (scenario, name, summary[scenario][name])
        for scenario in sorted(summary, key=natural)
        for name in sorted(summary[scenario], key=natural)
    ]


def aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows as lines whose columns, all but the last, begin below one another."""
    if not rows:
        return []
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]) - 1)]
    return ["  ".join([*(f"{text:<{w}}" for text, w in zip(row, widths, strict=False)), row[-1]]) for row in rows]


def indented(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows as :func:`aligned` does, below what introduces them."""
    return [f"  {line}" for line in aligned(rows)]


def plainly(summary: Mapping[str, Any]) -> list[str]:
    """Return the plain values of any summary, by their names."""
    rows = [(str(name), _plain(value)) for name, value in sorted(summary.items()) if name != "warnings"]
    return aligned([(name, text) for name, text in rows if text])


def _plain(value: Any) -> str:
    if isinstance(value, str | int | float):
        return f"{value:.4g}" if isinstance(value, float) else str(value)
    if isinstance(value, list) and all(isinstance(one, str | int | float) for one in value):
        return ", ".join(map(str, value))
    return ""
