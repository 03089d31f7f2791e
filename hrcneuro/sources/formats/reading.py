"""What the readers of MNE's formats share: a raw of MNE becomes a recording, its warnings become notes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.recording import CHANNEL_TYPES, Recording, markers_of
from hrcneuro.sources.triggers import use_trigger_channel

if TYPE_CHECKING:
    import mne

# EEGLAB writes 'boundary', or -99 where all event types are numbers; BrainVision starts a segment with a marker.
_BREAKS = frozenset({"boundary", "-99", "New Segment/", "EDGE boundary"})


def read_raw(path: Path, read: Callable[[], mne.io.BaseRaw]) -> Recording:
    """Return the recording that a reader of MNE makes of a file; what it warns of becomes notes.

    Args:
        path: The file, for messages.
        read: Opens it by MNE, its samples still on disk.

    Raises:
        DataError: The file cannot be read, or its data file is missing.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        raw = _opened(path, read)
        recording = _converted(raw, path)
    recording.notes = _notes(caught, path) + recording.notes
    return recording


def _opened(path: Path, read: Callable[[], mne.io.BaseRaw]) -> mne.io.BaseRaw:
    try:
        return read()
    except FileNotFoundError as error:
        raise DataError(
            f"{path.name} names a data file that is not there: {base_names(str(error))}",
            cure=f"put it beside {path.name} (git lfs pull, where the repository uses LFS)",
        ) from error
    except DataError:
        raise
    except Exception as error:
        # MNE's readers raise whatever their parsers raise; for a person it is one thing: the file cannot be read.
        raise DataError(
            f"{path.name} cannot be read as {path.suffix}: {type(error).__name__}: {base_names(str(error))}",
            cure="check that it is a continuous recording of that format, and whole",
        ) from error


def _converted(raw: mne.io.BaseRaw, path: Path) -> Recording:
    sfreq = float(raw.info["sfreq"])
    kinds = raw.get_channel_types()
    keep = [i for i, kind in enumerate(kinds) if kind in CHANNEL_TYPES]
    try:
        data = raw.get_data(picks=keep, verbose="error") if keep else np.zeros((0, len(raw.times)))
        montage = raw.get_montage() if "eeg" in kinds else None
    except Exception as error:
        raise DataError(
            f"the samples of {path.name} cannot be read: {type(error).__name__}: {base_names(str(error))}",
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
        use_trigger_channel(recording)
    return recording


def _sort_annotations(recording: Recording, raw: mne.io.BaseRaw) -> None:
    """Tell markers from breaks and from stretches marked bad."""
    samples = recording.data.shape[1]
    onsets, events, breaks = [], [], set()
    for mark in raw.annotations:
        # MNE counts an annotation from where the clock started, a FIF's first sample may come later.
        onset, text = float(mark["onset"]) - raw.first_time, marker_name(mark["description"])
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


def marker_name(text: str) -> str:
    """Return a marker's name without blanks around it and without the decimals of a whole number."""
    # Numbers in a table that also has gaps come back from MATLAB as 33025.0.
    return re.sub(r"^(-?\d+)\.0$", r"\1", text.strip())


def _units(raw: mne.io.BaseRaw, names: list[str], path: Path) -> list[str]:
    """Return the unit that MNE took each channel's numbers for."""
    default = "uV" if path.suffix.lower() == ".set" else "V"
    stated = getattr(raw, "_orig_units", {})
    micro = str.maketrans("µμ", "uu")
    return [str(stated.get(name, default)).translate(micro) for name in names]


def _notes(caught: list[warnings.WarningMessage], path: Path) -> list[str]:
    """Return what the reader warned of, for the record; breaks are dealt with and need no word."""
    texts = [base_names(str(w.message)) for w in caught if issubclass(w.category, RuntimeWarning | UserWarning)]
    return [f"{path.name}: {text[:300]}" for text in dict.fromkeys(texts) if "'boundary' events" not in text]


def base_names(text: str) -> str:
    """Return a message with folders cut off the paths in it: no machine's layout belongs in an artifact."""
    return re.sub(r"(?:/[^/\s'\":]+)+/([^/\s'\":]+)", r"\1", " ".join(text.split()))
