"""The samples of a FIF artifact, read straight from its data tags.

MNE's readers keep up to four copies of the epochs in memory on the way and take a call a second of recording. A file
as :mod:`hrcneuro.io.fif` writes it holds its samples in single precision, uncalibrated and one after the other; any
other one goes through MNE.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import mne
    from numpy.typing import NDArray

_HEADER = struct.Struct(">iIii")
_DATA_BUFFER, _DATA_SKIP, _EPOCH = 300, 301, 302
_FLOAT, _MATRIX = 4, 1 << 30
_MATRIX_FOOT = 16  # a matrix is followed by its three lengths and their number


class Tag(NamedTuple):
    """A piece of a FIF file: what it is, of which type, its bytes' number, and where they begin."""

    kind: int
    type: int
    size: int
    start: int


def tags(file: BinaryIO) -> Iterator[Tag]:
    """Yield the tags of an open FIF file in their order; the file stands at a tag's bytes while it is looked at."""
    at = 0
    while True:
        file.seek(at)
        header = file.read(_HEADER.size)
        if len(header) < _HEADER.size:
            return
        kind, form, size, following = _HEADER.unpack(header)
        yield Tag(kind, form, size, at + _HEADER.size)
        if following < 0:
            return
        at = following if following > 0 else at + _HEADER.size + size


def of_raw(raw: mne.io.BaseRaw, picks: Sequence[int], scale: float = 1.0) -> NDArray[np.float64]:
    """Return ``scale * raw.get_data(picks)`` of a recording that was just read, shape (len(picks), n_times)."""
    values = None if raw.preload or len(raw.filenames) != 1 else _raw_samples(Path(raw.filenames[0]), raw, picks, scale)
    return scale * raw.get_data(picks=list(picks)) if values is None else values


def of_epochs(
    epochs: mne.BaseEpochs, path: Path, picks: Sequence[int], dtype: type[np.floating] = np.float64
) -> NDArray[np.floating]:
    """Return the samples of epochs whose headers were read from ``path``, in microvolt.

    Args:
        epochs: Read without preloading, nothing dropped.
        path: Where from.
        picks: The channels, by their rows.
        dtype: ``float64`` or ``float32``; the products with 10⁶ are rounded to it.

    Returns:
        ndarray, shape (n_epochs, len(picks), n_times), µV.
    """
    values = _epoch_samples(path, epochs, picks, dtype)
    if values is None:
        values = (epochs.get_data(picks=list(picks), verbose="error") * 1e6).astype(dtype)
    return values


def _raw_samples(path: Path, raw: mne.io.BaseRaw, picks: Sequence[int], scale: float) -> NDArray[np.float64] | None:
    channels = raw.info["chs"]
    with path.open("rb") as file:
        data = [tag for tag in tags(file) if tag.kind in (_DATA_BUFFER, _DATA_SKIP)]
        whole = sum(tag.size for tag in data) == raw.n_times * len(channels) * 4
        if not whole or any(tag.kind != _DATA_BUFFER or tag.type != _FLOAT for tag in data):
            return None
        out, at = np.empty((len(picks), raw.n_times)), 0
        for tag in data:
            file.seek(tag.start)
            block = np.fromfile(file, ">f4", tag.size // 4).reshape(-1, len(channels)).astype(np.float32)
            # Transposed in single precision first: the long rows are then filled in one go.
            np.multiply(np.ascontiguousarray(block.T[picks]), scale, out=out[:, at : at + len(block)], dtype=float)
            at += len(block)
    for row, pick in zip(out, picks, strict=True):
        gain = channels[pick]["cal"] * channels[pick]["range"]
        if gain != 1:
            row *= gain
    return out


def _epoch_samples(
    path: Path, epochs: mne.BaseEpochs, picks: Sequence[int], dtype: type[np.floating]
) -> NDArray[np.floating] | None:
    channels = epochs.info["chs"]
    shape = len(epochs.events), len(channels), len(epochs.times)
    calibrated = any(channel["cal"] * channel.get("scale", 1.0) != 1 for channel in channels)
    with path.open("rb") as file:
        data = [tag for tag in tags(file) if tag.kind == _EPOCH]
        if len(data) != 1 or data[0].type != _FLOAT | _MATRIX or calibrated:
            return None
        if data[0].size != 4 * int(np.prod(shape)) + _MATRIX_FOOT:
            return None
        file.seek(data[0].start)
        out = np.empty((shape[0], len(picks), shape[2]), dtype)
        for one in out:
            volts = np.fromfile(file, ">f4", shape[1] * shape[2]).reshape(shape[1:])
            np.multiply(volts[picks], 1e6, out=one, dtype=dtype)
    return out
