"""EGI's simple binary format (``.raw``), read by MNE."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.recording import Recording, markers_of

if TYPE_CHECKING:
    import mne

_BYTES = {2: 2, 4: 4, 6: 8}  # version -> bytes of a number; an odd version has segments


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    in_volts = _check(path)
    return read_raw(
        path,
        lambda: mne.io.read_raw_egi(path, preload=False, events_as_annotations=True, verbose="warning"),
        finish=lambda raw, recording: _finish(raw, recording, in_volts),
    )


def _check(path: Path) -> bool:
    """Return whether MNE's numbers are volts; refuse a file that is none of the kind, or that is cut."""
    with path.open("rb") as file:
        head = file.read(36)
    if len(head) < 36 or not 2 <= (version := struct.unpack(">i", head[:4])[0]) <= 7:
        raise DataError(
            f"{path.name} is no simple binary file of EGI",
            cure="export it from Net Station as 'simple binary', or save it as FIF with MNE",
        )
    if version not in _BYTES:
        raise DataError(
            f"{path.name} holds segments (version {version}), not a continuous recording",
            cure="export the recording before it was cut into segments",
        )
    channels, bits, span = (struct.unpack_from(">h", head, at)[0] for at in (22, 26, 28))
    samples, events = struct.unpack_from(">ih", head, 30)
    whole = 36 + 4 * events + samples * (channels + events) * _BYTES[version]
    if (size := path.stat().st_size) < whole:
        raise DataError(
            f"{path.name} announces {samples} samples ({whole} bytes), it holds {size} bytes: it is truncated",
            cure="copy or download the file again",
        )
    return not (bits and span)


def _finish(raw: mne.io.BaseRaw, recording: Recording, in_volts: bool) -> None:
    """Give the recording a marker wherever one of its lines of events rises; MNE makes one of every sample of it."""
    if not in_volts:
        # MNE scales by the amplifier's range, which is in microvolts, and stops there.
        for i in recording.picks("eeg"):
            recording.data[i] *= 1e-6
    onsets, names = [], []
    for i in recording.picks("stim"):
        high = recording.data[i] != 0
        rises = np.flatnonzero(high & ~np.append(False, high[:-1]))
        onsets += (rises / recording.sfreq).tolist()
        names += [recording.ch_names[i]] * len(rises)
    recording.keep([i for i, kind in enumerate(recording.ch_types) if kind != "stim"])
    recording.units = ["uV"] * len(recording.ch_names)
    recording.markers = markers_of(onsets, names)
