"""What the readers of MNE's formats share: a raw of MNE becomes a recording, its warnings become notes."""

from __future__ import annotations

import contextlib
import logging
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.pieces import Pieces
from hrcneuro.sources.matching import listed
from hrcneuro.sources.recording import CHANNEL_TYPES, Recording, markers_of

if TYPE_CHECKING:
    import mne

# MNE's mark of a join, which EEGLAB's is by now, too; BrainVision starts a segment with a marker.
_BREAKS = frozenset({"EDGE boundary", "New Segment/"})
# EEGLAB's marks in a file that another program made of its data set; or a condition.
_MAY_BE_BREAKS = frozenset({"boundary", "-99"})
# A name alone decides nothing: only what lasts is a stretch, and "badminton" is none.
_BAD = re.compile(r"bad(?![a-z])", re.IGNORECASE)

# What MNE warns of though it is dealt with: breaks become breaks, and a file's name need not end as MNE would have it.
_DEALT_WITH = ("'boundary' events", "does not conform to MNE naming conventions")
# Warnings meant for programmers.
_OF_PROGRAMS = (DeprecationWarning, PendingDeprecationWarning, FutureWarning, ResourceWarning, ImportWarning)

Mark = tuple[float, float, str]
"""Onset and duration in s, and text."""


def read_raw(
    path: Path,
    read: Callable[[], mne.io.BaseRaw],
    *,
    notes: Sequence[str] = (),
    finish: Callable[[mne.io.BaseRaw, Recording], None] | None = None,
    dealt_with: tuple[str, ...] = (),
) -> Recording:
    """Return the recording that a reader of MNE makes of a file; what it warns of becomes notes.

    Args:
        path: The file, for messages.
        read: Opens it by MNE, its samples still on disk.
        notes: What the format's own reader has to say; ``read`` may add to it.
        finish: Gives the recording its markers, breaks and spans; without it they are MNE's annotations.
        dealt_with: Parts of warnings that need no note, since ``read`` or ``finish`` does what they warn of.

    Raises:
        DataError: The file cannot be read, or its data file is missing.
    """
    import mne

    # MNE warns only where its own level lets it, whatever a user's environment says.
    with mne.utils.use_log_level("warning"), complaints("mne") as said, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        raw = _opened(path, read)
        recording = _converted(raw, path)
        if finish is None:
            sort_marks(recording, marks_of(raw))
        else:
            finish(raw, recording)
    recording.notes = [*notes, *_notes(caught, said, path, dealt_with), *recording.notes]
    return recording


@contextlib.contextmanager
def complaints(library: str) -> Iterator[list[str]]:
    """Collect what a library logs as a warning; none of it goes to the terminal, where answers go."""
    said: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger(library)
    before = list(logger.handlers), logger.propagate
    logger.handlers, logger.propagate = [handler], False
    try:
        yield said
    finally:
        logger.handlers, logger.propagate = before


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
        data = raw.get_data(picks=keep) if keep else np.zeros((0, len(raw.times)))
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
    return recording


def marks_of(raw: mne.io.BaseRaw) -> list[Mark]:
    """Return MNE's annotations of a file, their onsets counted from the first sample."""
    # MNE counts an annotation from where the clock started, a FIF's first sample may come later.
    return [
        (float(mark["onset"]) - raw.first_time, float(mark["duration"]), str(mark["description"]))
        for mark in raw.annotations
    ]


def sort_marks(recording: Recording, marks: list[Mark], pieces: Pieces | None = None) -> None:
    """Tell markers from breaks and from stretches marked bad, and put each at its place among the samples.

    Args:
        recording: Gets markers, breaks and spans, and a note of markers that lie where nothing was recorded.
        marks: Onsets by the recording's clock, from the first sample.
        pieces: The stretches that were recorded, where it is known that some were not.
    """
    samples = recording.data.shape[1]
    # A stretch is longer than one sample: that is what formats without durations write.
    instant_s = 1.01 / recording.sfreq
    at_s = [onset for onset, _, _ in marks]
    lasts_s = [duration for _, duration, _ in marks]
    inside = [True] * len(marks)
    if pieces is not None and marks:
        recorded = pieces.place(np.array(at_s))[1]
        ends = pieces.place(np.add(at_s, lasts_s))[0]
        at_s = pieces.place(np.array(at_s))[0].tolist()
        lasts_s = (ends - at_s).tolist()
        inside = recorded.tolist()
    onsets, events, lost, breaks = [], [], [], set()
    said: dict[int, tuple[float, str]] = {}
    for onset, lasts, there, (_, duration, description) in zip(at_s, lasts_s, inside, marks, strict=True):
        text = marker_name(description)
        # The nearest sample, and from half-way the later one, as firfilt has it. The margin is for rounding.
        nearest = int(np.floor(onset * recording.sfreq + 0.5 + 1e-3))
        if text in _BREAKS:
            breaks.add(nearest)
        elif text in _MAY_BE_BREAKS:
            said[nearest] = (onset, text)
        # Programs that write BrainVision make comments of all annotations.
        elif duration > instant_s and _BAD.match(text.removeprefix("Comment/")):
            recording.spans += [(onset, lasts, text)] if lasts > 0 else []
        elif text != "BAD boundary":
            if there:
                onsets.append(onset)
                events.append(text)
            else:
                lost.append(text)
    joins = {round(at * recording.sfreq) for at in pieces.breaks_s} if pieces is not None else set()
    breaks |= joins
    recording.breaks_s = [at / recording.sfreq for at in sorted(breaks | set(said)) if 0 < at < samples]
    recording.named_breaks = [(at / recording.sfreq, *one) for at, one in sorted(said.items()) if at not in breaks]
    recording.markers = markers_of(onsets, events)
    if lost:
        counts = Counter(lost)
        recording.notes.append(f"{len(lost)} markers lie where nothing was recorded and are left out: {listed(counts)}")


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


def _notes(
    caught: list[warnings.WarningMessage], said: list[str], path: Path, dealt_with: tuple[str, ...]
) -> list[str]:
    """Return what the reader warned of, for the record; what is dealt with, or harmless, needs no word."""
    texts = [base_names(str(w.message)) for w in caught if not issubclass(w.category, _OF_PROGRAMS)]
    texts += [base_names(text) for text in said]
    known = (*_DEALT_WITH, *dealt_with)
    return [f"{path.name}: {text[:300]}" for text in dict.fromkeys(texts) if not any(one in text for one in known)]


def base_names(text: str) -> str:
    """Return a message with folders cut off the paths in it: no machine's layout belongs in an artifact."""
    return re.sub(r"(?:/[^/\s'\":]+)+/([^/\s'\":]+)", r"\1", " ".join(text.split()))
