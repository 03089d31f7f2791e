"""What came out of calibrate: how the decoder does on held-out blocks, beside what needs no EEG."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hrcneuro.answers.words import counted, counts, indented, listed, natural, number, percent, spread

Summary = Mapping[str, Any]
_RULES = {"stays": "the actor stays", "prev_error": "after an error", "turn": "before a turn"}


def subject(summary: Summary) -> list[str]:
    """Return what the decoder takes, its balanced accuracy on held-out blocks, and that of rules without EEG."""
    lines = [
        f"a decoder for {summary['channels']} channels at {summary['sfreq']:g} Hz, ready "
        f"{number(1000 * summary['epoch_samples'] / summary['sfreq'], 0)} ms after an onset; from "
        f"{counted(summary['trials'], 'trial')}{_dropped(summary)}{_matched(summary)}",
        "balanced accuracy on blocks that it has not seen ± half its 95 % interval:",
        *indented([(name, _scored(one)) for name, one in _each(summary)]),
        "balanced accuracy without EEG:",
        *indented([(name, _rules(one)) for name, one in _each(summary)]),
    ]
    strata = [(name, _strata(one)) for name, one in _each(summary)]
    if any(text for _, text in strata):
        lines += ["and within strata:", *indented(strata)]
    return lines


def together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return mean and SD of the subjects' balanced accuracies on held-out blocks."""
    by_problem: dict[str, list[float]] = {}
    for summary in summaries.values():
        for name, one in _each(summary):
            by_problem.setdefault(name, []).append(one["bacc"])
    rows = [(name, f"{spread(values)} %, n = {len(values)}") for name, values in by_problem.items()]
    return [f"balanced accuracy on held-out blocks of {counted(len(summaries), 'subject')}, mean ± SD", *indented(rows)]


def _each(summary: Summary) -> Iterator[tuple[str, Summary]]:
    yield from sorted(summary["problems"].items(), key=lambda item: natural(item[0]))


def _scored(one: Summary) -> str:
    return (
        f"{number(one['bacc'])} ± {number(1.96 * one['bacc_se'])} %; takeovers {percent(one['tpr'])} of {one['n2']}, "
        f"others {percent(one['tnr'])} of {one['n1']}; it says that the actor stays in {percent(one['stays'])}; "
        f"log loss {number(one['log_loss'], 3)} bits (1: knows nothing)"
    )


def _rules(one: Summary) -> str:
    rules = one["rules"]
    return ", ".join(f"{_RULES[name]} {percent(rules[name]['bacc'])}" for name in _RULES if name in rules)


def _strata(one: Summary) -> str:
    found = {name: value for name, value in one["strata"].items() if value is not None}
    return ", ".join(f"{name} {percent(found[name])}" for name in sorted(found))


def _matched(summary: Summary) -> str:
    return f", within strata of {listed(summary['matched'])}" if summary["matched"] else ""


def _dropped(summary: Summary) -> str:
    return f" (dropped: {counts(summary['dropped'])})" if summary["dropped"] else ""
