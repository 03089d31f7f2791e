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

from hrcneuro.eeg.latency import nearest
from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.live.transport import TRIGGER_TYPES
from hrcneuro.paradigm.markers import move_in
from hrcneuro.sources.formats import xdf
from hrcneuro.sources.formats.xdf_streams import NoSamples, choose_eeg, info, marker_streams, rate_of, recorded_gaps
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.triggers import triggers_of


@dataclass(frozen=True)
class Chain:
    """What the recordings of a subject tell.

    Attributes:
        moves: A row a marker: ``marker`` (its text), ``part``, ``marker_s`` (its stamp), ``edge_s`` (that of the sample
            with the trigger's edge), ``edge_sample``, ``end_s`` (that of the end point's edge); NaN for none. Stamps
            are on the recorder's clock, corrected by the measured differences of clocks.
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
        notes += said + more
        sfreq = rate_of(eeg)
        stamps = np.asarray(eeg["time_stamps"], float)
        streams, _ = recorded_gaps([one for one in streams if one is not eeg], stamps)
        texts, when = _moves(marker_streams(streams)[0])
        edges = _edges(eeg, _trigger(eeg, options.markers, path))
        found = {"marker": texts, "part": number, "marker_s": when}
        found |= _beside(when, edges, stamps, window_s, delay_s, "edge")
        if end:
            found |= _beside(when, _edges(eeg, _row(eeg, end, path)), stamps, window_s, delay_s, "end")
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


def _moves(streams: list[dict[str, Any]]) -> tuple[list[str], np.ndarray]:
    pairs = [
        (float(stamp), str(row[0]))
        for stream in streams
        for stamp, row in zip(stream["time_stamps"], stream["time_series"], strict=True)
        if move_in(str(row[0]))
    ]
    pairs.sort()
    return [text for _, text in pairs], np.array([stamp for stamp, _ in pairs])


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


def _edges(eeg: dict[str, Any], row: int) -> np.ndarray:
    """Return the samples at which a channel rises: of codes each trigger, of a voltage half its range."""
    if row < 0 or not len(eeg["time_series"]):
        return np.zeros(0, int)
    values = np.asarray(eeg["time_series"], float)[:, row]
    if np.array_equal(values, np.rint(values)) and np.abs(values).max() < 2**31:
        return triggers_of(values.astype(np.int64), "", ()).samples
    low, high = np.percentile(values, (1, 99.9))
    above = values > (low + high) / 2
    return np.flatnonzero(above[1:] & ~above[:-1]) + 1
