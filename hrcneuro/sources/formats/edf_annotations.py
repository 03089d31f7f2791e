"""The annotations of EDF+ and BDF+: time-stamped lists in signals of their own (Kemp & Olivan 2003, section 2.2)."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.edf_header import Header
from hrcneuro.sources.formats.pieces import Pieces

_LIST = re.compile(rb"([+-]\d+(?:\.\d*)?)(?:\x15(\d*\.?\d*))?\x14")
# Times of records may be rounded to the millisecond.
_ROUNDING_S = 1e-3


@dataclass(frozen=True)
class Annotations:
    """What the annotation signals hold.

    Attributes:
        records_s: ndarray, shape (n_records,), when each record began, nan where it does not say.
        marks: (onset_s, duration_s, text) by the same clock.
        legacy: Whether texts were not UTF-8, as EDF+ wants them, and read as cp1252.
    """

    records_s: np.ndarray
    marks: list[tuple[float, float, str]]
    legacy: bool


def parse(header: Header, records: np.ndarray) -> Annotations:
    """Return the annotations of a file.

    Args:
        header: The file's.
        records: ndarray, shape (n_records, bytes a record), uint8.
    """
    starts = np.full(len(records), np.nan)
    marks: dict[tuple[float, float, str], None] = {}
    legacy = False
    for rank, signal in enumerate(header.annotations):
        for number, record in enumerate(records[:, header.columns(signal)]):
            for place, (onset, duration, texts) in enumerate(_lists(record.tobytes())):
                # The first list of a record's first annotation signal begins with an empty text: the record's own time.
                if rank == 0 and place == 0 and texts[:1] == [b""]:
                    starts[number] = onset
                for text in filter(None, texts):
                    plain, decoded = _decoded(text)
                    legacy |= not plain
                    marks[onset, duration, _without_channel(decoded, header.labels)] = None
    return Annotations(starts, list(marks), legacy)


def _lists(signal: bytes) -> list[tuple[float, float, list[bytes]]]:
    """Return (onset, duration, texts) of each list; zeros end a list and fill the rest of the record."""
    found = []
    for chunk in signal.split(b"\x00"):
        if head := _LIST.match(chunk):
            texts = chunk[head.end() :].split(b"\x14")
            found.append((float(head[1]), float(head[2] or 0), texts[:-1] if len(texts) > 1 else texts))
    return found


def _decoded(text: bytes) -> tuple[bool, str]:
    try:
        return True, text.decode("utf-8")
    except UnicodeDecodeError:
        return False, text.decode("cp1252", errors="replace")


def _without_channel(text: str, labels: tuple[str, ...]) -> str:
    """Return an annotation without the channel that EDFlib's convention ``text@@channel`` adds."""
    before, at, channel = text.rpartition("@@")
    return before if at and channel in labels else text


def pieces(header: Header, records_s: np.ndarray, *, each: int, sfreq: float, name: str) -> tuple[Pieces, list[str]]:
    """Return the stretches of records that follow each other without a gap, and notes; ``each`` samples a record.

    Times count from the first record. Every record keeps its own time, so that a recorder's clock that runs a little
    fast or slow moves no mark.

    Raises:
        DataError: A record begins before the one before it ends.
    """
    expected = np.arange(len(records_s)) * header.record_s
    starts = records_s - origin(records_s)
    for i in map(int, np.flatnonzero(~np.isfinite(starts))):
        starts[i] = starts[i - 1] + header.record_s if i else 0.0
    tolerance = max(0.5 / sfreq, _ROUNDING_S)
    late = np.diff(starts) - header.record_s
    if (late < -tolerance).any():
        at = int(np.argmax(late < -tolerance)) + 1
        raise DataError(
            f"{name}: record {at + 1} begins at {starts[at]:g} s, before record {at} ends "
            f"({starts[at - 1] + header.record_s:g} s): the clock went back",
            cure="split the file there into recordings of their own",
        )
    breaks = np.append(False, late > tolerance)
    samples = len(starts) * each
    if np.abs(starts - expected).max() <= _ROUNDING_S:
        return Pieces.whole(samples, sfreq), []
    found = Pieces(starts, np.arange(len(starts)) * each, breaks, samples, sfreq)
    if not breaks.any():
        return found, []
    gone = float(late[late > tolerance].sum())
    stated = "" if header.kind.endswith("D") else f", though the header calls it continuous ({header.kind})"
    return found, [
        f"{name} is in {int(breaks.sum()) + 1} pieces, {gone:g} s between them were not recorded{stated}: "
        "each is a break"
    ]


def origin(records_s: np.ndarray) -> float:
    """Return the time of the first sample by the annotations' clock: it may be a fraction of a second."""
    return float(records_s[0]) if np.isfinite(records_s[0]) else 0.0
