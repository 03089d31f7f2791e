"""Which stream of an XDF file is the EEG, which are markers."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from hrcneuro.eeg import stamps as stamps_of
from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.live.transport import DECISIONS, MARKER_TYPES, RECORDER

_EEG_TYPES = frozenset({"eeg", "exg"})

_GAP = re.compile(r"gap/stream=.*/samples=(\d+)/")
_RATE = 1e-3  # by this share a clock does not run wrong
_NEAR_S = 0.1  # measured differences of clocks do not waver by so much

Stream = dict[str, Any]


class NoSamples(DataError):
    """A file holds no sample of the EEG: its recorder was ended in its first instant, or nothing was sent."""


def info(stream: Stream, key: str) -> str:
    """Return a field of a stream's header, empty where it has none."""
    return str((stream["info"].get(key) or [""])[0] or "")


def rate_of(stream: Stream) -> float:
    """Return the nominal sampling rate in Hz, 0 for an irregular stream."""
    return float(info(stream, "nominal_srate") or 0)


def is_text(stream: Stream) -> bool:
    """Return whether a stream carries text: markers, whatever it calls itself."""
    return info(stream, "channel_format") == "string"


def marker_streams(streams: list[Stream]) -> tuple[list[Stream], list[Stream]]:
    """Return the streams that carry markers, and all others; what the closed loop decides marks no event."""
    marks, left = [], []
    for stream in streams:
        if info(stream, "name") == DECISIONS:
            left.append(stream)
        elif is_text(stream) or (rate_of(stream) == 0 and info(stream, "type").lower() in MARKER_TYPES):
            marks.append(stream)
        else:
            left.append(stream)
    return marks, left


def in_order(stream: Stream) -> Stream:
    """Return a stream whose chunks that came behind younger ones are put in their places."""
    stamps = np.asarray(stream["time_stamps"], float)
    order = stamps_of.in_order(stamps, rate_of(stream))
    if (np.diff(order) == 1).all():
        return stream
    return {**stream, "time_stamps": stamps[order], "time_series": np.asarray(stream["time_series"])[order]}


def recorded_gaps(streams: list[Stream], stamps: np.ndarray) -> tuple[list[Stream], list[int]]:
    """Return the streams without hrcneuro's recorder's own, and the first samples after gaps that it has marked.

    Args:
        streams: All of a file.
        stamps: ndarray, shape (n_samples,), of the EEG, on the recorder's clock, s.
    """
    own = [s for s in streams if info(s, "source_id") == RECORDER and is_text(s)]
    marks = [
        (float(when), int(mark[1])) for s in own for when, row in zip(s["time_stamps"], s["time_series"], strict=True)
        if (mark := _GAP.match(str(row[0])))
    ]  # fmt: skip
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if len(steps) else 0.0
    wide = np.flatnonzero(steps > 1.5 * usual)
    found = [_gap_of(when, samples, stamps, steps, wide, usual) for when, samples in marks]
    return [s for s in streams if not any(s is one for one in own)], sorted({at for at in found if at is not None})


def _gap_of(
    when: float, samples: int, stamps: np.ndarray, steps: np.ndarray, wide: np.ndarray, usual: float
) -> int | None:
    """Return the first sample behind a gap that is marked; None where the marked stream is another one.

    A mark bears the stamp of the last sample before its gap, by the difference of the clocks that was measured last.
    The stamps were corrected by all that were measured, which may be milliseconds off that one: of the wide steps near
    the mark it is the one as long as the mark says.
    """
    as_long = np.abs(steps[wide] / usual - 1 - samples) <= max(1.0, _RATE * samples)
    near = wide[as_long & (np.abs(stamps[wide] - when) <= _NEAR_S)]
    return int(near[np.argmin(np.abs(stamps[near] - when))]) + 1 if len(near) else None


def choose_eeg(streams: list[Stream], wanted: str, file: str) -> tuple[Stream, list[str]]:
    """Return the EEG stream and what is to be said of the choice.

    Args:
        streams: All of a file, in its order.
        wanted: Its name, ``name#2`` for the second of that name, or its source id; empty to take the only one.
        file: Name of the file, for messages.

    Raises:
        ConfigError: Several streams fit, or none; each is described.
        NoSamples: There is none with samples.
    """
    signals = [s for s in streams if not is_text(s)]
    if wanted:
        return _wanted(signals, wanted, file), []
    typed = [s for s in signals if info(s, "type").lower() in _EEG_TYPES]
    full = [s for s in typed if len(s["time_stamps"]) > 1]
    if typed and not full:
        raise NoSamples(
            f"{file}: the EEG stream has no samples: {_listed(typed)}",
            cure="copy the file again, in case it is cut off",
        )
    notes = [f"stream {info(s, 'name')!r} of type EEG has no samples" for s in typed if s not in full]
    if not typed:
        full = [s for s in signals if rate_of(s) > 0 and len(s["time_stamps"]) > 1]
        notes += [f"stream {info(s, 'name')!r} of type {info(s, 'type')!r} taken for the EEG" for s in full[:1]]
    if not full:
        raise NoSamples(
            f"{file} holds no regularly sampled stream; it has {_listed(streams)}", cure="record the EEG stream too"
        )
    if len(full) > 1:
        raise ConfigError(
            f"{file} holds {len(full)} streams that may be the EEG: {_listed(full, among=signals)}",
            cure=f"name one: acquire.stream = {_handle(full[0], signals)!r}",
        )
    return full[0], notes


def left_aside(chosen: Stream, streams: list[Stream]) -> list[str]:
    """Return what a person should know of other EEG with samples in the file: it is not read.

    Args:
        chosen: The EEG stream that is read.
        streams: All of the file, that one among them.
    """
    signals = [s for s in streams if not is_text(s)]
    others = [
        s for s in signals if s is not chosen and info(s, "type").lower() in _EEG_TYPES and len(s["time_stamps"]) > 1
    ]
    return [
        f"left aside: stream {_handle(s, signals)!r} ({_about(s)}): acquire.stream chose {_handle(chosen, signals)!r}"
        for s in others
    ]


def _wanted(signals: list[Stream], wanted: str, file: str) -> Stream:
    hits = [s for s in signals if wanted in (info(s, "name"), info(s, "source_id"), _handle(s, signals))]
    if not any(len(s["time_stamps"]) > 1 for s in signals):
        raise NoSamples(
            f"{file} holds no samples of stream {wanted!r}, nor of any other signal; it has "
            f"{_listed(signals) or 'none'}",
            cure="record the EEG stream too",
        )
    if not hits:
        names = [_handle(s, signals) for s in signals]
        raise ConfigError(
            f"{file} has no regular stream {wanted!r}{did_you_mean(wanted, names)}; it has "
            f"{_listed(signals) or 'none'}",
            cure="correct acquire.stream",
        )
    if len(hits) > 1:
        raise ConfigError(
            f"{file} has {len(hits)} streams that acquire.stream = {wanted!r} fits: {_listed(hits, among=signals)}",
            cure=f"name one: acquire.stream = {_handle(hits[0], signals)!r}",
        )
    if len(hits[0]["time_stamps"]) < 2:
        raise NoSamples(f"{file}: stream {wanted!r} has no samples", cure="name another: acquire.stream")
    return hits[0]


def _handle(stream: Stream, among: list[Stream]) -> str:
    """Return a name that only this stream has: its own, with its number where others share it."""
    name = info(stream, "name")
    alike = [s for s in among if info(s, "name") == name]
    number = next(i for i, s in enumerate(alike, start=1) if s is stream)
    return name if len(alike) == 1 else f"{name}#{number}"


def _listed(streams: list[Stream], *, among: list[Stream] | None = None) -> str:
    return ", ".join(f"{_handle(s, among or streams)} ({_about(s)})" for s in streams)


def _about(stream: Stream) -> str:
    facts = [info(stream, "type"), f"{info(stream, 'channel_count')} channels", f"{rate_of(stream):g} Hz"]
    facts += [f"{key.replace('_', ' ')} {info(stream, key)}" for key in ("source_id", "hostname") if info(stream, key)]
    return ", ".join([*filter(None, facts), f"{len(stream['time_stamps'])} samples"])
