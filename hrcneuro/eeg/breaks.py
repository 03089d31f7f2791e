"""Discontinuities and bad stretches of a recording, as its annotations tell them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

# EEGLAB's name for a discontinuity, and MNE's two for a join.
_BREAKS = ("boundary", "bad boundary", "edge boundary")
_MARKS = ("bad", "edge", "boundary")


def is_break(description: str) -> bool:
    """Return whether an annotation marks a discontinuity: no filter and no epoch may reach across it."""
    return description.lower().startswith(_BREAKS)


def event_mark(event: str) -> str:
    """Return an annotation's text for an event: its name, behind ``event/`` where it would mark a break or bad data.

    MNE rejects epochs at whatever begins with ``bad``, and filters in pieces at what begins with ``edge``.
    """
    return f"event/{event}" if event.lower().startswith(_MARKS) else event


def borders(onsets_s: Iterable[float], descriptions: Iterable[str], sfreq: float) -> list[int]:
    """Return the first sample after each discontinuity, ascending, each once.

    A discontinuity half-way between two samples, where EEGLAB puts it, belongs to the later one. Annotations come
    through single precision, so "half-way" is meant within its step.
    """
    firsts = set()
    for onset, description in zip(onsets_s, descriptions, strict=True):
        if is_break(description):
            slack = min(float(np.spacing(np.float32(onset))) * sfreq, 0.25) + 1e-6
            firsts.add(math.floor(onset * sfreq + 0.5 + slack))
    return sorted(firsts)


def marked(
    onsets_s: Iterable[float], durations_s: Iterable[float], descriptions: Iterable[str], sfreq: float
) -> list[tuple[int, int]]:
    """Return the stretches that an annotation ``bad…`` covers, as (first sample, first sample after)."""
    return [
        (math.floor(onset * sfreq + 1e-3), math.ceil((onset + duration) * sfreq - 1e-3))
        for onset, duration, description in zip(onsets_s, durations_s, descriptions, strict=True)
        if duration > 0 and description.lower().startswith("bad") and not is_break(description)
    ]


def segments(borders: Sequence[int], n_samples: int) -> list[tuple[int, int]]:
    """Return the (start, stop) of the stretches between borders; a border is the first sample of a new stretch."""
    inner = sorted({b for b in borders if 0 < b < n_samples})
    edges = [0, *inner, n_samples]
    return [(a, b) for a, b in pairwise(edges) if b > a]
