"""Neuroscan's ``.cnt`` (Scan 3 and 4), read by MNE.

MNE cannot always tell samples of 16 bits from those of 32, and takes every row of the table of events for an event.
Both are decided here, as EEGLAB's loadcnt and pop_loadcnt do. Layout: paulbourke.net/dataformats/eeg.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from hrcneuro.errors import DataError
from hrcneuro.sources import labels
from hrcneuro.sources.channels import standard_sites
from hrcneuro.sources.formats.pieces import Pieces
from hrcneuro.sources.formats.reading import marks_of, read_raw, sort_marks
from hrcneuro.sources.recording import Recording

if TYPE_CHECKING:
    import mne

_HEADER, _CHANNEL, _TABLE = 900, 75, 9
_ROWS = {1: 8, 2: 19, 3: 19}  # type of the table -> bytes of a row
_WIDE_AT = 52  # behind where the next file begins: 1 where samples have 32 bits
# The upper half of a row's byte of acceptance: 14 where time was lost, 11 where the amplifier was reset.
_BREAKS = {14: "time was lost", 11: "the amplifier was reset"}
_LARGE = 2_000_000_000  # bytes; the table's place is not to be trusted above


@dataclass(frozen=True)
class _Layout:
    channels: int
    bytes: int
    stated: bool
    breaks: tuple[tuple[int, str], ...]
    """First sample of each new segment, and why."""


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    layout = _layout(path)
    return read_raw(
        path,
        lambda: mne.io.read_raw_cnt(path, data_format=f"int{8 * layout.bytes}", preload=False, verbose="warning"),
        finish=lambda raw, recording: _finish(raw, recording, layout),
        dealt_with=("Could not parse meas date",),
    )


def _finish(raw: mne.io.BaseRaw, recording: Recording, layout: _Layout) -> None:
    """Give the recording its events, and breaks where the table says that the recording was interrupted."""
    recording.units = ["uV"] * len(recording.ch_names)
    known = labels.match(recording.ch_names, dict.fromkeys(standard_sites()))
    if 2 * len(known) >= len(recording.ch_names):
        # The header has places on a flat drawing, from which MNE guesses a sphere; names tell more.
        recording.montage = None
    if not layout.stated:
        recording.notes.append("how wide samples are is stated nowhere: taken for 16 bits, as older amplifiers write")
    marks = marks_of(raw)
    samples, sfreq = recording.data.shape[1], recording.sfreq
    for at, why in layout.breaks:
        # MNE places a row one sample before the one that it names.
        mine = [mark for mark in marks if round(mark[0] * sfreq) == max(at - 1, 0) and mark[2] == "0"]
        marks = [mark for mark in marks if mark not in mine[:1]]
        if 0 < at < samples:
            recording.notes.append(f"a break at {at / sfreq:.3f} s: {why}")
    firsts = sorted({0} | {at for at, _ in layout.breaks})
    sort_marks(recording, marks, Pieces.joined(firsts, samples, sfreq))


def _layout(path: Path) -> _Layout:
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEADER)
        if len(head) < _HEADER:
            raise DataError(f"{path.name} ends within its header: it is truncated", cure="copy the file again")
        channels, samples, table, later = (
            struct.unpack_from(form, head, at)[0] for form, at in (("<H", 370), ("<i", 864), ("<i", 886), ("<i", 12))
        )
        start = _HEADER + _CHANNEL * channels
        if not channels or (size < _LARGE and not start <= table <= size):
            raise DataError(
                f"{path.name} announces its table of events at byte {table}, it has {size} bytes: it is truncated",
                cure="copy or download the file again",
            )
        wide, stated = _width(file, (table - start) / channels, samples, later if 0 < later < size else 0)
        file.seek(table if size < _LARGE else start + samples * channels * wide)
        return _Layout(channels, wide, stated, _breaks(file.read(_TABLE), file.read(), start, channels, wide))


def _width(file: BinaryIO, each: float, samples: int, later: int) -> tuple[int, bool]:
    """Return the bytes of a sample, and whether the file states them.

    It does by the count of samples in its header, else by the file that follows in it.
    """
    if samples > 0 and each / samples in (2, 4):
        return int(each / samples), True
    file.seek(later + _WIDE_AT)
    word = file.read(1) if later else b""
    return (4 if word == b"\1" else 2), word in (b"\0", b"\1")


def _breaks(head: bytes, rows: bytes, start: int, channels: int, wide: int) -> tuple[tuple[int, str], ...]:
    if len(head) < _TABLE or head[0] not in _ROWS:
        return ()
    kind, size = head[0], min(struct.unpack_from("<i", head, 1)[0], len(rows))
    found = []
    for row in range(0, size - _ROWS[kind] + 1, _ROWS[kind]):
        accept, offset = rows[row + 3], struct.unpack_from("<i", rows, row + 4)[0]
        if why := _BREAKS.get(accept >> 4):
            found.append((offset if kind == 3 else (offset - start) // (channels * wide), why))
    return tuple(found)
