"""Markers of any recording -> the events of a study: which marker a key means, and which markers are one event."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pandas as pd

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.matching import histogram, listed
from hrcneuro.sources.recording import Recording, markers_of

# Kinds of BrainVision markers that a key may leave out. A response is no stimulus: it is named in full.
_PREFIXES = ("Stimulus/", "Comment/")
# Two recordings of one stream keep their distance to a few milliseconds: clocks are synchronised anew all the time.
_SAME_STREAM_S = 2e-3
# The second may be late by its program or its network. A few regular pairs may be the experiment's own.
_SECOND_WITHIN_S = 0.1
_PAIRS = 8
# Sample times are rounded, on both sides.
_ROUNDING = 1.01


def select_events(
    recording: Recording, event_map: Mapping[str, str], *, least_gap_s: float = 0.0, twins: str = "refuse"
) -> pd.DataFrame:
    """Return the markers that the map names, under the map's names, columns onset_s and event.

    Without a map every marker is an event of its own name. A key may leave out BrainVision's ``Stimulus/`` or
    ``Comment/`` and the blanks of ``S  1``. What is to be known goes to the recording's notes and warnings; a stretch
    marked bad, or a break told by its name alone, becomes an event of the recording where the map names it.

    Args:
        recording: As read.
        event_map: Marker -> event.
        least_gap_s, twins: As in :func:`separate`.

    Raises:
        DataError: The recording has no markers at all, or twins are refused.
        ConfigError: The map fits none of the markers, a key fits several, or two keys mean one marker.
    """
    _claim(recording, event_map)
    have = histogram(recording.markers)
    if not have:
        triggers = ", ".join(recording.ch_names[i] for i in recording.picks("stim"))
        breaks = f", only breaks: {listed(_names(recording.named_breaks))}" if recording.named_breaks else ""
        if breaks:
            cure = "name in acquire.event_map those that are events"
        elif triggers:
            cure = "check that triggers were recorded; acquire.markers names the channel that holds them"
        else:
            cure = (
                "check that it was saved with its markers (BrainVision's are a .vmrk file, a table's are "
                "acquire.marker_column); acquire.channel_types = {NAME = 'stim'} makes a channel the triggers'"
            )
        raise DataError(
            "the recording has no events: neither annotations nor "
            f"{f'triggers in {triggers}' if triggers else 'a trigger channel'}{breaks}",
            cure=cure,
        )
    kept = recording.markers
    if event_map:
        names = _resolve(event_map, have, recording)
        kept = kept[kept["event"].isin(list(names))].reset_index(drop=True)
        kept["event"] = kept["event"].map(names)
        left = {name: count for name, count in have.items() if name not in names}
        if left:
            recording.notes.append(f"markers left out: {listed(left)}")
    kept = separate(kept, recording, least_gap_s=least_gap_s, twins=twins)
    _note_coincidence(kept, recording)
    recording.notes.append(f"events: {listed(histogram(kept))}")
    return kept


def separate(markers: pd.DataFrame, recording: Recording, *, least_gap_s: float, twins: str) -> pd.DataFrame:
    """Return the markers with each event once; a warning of the recording says how many were left out.

    Markers of one name are one event where they are a sample or less apart, and where all markers come twice at one
    distance up to 0.1 s: two recordings of one stream. Others closer than the least gap are twins.

    Args:
        markers: Columns onset_s and event, in order of time.
        recording: Whose they are; gives the sampling rate.
        least_gap_s: Gap in s below which two markers of one name are twins.
        twins: ``refuse``, ``merge`` (the first counts) or ``keep``.

    Raises:
        DataError: There are twins, and they are refused.
    """
    markers = _merged(markers, _ROUNDING / recording.sfreq, "a sample or less apart", recording)
    gaps = _gaps(markers)
    near, second = gaps < least_gap_s, gaps < max(least_gap_s, _SECOND_WITHIN_S)
    if twins == "keep" or not least_gap_s or not second.any():
        return markers
    all_twice = 2 * second.sum() == len(markers) and np.ptp(gaps[second]) <= _SAME_STREAM_S
    if all_twice and (near.all(where=second) or second.sum() >= _PAIRS):
        apart = f"each {1000 * float(np.median(gaps[second])):.0f} ms after an equal one"
        what = f"{apart}: two recordings of one stream (acquire.twins = 'keep' keeps both)"
        return _merged(markers, float(gaps[second].max()) + _ROUNDING / recording.sfreq, what, recording)
    if not near.any():
        return markers
    if twins == "merge":
        return _merged(markers, least_gap_s, f"closer than {1000 * least_gap_s:g} ms to an equal one", recording)
    first = int(np.argmax(near))
    name, at = markers["event"].iloc[first], markers["onset_s"].iloc[first]
    raise DataError(
        f"{int(near.sum())} of {len(markers)} markers follow less than {1000 * least_gap_s:g} ms after one of the same "
        f"name, the first {name!r} at {at:.3f} s, {1000 * gaps[first]:.1f} ms after its twin: one event would be two "
        "trials",
        cure="acquire.twins = 'merge' makes them one, 'keep' keeps both; acquire.least_gap_s is what counts as close",
    )


def _gaps(markers: pd.DataFrame) -> np.ndarray:
    """Return the time of each marker since the one before of its name, infinite for the first."""
    return markers.groupby("event", sort=False)["onset_s"].diff().fillna(np.inf).to_numpy(float)


def _merged(markers: pd.DataFrame, closer_s: float, what: str, recording: Recording) -> pd.DataFrame:
    """Return the markers without those that follow one of their name, which is kept, by less than ``closer_s``."""
    keep, onsets = np.ones(len(markers), bool), markers["onset_s"].to_numpy(float)
    for rows in markers.groupby("event", sort=False).indices.values():
        last = -np.inf
        for row in rows:
            keep[row] = onsets[row] - last >= closer_s
            last = onsets[row] if keep[row] else last
    if keep.all():
        return markers
    recording.warnings.append(f"{listed(histogram(markers[~keep]))}: equal markers {what}, taken for one event")
    return markers[keep].reset_index(drop=True)


def _note_coincidence(events: pd.DataFrame, recording: Recording) -> None:
    """Warn of events of different names at one moment: they would be trials of two conditions with one signal."""
    close = events["onset_s"].diff().to_numpy(float) < _ROUNDING / recording.sfreq
    pairs: dict[str, int] = {}
    for row in np.flatnonzero(close):
        pair = " and ".join(sorted(map(str, events["event"].iloc[row - 1 : row + 1])))
        pairs[pair] = pairs.get(pair, 0) + 1
    if pairs:
        recording.warnings.append(f"events of two names at one moment: {listed(pairs)}")


def _claim(recording: Recording, event_map: Mapping[str, str]) -> None:
    """Make markers of the breaks and bad stretches that the map names; say what stays a break or bad by its name."""
    spans = [span for span in recording.spans if span[2] in event_map]
    named = [one for one in recording.named_breaks if one[2] in event_map]
    recording.spans = [span for span in recording.spans if span not in spans]
    recording.named_breaks = [one for one in recording.named_breaks if one not in named]
    recording.breaks_s = [at for at in recording.breaks_s if at not in {at for at, _, _ in named}]
    mine = [(at, text) for at, _, text in spans] + [(at, text) for _, at, text in named]
    if mine:
        old = recording.markers
        recording.markers = markers_of(
            [*old["onset_s"], *(at for at, _ in mine)], [*old["event"], *(text for _, text in mine)]
        )
    if recording.named_breaks:
        recording.warnings.append(
            f"markers taken for breaks of the recording: {listed(_names(recording.named_breaks))}; "
            "acquire.event_map makes events of those that it names"
        )
    if recording.spans:
        seconds = sum(duration for _, duration, _ in recording.spans)
        recording.warnings.append(
            f"stretches taken for bad: {listed(_names(recording.spans))} ({seconds:.1f} s); "
            "acquire.event_map makes events of those that it names"
        )


def _names(marks: list[tuple[float, float, str]]) -> dict[str, int]:
    return histogram(pd.DataFrame({"event": [text for _, _, text in marks]}))


def _resolve(event_map: Mapping[str, str], have: Mapping[str, int], recording: Recording) -> dict[str, str]:
    """Return marker -> event name for the keys that fit; warn of those that do not."""
    names: dict[str, str] = {}
    keys: dict[str, str] = {}
    missing = []
    for key, event in event_map.items():
        fits = [key] if key in have else [name for name in have if _means(key, name)]
        if len(fits) > 1:
            raise ConfigError(
                f"acquire.event_map: {key!r} may be {' or '.join(map(repr, fits))}",
                cure=f"name the marker in full, such as {fits[0]!r}",
            )
        for marker in fits:
            if names.get(marker, event) != event:
                raise ConfigError(
                    f"acquire.event_map: {keys[marker]!r} = {names[marker]!r} and {key!r} = {event!r} mean one marker, "
                    f"{marker!r}",
                    cure="leave one of them out",
                )
            names[marker], keys[marker] = event, key
        if not fits:
            missing.append(key)
    spare = [name for name in have if name not in names]
    recording.absent = {key: _hint(key, spare) for key in missing}
    absent = ", ".join(f"{key!r}{hint}" for key, hint in recording.absent.items())
    if not names:
        raise ConfigError(
            f"acquire.event_map names markers that the recording does not have: {absent}; it has {listed(have)}",
            cure="correct acquire.event_map; hrcneuro acquire SUBJECT --inspect lists the markers",
        )
    guessed = {key: marker for marker, key in keys.items() if key != marker}
    if guessed:
        recording.notes.append("keys taken for markers: " + ", ".join(f"{k} = {m}" for k, m in guessed.items()))
    if missing:
        recording.warnings.append(f"markers of the map that do not occur: {absent}")
    return names


def _means(key: str, marker: str) -> bool:
    """Return whether a key is a marker's name but for blanks and, where the key has none, the kind of marker."""
    kind = next((prefix for prefix in _PREFIXES if key.startswith(prefix)), "")
    return marker.startswith(kind) and _short(marker) == _short(key)


def _hint(key: str, names: list[str]) -> str:
    same = [name for name in names if _short(name.rpartition("/")[2]) == _short(key)]
    return did_you_mean(same[0], same) if same else did_you_mean(key, names)


def _short(name: str) -> str:
    prefix = next((p for p in _PREFIXES if name.startswith(p)), "")
    return re.sub(r"\s+", "", name.removeprefix(prefix))
