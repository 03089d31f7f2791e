"""FIF artifacts: raw, epochs and evokeds, written so that the same data give the same bytes."""

from __future__ import annotations

import contextlib
import struct
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.io import samples

if TYPE_CHECKING:
    import mne
    from numpy.typing import NDArray

# Tags that hold a machine id and the time of writing: file, block, parent and reference ids.
_ID_TAGS = frozenset({100, 103, 108, 109, 110, 116, 117, 118, 120})
# An id: version, machine (two words), seconds, microseconds; these microseconds are MNE's sign for "no date".
_BLANK_ID = bytes(16) + struct.pack(">i", 2**31 - 1)

# Scalp EEG spreads less than 10 mV; read as volts, its microvolts are a million times above. As recorded it spreads
# more than 0.1 µV, amplifier noise alone does. Filters may leave a part of that, but no thousandth.
_HIGH_V = 1e-2
RECORDED_V = 1e-7
_LOW_V = 1e-9


def write_raw(raw: mne.io.BaseRaw, path: Path) -> None:
    """Write a continuous recording in single precision (volts), with the file's identity blanked."""
    with _quiet():
        raw.save(path, fmt="single", overwrite=True, verbose="error")
    _blank_parts(path)


def read_raw(path: Path, *, preload: bool = False) -> mne.io.BaseRaw:
    """Return the recording of a ``*_raw.fif`` artifact (n_channels, n_times; volts).

    Raises:
        DataError: The file is unreadable or its EEG is not in volts.
    """
    import mne

    with _quiet(), _named(path):
        raw = mne.io.read_raw_fif(path, preload=preload, verbose="error")
        start = raw.get_data(picks="eeg", start=0, stop=min(raw.n_times, 5000)) if "eeg" in raw else np.zeros((0, 0))
    check_volts(start, str(path.name))
    return raw


def read_samples(raw: mne.io.BaseRaw, picks: Sequence[int], scale: float = 1.0) -> NDArray[np.float64]:
    """Return samples of a recording that :func:`read_raw` gave, as ``scale * raw.get_data(picks)`` does.

    Args:
        raw: The recording.
        picks: Rows of its channels.
        scale: What the volts are multiplied by.

    Returns:
        ndarray, shape (len(picks), n_times).

    Raises:
        DataError: The file is truncated.
    """
    with _named(Path(raw.filenames[0])):
        return samples.of_raw(raw, picks, scale)


def write_epochs(epochs: mne.BaseEpochs, path: Path) -> None:
    """Write epochs in single precision (volts), with the file's identity blanked."""
    with _quiet():
        epochs.save(path, fmt="single", overwrite=True, verbose="error")
    _blank_parts(path)


def read_epochs(path: Path) -> mne.BaseEpochs:
    """Return the epochs of a ``*_epo.fif`` artifact (n_epochs, n_channels, n_times; volts), loaded into memory.

    Raises:
        DataError: The file is unreadable or its EEG is not in volts.
    """
    import mne

    with _quiet(), _named(path):
        epochs = mne.read_epochs(path, preload=True, verbose="error")
    check_volts(epochs.get_data(copy=False)[:50], str(path.name))
    return epochs


def read_eeg_epochs(
    path: Path, dtype: type[np.floating] = np.float64
) -> tuple[mne.BaseEpochs, mne.Info, NDArray[np.floating]]:
    """Return what :func:`read_epochs` does in parts: the epochs without their samples, and the EEG channels alone.

    Args:
        path: A ``*_epo.fif`` artifact.
        dtype: Precision of the samples.

    Returns:
        The epochs (events, times, metadata), the EEG channels' description, and their samples, ndarray, shape
        (n_epochs, n_channels, n_times), µV; without an EEG channel n_channels is 0.

    Raises:
        DataError: The file is unreadable or its EEG is not in volts.
    """
    import mne

    with _quiet(), _named(path):
        epochs = mne.read_epochs(path, preload=False, verbose="error")
        try:
            picks = mne.pick_types(epochs.info, eeg=True, exclude=())
            data = samples.of_epochs(epochs, path, picks, dtype)
        finally:
            # MNE leaves them open until the epochs are collected.
            for part in getattr(epochs, "_raw", ()):
                part.fid.close()
    check_volts(1e-6 * data[:50], str(path.name))
    return epochs, mne.pick_info(epochs.info, picks), data


def write_evokeds(evokeds: Sequence[mne.Evoked], path: Path) -> None:
    """Write averages (volts), with the file's identity blanked."""
    import mne

    with _quiet():
        mne.write_evokeds(path, list(evokeds), overwrite=True, verbose="error")
    _blank_parts(path)


def read_evokeds(path: Path) -> list[mne.Evoked]:
    """Return the averages of a ``*_ave.fif`` artifact (n_channels, n_times; volts).

    Raises:
        DataError: The file is unreadable.
    """
    import mne

    with _quiet(), _named(path):
        return mne.read_evokeds(path, verbose="error")


def check_volts(data: np.ndarray, name: str, *, low: float = _LOW_V) -> None:
    """Refuse EEG whose spread cannot be volts.

    A channel's offset is no spread: DC amplifiers record the electrodes' own tens of millivolts. Channels with samples
    that are no numbers, and data of which half does not vary, say nothing.

    Args:
        data: ndarray, shape (..., n_times), V.
        name: What the data are, for the message.
        low: Smallest spread to accept, in volts: :data:`RECORDED_V` for a recording, less for what was filtered.

    Raises:
        DataError: The spread lies outside ``low`` … 10 mV; it says on which side.
    """
    if not data.size:
        return
    rows = data.reshape(-1, data.shape[-1])
    rows = rows[np.isfinite(rows).all(axis=1)]
    if not rows.size:
        return
    # The median over |x| is not moved by a few contaminated channels.
    spread = float(np.median(np.abs(rows - np.median(rows, axis=1, keepdims=True)))) * 1.4826
    if spread > _HIGH_V:
        side, taken, units = f"below {_HIGH_V:g} V", "in microvolts or millivolts", "'uV' or 'mV'"
    elif 0 < spread < low:
        side, taken, units = f"above {low:g} V", "in volts or millivolts, taken for a smaller unit", "'V' or 'mV'"
    else:
        return
    raise DataError(
        f"{name}: the EEG's spread is {spread:.3g} V; scalp EEG lies {side}",
        cure=f"the recording seems to be {taken}: set its unit (acquire.unit = {units}) and acquire it again",
    )


class _named:
    """Turn the many exceptions of a broken file into one DataError that names it."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> None:
        if not self.path.is_file():
            raise DataError(f"{self.path} does not exist", cure="rerun the stage that writes it")

    def __exit__(self, kind: type | None, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError | ValueError | RuntimeError | struct.error | KeyError | IndexError | EOFError):
            raise DataError(
                f"{self.path.name} cannot be read as FIF: {error}",
                cure="it is truncated or damaged: rerun the stage that writes it with --force",
            ) from error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        # MNE warns of its naming conventions and of single precision, both our choice, and of itself under pandas 3.
        warnings.simplefilter("ignore", RuntimeWarning)
        warnings.simplefilter("ignore", DeprecationWarning)
        yield


def _blank_parts(path: Path) -> None:
    for part in sorted(path.parent.glob(f"{path.stem}*.fif")):
        blank_ids(part)


def blank_ids(path: Path) -> None:
    """Blank every id tag of a FIF file, so that machine and time of writing leave no trace in the bytes."""
    with path.open("r+b") as file:
        for tag in samples.tags(file):
            if tag.kind in _ID_TAGS and tag.size == len(_BLANK_ID):
                file.write(_BLANK_ID)
