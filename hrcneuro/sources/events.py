"""Markers of any recording -> the events of a study."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pandas as pd

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.matching import histogram, listed


def select_events(markers: pd.DataFrame, event_map: Mapping[str, str]) -> tuple[pd.DataFrame, list[str]]:
    """Return the markers that the map names, under the map's names, and notes for the record.

    Without a map every marker is an event of its own name. A key may leave out BrainVision's ``Stimulus/`` and the
    blanks of ``S  1``.

    Raises:
        DataError: The recording has no markers at all.
        ConfigError: The map fits none of the markers, or a key is a likely misspelling of one.
    """
    have = histogram(markers)
    if not have:
        raise DataError(
            "the recording has no events: neither annotations nor a trigger channel",
            cure="check that it was saved with its markers (BrainVision needs its .vmrk file)",
        )
    if not event_map:
        return markers, [f"events: {listed(have)}"]
    names, missing = _resolve(event_map, have)
    hints = {key: hint for key in missing if (hint := did_you_mean(key, [n for n in have if n not in names]))}
    if hints or not names:
        wrong = ", ".join(f"{key!r}{hints.get(key, '')}" for key in hints or missing)
        raise ConfigError(
            f"acquire.event_map names markers that the recording does not have: {wrong}; it has {listed(have)}",
            cure="correct acquire.event_map; hrcneuro acquire SUBJECT --inspect lists the markers",
        )
    kept = markers[markers["event"].isin(list(names))].reset_index(drop=True)
    kept["event"] = kept["event"].map(names)
    notes = [f"events: {listed(histogram(kept))}"]
    if missing:
        notes.append(f"markers of the map that do not occur: {', '.join(missing)}")
    left = {name: count for name, count in have.items() if name not in names}
    if left:
        notes.append(f"markers left out: {listed(left)}")
    return kept, notes


def _resolve(event_map: Mapping[str, str], have: Mapping[str, int]) -> tuple[dict[str, str], list[str]]:
    """Return marker -> event name for the keys that fit, and the keys that fit nothing."""
    short = {_short(name): name for name in have}
    names, missing = {}, []
    for key, event in event_map.items():
        marker = key if key in have else short.get(_short(key))
        if marker is None:
            missing.append(key)
        else:
            names[marker] = event
    return names, missing


def _short(name: str) -> str:
    return re.sub(r"\s+", "", name.rpartition("/")[2])
