"""What came out, in a few words and numbers: a stage's JSON summary in, lines of text out. Pure functions.

:func:`lines` is of one unit, :func:`together` of several subjects. Both read nothing but the summary that ``--json``
prints, so what a person reads and what a program reads cannot differ. A summary that has been in the cache has lost its
order: what is listed here is sorted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from hrcneuro.answers import brain, calibrations, decoding, evidences, recordings, regression, robots, transfers, words
from hrcneuro.contract import EVIDENCE, GROUP, SWEEP

Summary = Mapping[str, Any]

_SUBJECT: Mapping[str, Callable[[Summary], list[str]]] = {
    "acquire": recordings.acquire,
    "preprocess": recordings.preprocess,
    "epoch": recordings.epoch,
    "decode": decoding.subject,
    "transfer": transfers.subject,
    "robot": robots.robot,
    "calibrate": calibrations.subject,
}
_GROUP: Mapping[str, Callable[[Summary], list[str]]] = {"decode": decoding.group, "transfer": transfers.group}
# Long tables: stage, whether of the group.
_LONG: Mapping[tuple[str, bool], Callable[[Summary, bool], list[str]]] = {
    **{(stage, False): brain.subject for stage in ("erp", "ersp")},
    **{(stage, True): brain.group for stage in ("erp", "ersp")},
    ("rerp", False): regression.subject,
    ("rerp", True): regression.group,
    ("simulate", True): robots.simulate,
}
_TOGETHER: Mapping[str, Callable[[Mapping[str, Summary]], list[str]]] = {
    "acquire": recordings.acquire_together,
    "preprocess": recordings.preprocess_together,
    "epoch": recordings.epoch_together,
    "decode": decoding.together,
    "robot": robots.robot_together,
    "calibrate": calibrations.together,
}


def lines(stage: str, unit: str, summary: Summary, *, every: bool = False) -> list[str]:
    """Return a unit's numbers; those of a stage that is not known here are its summary's own names and values.

    ``every``: also the rows of long tables that are otherwise left out.
    """
    if not summary:
        return []
    if unit == SWEEP:
        return robots.sweep(summary, every)
    if unit == EVIDENCE:
        return evidences.evidence(summary)
    if long := _LONG.get((stage, unit == GROUP)):
        return long(summary, every)
    known = (_GROUP if unit == GROUP else _SUBJECT).get(stage)
    return known(summary) if known else words.plainly(summary)


def block(head: str, lines: Iterable[str]) -> list[str]:
    """Return lines below what they are of."""
    return [head, *(f"  {line}" for line in lines)]


def together(stage: str, summaries: Mapping[str, Summary]) -> list[str]:
    """Return the numbers of several subjects (subject -> summary), over all; none where nothing sums them up."""
    known = _TOGETHER.get(stage)
    return known(summaries) if known and summaries else []
