"""ANT Neuro's ``.cnt`` (eego, EEProbe), read by MNE and ANT's own library antio."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.extras import needed
from hrcneuro.sources.formats.pieces import Pieces
from hrcneuro.sources.formats.reading import marks_of, read_raw, sort_marks
from hrcneuro.sources.recording import Recording, some

if TYPE_CHECKING:
    import mne

# ANT's own export writes a new segment where the file has this code.
_NEW_SEGMENT = "__"
_OFF, _ON = "BAD_disconnection", "Amplifier reconnected"


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    needed("antio", "ANT's .cnt")
    _check_size(path)
    return read_raw(path, lambda: mne.io.read_raw_ant(path, preload=False, verbose="warning"), finish=_finish)


def _check_size(path: Path) -> None:
    with path.open("rb") as file:
        head = file.read(12)
    wide = head[:4] == b"RF64"
    size = struct.unpack("<Q" if wide else "<I", head[4 : 12 if wide else 8])[0] + (12 if wide else 8)
    if path.stat().st_size < size:
        raise DataError(
            f"{path.name} announces {size} bytes, it holds {path.stat().st_size}: it is truncated",
            cure="copy or download the file again",
        )


def _finish(raw: mne.io.BaseRaw, recording: Recording) -> None:
    """Give the recording its marks, and a break where a segment begins or the amplifier came back."""
    recording.units = ["uV"] * len(recording.ch_names)
    marks = marks_of(raw)
    breaks = {at for at, _, text in marks if text in (_NEW_SEGMENT, _ON)}
    breaks |= {at + duration for at, duration, text in marks if text == _OFF}
    firsts = sorted({0} | {round(at * recording.sfreq) for at in breaks})
    kept = [mark for mark in marks if mark[2] != _NEW_SEGMENT]
    sort_marks(recording, kept, Pieces.joined(firsts, recording.data.shape[1], recording.sfreq))
    if spare := [recording.ch_names[i] for i in recording.picks("misc")]:
        recording.notes.append(f"inputs for anything, taken for misc: {some(spare)} (acquire.channel_types)")
