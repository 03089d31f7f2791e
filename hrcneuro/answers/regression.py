"""What came out of rerp: what each predictor adds to the response, where, when and how sure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hrcneuro.answers.brain import peak_words, tested_words, when
from hrcneuro.answers.words import cells, counted, counts, indented, listed, number

Summary = Mapping[str, Any]

_INTERCEPT = "Intercept"


def subject(summary: Summary, every: bool) -> list[str]:
    """Return the model, its trials, and where each coefficient of one subject is largest."""
    rows = []
    for scenario, name, one in _coefficients(summary, every):
        factor = one["inflation"]
        apart = f"; variance inflation {number(factor, 1)}" if factor is not None else ""
        text = peak_words(one["peak"]) + when(one["peak"]["time_s"], summary["shortest_gap_s"])
        rows.append((scenario, name, f"{text}; {counted(one['nonzero'], 'trial')} not 0{apart}"))
    return [
        _model(summary),
        f"trials: {counts(summary['trials'])}; with something unknown: {counts(summary['unknown'])}",
        "largest value of each coefficient, of one subject, so not tested:",
        *indented(rows),
    ]


def group(summary: Summary, every: bool) -> list[str]:
    """Return where each coefficient over subjects is largest, how sure it is, and which are significant anywhere."""
    found = [one for one in _coefficients(summary, every=True) if one[1] != _INTERCEPT]
    sure = [f"{scenario} {name}" for scenario, name, one in found if one["significant"]]
    tested = sum(one["p_min"] is not None for _, _, one in found)
    rows = [
        (scenario, name, tested_words(one, summary["shortest_gap_s"]))
        for scenario, name, one in _coefficients(summary, every)
    ]
    return [
        _model(summary),
        f"{counted(len(summary['subjects']), 'subject')}; largest value, p corrected over the whole map:",
        *indented(rows),
        f"significant at {summary['alpha']:g} somewhere on the map: {len(sure)} of {tested} coefficients"
        + (f" ({listed(sure)})" if sure else ""),
    ]


def _model(summary: Summary) -> str:
    apart = "regressed out" if summary["overlap"] == "regress" else "kept"
    return f"potential ~ {summary['formula']}; overlap {apart}"


def _coefficients(summary: Summary, every: bool) -> list[tuple[str, str, Summary]]:
    """Return (scenario, coefficient, what came out), the intercept only where every one is wanted."""
    found = cells(summary["coefficients"])
    return [one for one in found if every or one[1] != _INTERCEPT]
