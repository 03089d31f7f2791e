"""EEGLAB: a MATLAB file (``.set``), its samples inside or in a ``.fdt`` beside it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.pointers import refuse_pointer
from hrcneuro.sources.recording import Recording

if TYPE_CHECKING:
    import mne

_VALUE_BYTES = 4


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    return read_raw(path, lambda: _open(path))


def _open(path: Path) -> mne.io.BaseRaw:
    import mne

    raw = mne.io.read_raw_eeglab(path, preload=False, verbose="warning")
    _check_size(raw, path)
    return raw


def _check_size(raw: mne.io.BaseRaw, path: Path) -> None:
    """Refuse a data file whose size contradicts the header."""
    data = Path(raw.filenames[0])
    if data.suffix.lower() != ".fdt":
        return
    refuse_pointer(data)
    samples, channels = len(raw.times), len(raw.ch_names)
    wanted, got = samples * channels * _VALUE_BYTES, data.stat().st_size
    if got != wanted:
        raise DataError(
            f"{data.name} has {got} bytes; {path.name} announces {channels} channels × {samples} samples × "
            f"{_VALUE_BYTES} bytes = {wanted}: it is {'truncated' if got < wanted else 'too long'}",
            cure="copy or download both files again; they must come from the same saving",
        )
