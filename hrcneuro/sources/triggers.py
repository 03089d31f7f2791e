"""Markers from trigger channels, and the choice between them and annotations."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.sources.matching import listed
from hrcneuro.sources.recording import Recording, markers_of

# In the order in which MNE looks for them.
_KNOWN = ("STI101", "STI 101", "STI201", "STI 201", "STI 014", "STI014", "STATUS", "TRIGGER")
_LINE = re.compile(r"STI ?0?(\d\d?)", re.IGNORECASE)
_LINES = 16
# A code that holds for one or two samples beside another is a step towards it or back: the lines of a port do not
# switch at one instant.
_STEP_SAMPLES = 2
# A line that is pulled up rests at its value for this share of the time; a code that is held does not.
_REST_SHARE = 0.9
_ZERO = np.iinfo(np.int64).min


@dataclass(frozen=True)
class Triggers:
    """What a trigger channel holds: the sample and the code of each trigger, and notes on how they were read."""

    name: str
    samples: np.ndarray
    codes: np.ndarray
    notes: list[str]


def choose_markers(recording: Recording, source: str = "auto", *, mask: int = 0) -> None:
    """Give a recording its markers: its annotations, or the triggers of a channel.

    ``auto`` takes the annotations, unless there are none, or none of them occurs twice while a trigger channel has
    triggers: then they are remarks. What is left aside is said in a note.

    Args:
        recording: Its markers are the annotations beforehand.
        source: ``auto``, ``annotations``, ``channel``, or the name of a trigger channel, here or in the file.
        mask: The bits of a channel's value that count; 0 for all.

    Raises:
        ConfigError: There is no such channel, or several channels have triggers and none has a known name.
    """
    if source == "annotations":
        return
    if source not in ("auto", "channel"):
        _take(recording, _read(recording, [_named(recording, source)], source, mask=mask))
        return
    found = _candidates(recording, mask)
    if not found and source == "channel":
        raise ConfigError(
            f"acquire.markers = 'channel', and the recording has no trigger channel: {_kinds(recording)}",
            cure="name it in acquire.channel_types = {NAME = 'stim'}, or set acquire.markers = 'annotations'",
        )
    if found and (source == "channel" or _remarks_only(recording.markers["event"], found)):
        _take(recording, _only(found))
        return
    for one in (one for one in found if len(one.samples)):
        recording.notes.append(
            f"trigger channel {one.name} left aside: {_histogram(one.codes)}; "
            f"acquire.markers = '{'channel' if len(found) == 1 else one.name}' takes it instead of the annotations"
        )


def of_channel(recording: Recording, source: str = "auto", *, mask: int = 0) -> Triggers:
    """Return the triggers of a recording's trigger channel: the only one that has any, or the one that is named.

    Args:
        recording: With at least one trigger channel.
        source: ``auto``, ``channel``, or the channel's name, here or in the file.
        mask: The bits of its value that count; 0 for all.

    Raises:
        ConfigError: There is no such channel, or several have triggers and none has a known name.
    """
    if source not in ("auto", "channel"):
        return _read(recording, [_named(recording, source)], source, mask=mask)
    return _only(_candidates(recording, mask))


def _remarks_only(annotations: pd.Series, found: list[Triggers]) -> bool:
    """Return whether annotations are none, or remarks beside one channel's triggers: no text comes twice."""
    if annotations.empty:
        return True
    return not annotations.duplicated().any() and len(found) == 1 and len(found[0].samples) > 0


def _take(recording: Recording, triggers: Triggers) -> None:
    aside = Counter(recording.markers["event"])
    recording.markers = markers_of(triggers.samples / recording.sfreq, [_text(code) for code in triggers.codes])
    recording.notes.append(f"markers taken from the trigger channel {triggers.name}")
    recording.notes += triggers.notes
    if len(aside):
        recording.notes.append(
            f"annotations left aside: {listed(aside)}; acquire.markers = 'annotations' takes them instead"
        )


def _candidates(recording: Recording, mask: int) -> list[Triggers]:
    """Return the triggers of the channels that may hold whole codes: one of a known name, else all."""
    stim = recording.picks("stim")
    names = {recording.ch_names[i].upper(): i for i in stim}
    known = [names[name] for name in _KNOWN if name in names]
    read = [_read(recording, [i], recording.ch_names[i], mask=mask) for i in known]
    if read:
        best = next((one for one in read if len(one.samples)), read[0])
        aside = [one.name for one in read if one is not best and len(one.samples)]
        if aside:
            best.notes.append(f"other trigger channels left aside: {', '.join(aside)}")
        if len(best.samples):
            return [best]
    lines = {int(hit[1]): i for i in stim if (hit := _LINE.fullmatch(recording.ch_names[i])) and int(hit[1]) <= _LINES}
    lines = {bit: i for bit, i in lines.items() if recording.ch_names[i].upper() not in _KNOWN}
    if len(lines) > 1 and all(_is_line(recording.data[i]) for i in lines.values()):
        name = f"{recording.ch_names[min(lines.values())]} … (bits of one code)"
        together = _read(recording, [lines[bit] for bit in sorted(lines)], name, bits=sorted(lines), mask=mask)
        if len(together.samples):
            return [together]
    rest = [i for i in stim if i not in lines.values() and recording.ch_names[i].upper() not in _KNOWN]
    others = [_read(recording, [i], recording.ch_names[i], mask=mask) for i in rest]
    used = [one for one in others if len(one.samples)]
    return used or read[:1] or others[:1]


def _only(found: list[Triggers]) -> Triggers:
    if len(found) > 1:
        listed = "; ".join(f"{one.name}: {_histogram(one.codes)}" for one in found)
        raise ConfigError(
            f"several trigger channels hold triggers: {listed}", cure=f"name one: acquire.markers = {found[0].name!r}"
        )
    return found[0]


def _named(recording: Recording, name: str) -> int:
    here = {old: new for new, old in recording.file_names.items()}.get(name, name)
    stim = [recording.ch_names[i] for i in recording.picks("stim")]
    if here not in stim:
        raise ConfigError(
            f"acquire.markers = {name!r}{did_you_mean(name, [*stim, 'auto', 'annotations', 'channel'])}; allowed: "
            f"auto, annotations, channel, or a trigger channel: {', '.join(stim) or 'there is none'}",
            cure="correct acquire.markers; a channel of another type needs acquire.channel_types = {NAME = 'stim'}",
        )
    return recording.ch_names.index(here)


def _kinds(recording: Recording) -> str:
    return ", ".join(f"{recording.ch_names[i]} ({recording.ch_types[i]})" for i in range(len(recording.ch_names)))


def _is_line(row: np.ndarray) -> bool:
    return len(np.unique(np.rint(np.nan_to_num(row)))) <= 2


def _read(recording: Recording, rows: list[int], name: str, *, mask: int, bits: list[int] | None = None) -> Triggers:
    """Return the triggers of a channel, or of lines that are the bits of one code; bits count from 1."""
    values = np.rint(np.nan_to_num(recording.data[rows])).astype(np.int64)
    if bits is not None:
        weights = np.left_shift(1, np.asarray(bits, np.int64) - 1)
        values = ((values > values.min(axis=1, keepdims=True)) * weights[:, None]).sum(axis=0, keepdims=True)
    joins = [round(at * recording.sfreq) for at in recording.breaks_s]
    return triggers_of(values[0] & mask if mask else values[0], name, joins)


def triggers_of(values: np.ndarray, name: str, joins: Sequence[int] = ()) -> Triggers:
    """Return the triggers in a channel's values: every change to another code that is not the rest value.

    Args:
        values: ndarray, shape (n_times,), int.
        name: The channel's, for notes.
        joins: Samples at which the recording goes on after a break.
    """
    notes: list[str] = []
    codes = _from_rest(values, name, notes)
    starts = np.flatnonzero(np.append(True, codes[1:] != codes[:-1])) if len(codes) else np.zeros(0, int)
    runs = [(int(start), int(codes[start])) for start in starts]
    lengths = np.diff(np.append(starts, len(codes)))
    runs, lengths = _without_dips(runs, lengths, name, notes)
    runs = _settled(runs, lengths, name, notes)
    # What holds at the first sample began before the recording did, or went on.
    firsts = {0, *joins}
    kept = [(start, code) for start, code in runs if code != 0 and start not in firsts]
    if early := [code for start, code in runs if code != 0 and start in firsts]:
        notes.append(f"{name} holds a code where a segment begins, which is left out: {_histogram(np.array(early))}")
    return Triggers(name, np.array([s for s, _ in kept], int), np.array([c for _, c in kept], np.int64), notes)


def _from_rest(values: np.ndarray, name: str, notes: list[str]) -> np.ndarray:
    """Return the codes with 0 where the channel rests: at 0, or at what every trigger leaves and comes back to."""
    if not len(values):
        return values
    levels, counts = np.unique(values, return_counts=True)
    rest = int(levels[counts.argmax()])
    starts = np.flatnonzero(np.append(True, values[1:] != values[:-1]))
    # Steps do not count: a trigger comes back to rest through them.
    held = (np.diff(np.append(starts, len(values))) > _STEP_SAMPLES) | (values[starts] == rest)
    visited = values[starts[held]]
    alternates = 2 * (visited == rest).sum() >= len(visited) - 1
    if rest == 0 or len(levels) == 1 or not alternates or counts.max() < _REST_SHARE * len(values):
        return values
    notes.append(f"{name} rests at {rest}, not at 0: a trigger is what differs from {rest}")
    if 0 in levels:
        notes.append(f"{name}: a fall to 0 is trigger 'zero'")
    return np.where(values == rest, 0, np.where(values == 0, _ZERO, values))


def _without_dips(
    runs: list[tuple[int, int]], lengths: np.ndarray, name: str, notes: list[str]
) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Join a code that falls to rest for a sample or two and comes back: one trigger, not two."""
    joined: list[tuple[int, int]] = []
    sizes: list[int] = []
    dips = 0
    for (start, code), size in zip(runs, lengths, strict=True):
        held = len(joined) > 1 and joined[-1][1] == 0 and sizes[-1] <= _STEP_SAMPLES and joined[-2][1] == code
        if held and sizes[-2] > _STEP_SAMPLES and size > _STEP_SAMPLES:
            dips += 1
            sizes[-2:] = [sizes[-2] + sizes[-1] + int(size)]
            joined.pop()
        else:
            joined.append((start, code))
            sizes.append(int(size))
    if dips:
        notes.append(f"{name} falls to rest for one or two samples within a trigger {dips} times: each is one trigger")
    return joined, np.array(sizes, int)


def _settled(runs: list[tuple[int, int]], lengths: np.ndarray, name: str, notes: list[str]) -> list[tuple[int, int]]:
    """Leave out codes that hold for a sample or two beside one that holds longer: steps on the way to it, or back.

    Where codes follow each other without rest and none holds longer, the last is the settled one.
    """
    kept: list[tuple[int, int]] = []
    steps: list[int] = []
    block: list[tuple[tuple[int, int], int]] = []
    for run, size in [*zip(runs, lengths.tolist(), strict=True), ((0, 0), 0)]:
        if run[1] != 0:
            block.append((run, size))
            continue
        long = [one for one, size_ in block if size_ > _STEP_SAMPLES] or [one for one, _ in block[-1:]]
        steps += [one[1] for one, _ in block if one not in long]
        # A step between two stretches of one code is a flicker of it.
        kept += [one for i, one in enumerate(long) if i == 0 or long[i - 1][1] != one[1]]
        kept.append(run)
        block = []
    if steps:
        notes.append(
            f"{name}: codes that hold for one or two samples beside another are steps of one trigger: "
            f"{_histogram(np.array(steps))}"
        )
    return kept[:-1]


def _text(code: int) -> str:
    return "zero" if code == _ZERO else str(code)


def _histogram(codes: np.ndarray) -> str:
    values, counts = np.unique(codes, return_counts=True)
    listed = [f"{_text(value)} × {count}" for value, count in zip(values, counts, strict=True)]
    return ", ".join(listed[:8]) + (f" … ({len(listed)} codes)" if len(listed) > 8 else "")
