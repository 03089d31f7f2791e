"""What a recorded session tells of its own timing: each move's marker, trigger edge and end point, as stamped.

Unlike :mod:`hrcneuro.sources.sessions`, which brings everything onto the samples, this leaves the stamps as they came:
how they waver is what is asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.eeg.edges import rising
from hrcneuro.eeg.latency import nearest
from hrcneuro.eeg.stamps import segments
from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.live.transport import TRIGGER_TYPES
from hrcneuro.paradigm.markers import move_in
from hrcneuro.sources.formats import xdf
from hrcneuro.sources.formats.xdf_streams import (
    NoSamples,
    choose_eeg,
    in_order,
    info,
    left_aside,
    marker_streams,
    rate_of,
    recorded_gaps,
)  # fmt: skip
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.triggers import triggers_of

_FEW_CODES = 16


@dataclass(frozen=True)
class Chain:
    """What the recordings of a subject tell.

    Attributes:
        moves: A row a marker: ``marker`` (its text), ``part``, ``marker_s`` (its stamp), ``sent_s`` (the same on its
            sender's clock), ``edge_s`` (the stamp of the sample with the trigger's edge), ``edge_sample``,
            ``segment`` (of the samples without a gap, the one that holds it), ``end_s`` (that of the end point's
            edge); NaN for none. Stamps but ``sent_s`` are on the recorder's clock, corrected by the measured
            differences of clocks.
        sfreq: Nominal rate of the EEG, Hz.
        notes: What a person may want to know of the reading.
    """

    moves: pd.DataFrame
    sfreq: float
    notes: list[str] = field(default_factory=list)


def read_chain(parts: Sequence[Path], options: Source, *, window_s: float, delay_s: float, end: str = "") -> Chain:
    """Return what the parts of recordings tell of their timing.

    Args:
        parts: XDF files.
        options: Which stream is the EEG, which channel the trigger.
        window_s: How far an edge may be from its marker.
        delay_s: How much later it is expected.
        end: Name of a channel that sees the event itself, a photodiode or a loop-back line; empty for none.

    Raises:
        DataError: A part cannot be read, or there are no markers of moves.
        ConfigError: There is no such channel.
    """
    tables, notes, sfreq, empty = [], list[str](), 0.0, list[NoSamples]()
    for number, path in enumerate(parts, start=1):
        try:
            streams, said = xdf.load(path)
            eeg, more = choose_eeg(streams, options.stream, path.name)
        except NoSamples as error:
            # A recorder that is ended in its first instant leaves such a part.
            notes.append(f"left out, without EEG: {error.problem}")
            empty.append(error)
            continue
        notes += said + more + left_aside(eeg, streams)
        sfreq = rate_of(eeg)
        streams, eeg = [one for one in streams if one is not eeg], in_order(eeg)
        stamps = np.asarray(eeg["time_stamps"], float)
        streams, gaps = recorded_gaps(streams, stamps)
        starts = [start for start, _ in segments(stamps, sfreq or 1 / float(np.median(np.diff(stamps))), gaps)]
        texts, when, sent = _moves(marker_streams(streams)[0], path)
        edges = _edges(eeg, _trigger(eeg, options.markers, path), starts)
        found: dict[str, Any] = {"marker": texts, "part": number, "marker_s": when, "sent_s": sent}
        found |= _beside(when, edges, stamps, window_s, delay_s, "edge")
        found["segment"] = np.searchsorted(starts, found["edge_sample"], side="right")
        if end:
            found |= _beside(when, _edges(eeg, _row(eeg, end, path), starts), stamps, window_s, delay_s, "end")
        tables.append(pd.DataFrame(found))
    if empty and not tables:
        raise empty[0]
    moves = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
    if moves.empty:
        raise DataError(
            f"no markers of moves in {', '.join(path.name for path in parts) or 'any recording'}",
            cure="record the stream hrcneuro-moves, which 'hrcneuro robot --lsl' sends, with the EEG",
        )
    return Chain(moves, sfreq, notes)


def _moves(streams: list[dict[str, Any]], path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Return text, stamp and stamp on the sender's clock of each marker of a move, by time."""
    ids = [stream["info"]["stream_id"] for stream in streams]
    as_sent = {one["info"]["stream_id"]: one["time_stamps"] for one in xdf.as_sent(path, ids)} if ids else {}
    rows = [
        (float(stamp), float(sent), str(row[0]))
        for stream, number in zip(streams, ids, strict=True)
        for stamp, sent, row in zip(stream["time_stamps"], as_sent[number], stream["time_series"], strict=True)
        if move_in(str(row[0]))
    ]
    rows.sort()
    return [text for *_, text in rows], np.array([one[0] for one in rows]), np.array([one[1] for one in rows])


def _beside(
    when: np.ndarray, edges: np.ndarray, stamps: np.ndarray, window: float, expected: float, name: str
) -> dict[str, np.ndarray]:
    at = nearest(when, stamps[edges], window=window, expected=expected)
    known = at >= 0
    sample = np.where(known, edges[at], -1) if len(edges) else np.full(len(when), -1)
    return {
        f"{name}_s": np.where(known, stamps[sample], np.nan) if len(stamps) else np.full(len(when), np.nan),
        f"{name}_sample": np.where(known, sample, np.nan),
    }


def _trigger(eeg: dict[str, Any], wanted: str, path: Path) -> int:
    """Return the row of the trigger channel; -1 for none."""
    if wanted not in ("auto", "channel", "annotations"):
        return _row(eeg, wanted, path)
    about = xdf.channels(eeg)
    rows = [i for i, one in enumerate(about) if one.get("type", "").lower() in TRIGGER_TYPES]
    return rows[0] if rows and wanted != "annotations" else -1


def _row(eeg: dict[str, Any], name: str, path: Path) -> int:
    labels = [one.get("label", "") for one in xdf.channels(eeg)]
    if name not in labels:
        raise ConfigError(
            f"stream {info(eeg, 'name')!r} of {path.name} has no channel {name!r}{did_you_mean(name, labels)}",
            cure=f"name one of its {len(labels)} channels: {', '.join(labels) or 'it names none'}",
        )
    return labels.index(name)


def _edges(eeg: dict[str, Any], row: int, starts: Sequence[int] = (0,)) -> np.ndarray:
    """Return the samples at which a channel rises: of codes each trigger, of a voltage half its range.

    Args:
        eeg: The stream.
        row: The channel's; below 0 for none.
        starts: First samples of the segments.
    """
    if row < 0 or not len(eeg["time_series"]):
        return np.zeros(0, int)
    values = np.asarray(eeg["time_series"], float)[:, row]
    if np.array_equal(values, np.rint(values)) and np.abs(values).max() < 2**31 and _are_codes(eeg, row, values):
        return triggers_of(values.astype(np.int64), "", list(starts)).samples
    return rising(values, rate_of(eeg) or 1 / float(np.median(np.diff(eeg["time_stamps"]))), starts)


def _are_codes(eeg: dict[str, Any], row: int, values: np.ndarray) -> bool:
    """Return whether whole numbers are codes: by the channel's type, or as they are few; a converter counts, too."""
    about = xdf.channels(eeg)
    kind = about[row].get("type", "").lower() if row < len(about) else ""
    return kind in TRIGGER_TYPES or len(np.unique(values)) <= _FEW_CODES
