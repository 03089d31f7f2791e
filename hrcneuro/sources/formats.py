"""Recordings of any format that MNE reads (and XDF), as one type. Positions, markers, breaks and quirks included."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources import layout
from hrcneuro.sources.recording import CHANNEL_TYPES, Recording, markers_of

if TYPE_CHECKING:
    import mne

# EEGLAB writes 'boundary', or -99 where all event types are numbers; BrainVision starts a segment with a marker.
_BREAKS = frozenset({"boundary", "-99", "New Segment/", "EDGE boundary"})
_EEGLAB_VALUE_BYTES = 4
_TRIGGER_NAMES = ("STI101", "STI 014", "STI014", "STATUS", "TRIGGER")


def read_recording(path: Path, *, stream: str = "") -> Recording:
    """Return the recording in a BrainVision, EEGLAB, FIF, EDF, BDF or XDF file.

    Args:
        path: The file that a user would open: ``.vhdr``, ``.set``, ``.fif``, ``.edf``, ``.bdf``, ``.xdf``.
        stream: Name of the EEG stream, where an XDF file holds several.

    Raises:
        DataError: The file is a Git LFS pointer, truncated, unreadable or holds epochs instead of a recording.
    """
    for file in layout.recording_files(str(path), "").values():
        layout.refuse_pointer(file)
    if ".xdf" in path.name.lower():
        from hrcneuro.sources.xdf import read_xdf

        return read_xdf(path, stream=stream)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        raw = _open(path)
        recording = _convert(raw, path)
    recording.notes = _notes(caught, path) + recording.notes
    return recording


def _open(path: Path) -> mne.io.BaseRaw:
    """Return MNE's view of the file, its samples still on disk."""
    import mne

    name = path.name.lower()
    try:
        if name.endswith(".set"):
            raw = mne.io.read_raw_eeglab(path, preload=False, verbose="error")
            _check_size(raw, path)
        elif name.endswith(".vhdr"):
            raw = mne.io.read_raw_brainvision(path, preload=False, verbose="error")
        elif name.endswith((".edf", ".bdf")):
            reader = mne.io.read_raw_edf if name.endswith(".edf") else mne.io.read_raw_bdf
            raw = reader(path, preload=False, verbose="error")
        else:
            raw = mne.io.read_raw_fif(path, preload=False, verbose="error")
    except FileNotFoundError as error:
        raise DataError(
            f"{path.name} names a data file that is not there: {_base_names(str(error))}",
            cure=f"put it beside {path.name} (git lfs pull, where the repository uses LFS)",
        ) from error
    except DataError:
        raise
    except Exception as error:
        # MNE's readers raise whatever their parsers raise; for a person it is one thing: the file cannot be read.
        raise DataError(
            f"{path.name} cannot be read as {path.suffix}: {type(error).__name__}: {_base_names(str(error))}",
            cure="check that it is a continuous recording of that format, and whole",
        ) from error
    return raw


def _check_size(raw: mne.io.BaseRaw, path: Path) -> None:
    """Refuse an EEGLAB data file whose size contradicts the header."""
    data = Path(raw.filenames[0])
    if data.suffix.lower() != ".fdt":
        return
    layout.refuse_pointer(data)
    samples, channels = len(raw.times), len(raw.ch_names)
    wanted, got = samples * channels * _EEGLAB_VALUE_BYTES, data.stat().st_size
    if got != wanted:
        raise DataError(
            f"{data.name} has {got} bytes; {path.name} announces {channels} channels × {samples} samples × "
            f"{_EEGLAB_VALUE_BYTES} bytes = {wanted}: it is {'truncated' if got < wanted else 'too long'}",
            cure="copy or download both files again; they must come from the same saving",
        )


def _convert(raw: mne.io.BaseRaw, path: Path) -> Recording:
    sfreq = float(raw.info["sfreq"])
    kinds = raw.get_channel_types()
    keep = [i for i, kind in enumerate(kinds) if kind in CHANNEL_TYPES]
    try:
        data = raw.get_data(picks=keep, verbose="error") if keep else np.zeros((0, len(raw.times)))
        montage = raw.get_montage() if "eeg" in kinds else None
    except Exception as error:
        raise DataError(
            f"the samples of {path.name} cannot be read: {type(error).__name__}: {_base_names(str(error))}",
            cure="the file is truncated or damaged: copy it again",
        ) from error
    recording = Recording(
        data, [raw.ch_names[i] for i in keep], [kinds[i] for i in keep], sfreq, markers_of([], []), montage=montage
    )
    recording.units = _units(raw, recording.ch_names, path)
    recording.bads = [name for name in raw.info["bads"] if name in recording.ch_names]
    if len(keep) < len(kinds):
        left = [raw.ch_names[i] for i in range(len(kinds)) if i not in keep]
        recording.notes.append(f"channels of other types left out: {', '.join(left)}")
    _sort_annotations(recording, raw)
    if recording.markers.empty:
        _use_trigger_channel(recording)
    return recording


def _sort_annotations(recording: Recording, raw: mne.io.BaseRaw) -> None:
    """Tell markers from breaks and from stretches marked bad."""
    samples = recording.data.shape[1]
    onsets, events, breaks = [], [], set()
    for mark in raw.annotations:
        # MNE counts an annotation from where the clock started, a FIF's first sample may come later.
        onset, text = float(mark["onset"]) - raw.first_time, _marker_name(mark["description"])
        if text in _BREAKS:
            # The nearest sample, and from half-way the later one, as firfilt has it. The margin is for rounding.
            breaks.add(int(np.floor(onset * recording.sfreq + 0.5 + 1e-3)))
        elif text.upper().startswith(("BAD", "EDGE")):
            if text != "BAD boundary":
                recording.spans.append((onset, float(mark["duration"]), text))
        else:
            onsets.append(onset)
            events.append(text)
    recording.breaks_s = [at / recording.sfreq for at in sorted(breaks) if 0 < at < samples]
    recording.markers = markers_of(onsets, events)


def _marker_name(text: str) -> str:
    # Numbers in a table that also has gaps come back from MATLAB as 33025.0.
    return re.sub(r"^(-?\d+)\.0$", r"\1", text.strip())


def _use_trigger_channel(recording: Recording) -> None:
    """Take the markers from a trigger channel: every change to another code that is not zero."""
    stim = recording.picks("stim")
    if not stim:
        return
    known = [i for i in stim if recording.ch_names[i].upper() in _TRIGGER_NAMES]
    pick = (known or stim)[0]
    codes = np.rint(recording.data[pick]).astype(np.int64)
    at = np.flatnonzero((codes[1:] != codes[:-1]) & (codes[1:] != 0)) + 1
    recording.markers = markers_of(at / recording.sfreq, [str(code) for code in codes[at]])
    recording.notes.append(f"markers taken from the trigger channel {recording.ch_names[pick]}")


def _units(raw: mne.io.BaseRaw, names: list[str], path: Path) -> list[str]:
    """Return the unit that MNE took each channel's numbers for."""
    default = "uV" if path.suffix.lower() == ".set" else "V"
    stated = getattr(raw, "_orig_units", {})
    micro = str.maketrans("µμ", "uu")
    return [str(stated.get(name, default)).translate(micro) for name in names]


def _notes(caught: list[warnings.WarningMessage], path: Path) -> list[str]:
    """Return what the reader warned of, for the record; breaks are dealt with and need no word."""
    texts = [_base_names(str(w.message)) for w in caught if issubclass(w.category, RuntimeWarning | UserWarning)]
    return [f"{path.name}: {text[:300]}" for text in dict.fromkeys(texts) if "'boundary' events" not in text]


def _base_names(text: str) -> str:
    """Return a message with folders cut off the paths in it: no machine's layout belongs in an artifact."""
    return re.sub(r"(?:/[^/\s'\":]+)+/([^/\s'\":]+)", r"\1", " ".join(text.split()))
