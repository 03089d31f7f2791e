"""What came out of decode: accuracy with its interval, chance and p."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hrcneuro import published
from hrcneuro.answers.words import UNKNOWN, cells, counted, indented, interval, number, p_value, percent, spread

Summary = Mapping[str, Any]
_PUBLISHED = {problem for _, problem in published.TABLE_2}


def subject(summary: Summary) -> list[str]:
    """Return a subject's accuracies; the interval takes trials for independent draws, p is of a permutation test."""
    rows = [(scenario, name, _of_subject(name, one)) for scenario, name, one in cells(_problems(summary))]
    head = "accuracy [95 % interval]; chance is what guessing exceeds in 5 of 100 studies"
    return [head, *indented(rows)] if rows else ["nothing was decoded"]


def group(summary: Summary) -> list[str]:
    """Return mean accuracies over subjects with the mean's 95 % interval; p is of sign flips of balanced accuracy."""
    rows = [(scenario, name, _of_group(name, one)) for scenario, name, one in cells(_problems(summary))]
    head = "mean accuracy ± half its 95 % interval; p: balanced accuracy above 50 %, Holm's"
    return [head, *indented(rows)] if rows else ["nothing was decoded"]


def together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return mean and SD of the subjects' accuracies."""
    by_problem: dict[tuple[str, str], list[float]] = {}
    for summary in summaries.values():
        for scenario, name, one in cells(_problems(summary)):
            if one["acc"] is not None:
                by_problem.setdefault((scenario, name), []).append(one["acc"])
    rows = [(*problem, f"{spread(values)} %, n = {len(values)}") for problem, values in by_problem.items()]
    return [f"accuracy of {counted(len(summaries), 'subject')}, mean ± SD", *indented(rows)]


def _problems(summary: Summary) -> Summary:
    return {name: value for name, value in summary.items() if isinstance(value, Mapping)}


def _of_subject(name: str, one: Summary) -> str:
    n = one["n1"] + one["n2"]
    if one["acc"] is None or not n:
        return f"not decoded: {counted(n, 'trial')} ({one['n1']} and {one['n2']})"
    low, high = interval(one["acc"] / 100, n)
    return (
        f"{percent(one['acc'])} [{number(100 * low)}, {number(100 * high)}] of {counted(n, 'trial')}; "
        f"chance {percent(one['chance'])}, {p_value(one['p'])}; "
        f"{_by_class(name, one)}"
    )


def _of_group(name: str, one: Summary) -> str:
    half = "" if one["acc_half_width"] is None else f" ± {number(one['acc_half_width'])}"
    mean = UNKNOWN if one["acc"] is None else f"{number(one['acc'])}{half} %"
    return f"{mean}, n = {one['n']}; chance {percent(one['chance'])}, {p_value(one['p_holm'])}; {_by_class(name, one)}"


def _by_class(name: str, one: Summary) -> str:
    """Return the accuracy of each class; those of a study of one's own are no takeovers."""
    second, first = ("takeovers", "others") if name in _PUBLISHED else ("class 2", "class 1")
    return f"{second} {percent(one['tpr'])}, {first} {percent(one['tnr'])}"
