"""What came out of decode: accuracy with its interval, chance and p."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from hrcneuro import published
from hrcneuro.answers.words import (
    UNKNOWN,
    cells,
    counted,
    indented,
    interval,
    natural,
    number,
    p_value,
    percent,
    spread,
)

Summary = Mapping[str, Any]
_PUBLISHED = {problem for _, problem in published.TABLE_2}


def subject(summary: Summary) -> list[str]:
    """Return a subject's accuracies; the interval takes trials for independent draws, p is of a permutation test."""
    head = "accuracy [95 % interval]; chance is what guessing exceeds in 5 of 100 studies"
    return _table(head, summary, _of_subject)


def group(summary: Summary) -> list[str]:
    """Return mean accuracies over subjects with the mean's 95 % interval; p is of sign flips of balanced accuracy."""
    head = "mean accuracy ± half its 95 % interval; p: balanced accuracy above 50 %, Holm's"
    return _table(head, summary, _of_group)


def together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return mean and SD of the subjects' accuracies."""
    by_problem: dict[tuple[str, ...], list[float]] = {}
    for summary in summaries.values():
        for *place, one in _each(summary):
            if one["acc"] is not None:
                by_problem.setdefault(tuple(place), []).append(one["acc"])
    rows = [(*place, f"{spread(values)} %, n = {len(values)}") for place, values in by_problem.items()]
    return [f"accuracy of {counted(len(summaries), 'subject')}, mean ± SD", *_indented(rows)]


def _table(head: str, summary: Summary, said: Callable[[str, Summary], str]) -> list[str]:
    rows = [(scenario, name, decoder, said(name, one)) for scenario, name, decoder, one in _each(summary)]
    return [head, *_indented(rows)] if rows else ["nothing was decoded"]


def _indented(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows of scenario, problem, decoder and text; without the decoder where there is only one."""
    several = any(row[2] for row in rows)
    return indented(rows if several else [(*row[:2], row[3]) for row in rows])


def _each(summary: Summary) -> Iterator[tuple[str, str, str, Summary]]:
    """Yield scenario, problem, decoder and its numbers, the first decoder before the others.

    The name is empty where there is only one decoder.
    """
    problems = {name: value for name, value in summary.items() if isinstance(value, Mapping)}
    for scenario, name, one in cells(problems):
        others = one.get("others", {})
        yield scenario, name, one["decoder"] if others else "", one
        yield from ((scenario, name, other, {**one, **others[other]}) for other in sorted(others, key=natural))


def _of_subject(name: str, one: Summary) -> str:
    n = one["n1"] + one["n2"]
    if one["acc"] is None or not n:
        return f"not decoded: {counted(n, 'trial')} ({one['n1']} and {one['n2']})"
    low, high = interval(one["acc"] / 100, n)
    return (
        f"{percent(one['acc'])} [{number(100 * low)}, {number(100 * high)}] of {counted(n, 'trial')}; "
        f"chance {percent(one['chance'])}, {'p not computed' if one['p'] is None else p_value(one['p'])}; "
        f"{_by_class(name, one)}"
    )


def _of_group(name: str, one: Summary) -> str:
    half = "" if one["acc_half_width"] is None else f" ± {number(one['acc_half_width'])}"
    mean = UNKNOWN if one["acc"] is None else f"{number(one['acc'])}{half} %"
    return f"{mean}, n = {one['n']}; chance {percent(one['chance'])}, {p_value(one['p_holm'])}; {_by_class(name, one)}"


def _by_class(name: str, one: Summary) -> str:
    """Return the accuracy of each class; those of a study of one's own go by their conditions' names."""
    first, second = ("others", "takeovers") if name in _PUBLISHED else one.get("classes", ("class 1", "class 2"))
    return f"{second} {percent(one['tpr'])}, {first} {percent(one['tnr'])}"
