"""Several recordings of one subject, one after the other, as one with breaks between."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.errors import DataError
from hrcneuro.sources import origin
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.formats.xdf_streams import NoSamples
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.sidecars import sidecar_notes


def read_joined(paths: list[Path], **options: Any) -> Recording:
    """Return the recordings in these files as one, with notes on what lies beside them unread.

    A file without a sample of the EEG is left out, with a warning, where another one has some: a recorder that is
    ended in its first instant leaves such a part.

    Args:
        paths: In their order.
        options: As :func:`hrcneuro.sources.formats.read_recording` takes them.

    Raises:
        DataError, ConfigError: One cannot be read, or they differ in kind.
    """
    found: dict[Path, Recording] = {}
    empty: list[NoSamples] = []
    for path in paths:
        try:
            found[path] = read_recording(path, **options)
        except NoSamples as error:
            empty.append(error)
    if empty and not found:
        raise empty[0]
    recording = join([*found.values()], [path.name for path in found])
    recording.notes += [note for path in found for note in sidecar_notes(path)]
    recording.warnings += [f"left out, without EEG: {error.problem}" for error in empty]
    return recording


def join(recordings: list[Recording], names: list[str]) -> Recording:
    """Return the recordings in their order as one; the time between two is left out, and a break stands there.

    Args:
        recordings: At least one; they are used up.
        names: Their files, for notes and messages.

    Raises:
        DataError: They differ in sampling rate, channels, types or units.
    """
    first, *others = recordings
    if not others:
        return first
    for one, name in zip(others, names[1:], strict=True):
        _check_alike(first, one, names[0], name)
    starts = np.cumsum([0] + [one.data.shape[1] for one in recordings[:-1]]) / first.sfreq
    timed = list(zip(recordings, starts.tolist(), strict=True))
    joined = Recording(
        np.concatenate([one.data[[one.ch_names.index(name) for name in first.ch_names]] for one in recordings], axis=1),
        first.ch_names,
        first.ch_types,
        first.sfreq,
        pd.concat([one.markers.assign(onset_s=one.markers["onset_s"] + at) for one, at in timed], ignore_index=True),
        units=first.units,
        montage=next((one.montage for one in recordings if one.montage is not None), None),
    )
    joined.breaks_s = [at + b for one, at in timed for b in ([0.0] if at else []) + one.breaks_s]
    joined.named_breaks = [(b + at, onset + at, text) for one, at in timed for b, onset, text in one.named_breaks]
    joined.spans = [(onset + at, duration, text) for one, at in timed for onset, duration, text in one.spans]
    joined.origins = origin.joined([one.origins for one in recordings])
    joined.bads = list(dict.fromkeys(name for one in recordings for name in one.bads))
    lengths = [f"{name} ({one.duration_s:.1f} s)" for one, name in zip(recordings, names, strict=True)]
    joined.notes = [f"joined, with a break between: {', '.join(lengths)}"]
    joined.notes += [f"{name}: {note}" for one, name in zip(recordings, names, strict=True) for note in one.notes]
    joined.warnings = [f"{name}: {text}" for one, name in zip(recordings, names, strict=True) for text in one.warnings]
    return joined


def _check_alike(first: Recording, other: Recording, a: str, b: str) -> None:
    of_first = dict(zip(first.ch_names, zip(first.ch_types, first.units, strict=True), strict=True))
    of_other = dict(zip(other.ch_names, zip(other.ch_types, other.units, strict=True), strict=True))
    if first.sfreq != other.sfreq:
        problem = f"{first.sfreq:g} Hz and {other.sfreq:g} Hz"
    elif unlike := sorted(name for name in of_first | of_other if of_first.get(name) != of_other.get(name)):
        about = (f"{name} {of_first.get(name, 'absent')} and {of_other.get(name, 'absent')}" for name in unlike[:6])
        problem = "channels that differ: " + "; ".join(about)
    else:
        return
    raise DataError(
        f"{a} and {b} cannot be joined: {problem}",
        cure="name one of them in acquire.path, or export them alike",
    )
