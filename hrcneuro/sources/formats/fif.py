"""FIF, MNE's own format; a large recording lies in several files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.fif_tags import check_whole, parts
from hrcneuro.sources.formats.pieces import Pieces, cut_out
from hrcneuro.sources.formats.reading import marks_of, read_raw, sort_marks
from hrcneuro.sources.recording import Recording

if TYPE_CHECKING:
    import mne

_SKIP = "BAD_ACQ_SKIP"


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    for file in (path, *parts(path)):
        check_whole(file)
    return read_raw(path, lambda: mne.io.read_raw_fif(path, preload=False, verbose="warning"), finish=_finish)


def _finish(raw: mne.io.BaseRaw, recording: Recording) -> None:
    """Give the recording its marks at their true time, and a break wherever nothing was recorded for a while."""
    marks = marks_of(raw)
    # MNE fills such a stretch with zeros. They were never recorded: no filter and no measure of a channel may see them.
    gaps = [
        (round(onset * recording.sfreq), round((onset + duration) * recording.sfreq))
        for onset, duration, text in marks
        if text.upper().startswith(_SKIP)
    ]
    pieces = _with_late_parts(raw, cut_out(recording, gaps), recording)
    if len(gaps):
        gone = (raw.n_times - recording.data.shape[1]) / recording.sfreq
        recording.notes.append(
            f"{gone:g} s in {len(set(gaps))} stretches were not recorded ({_SKIP}): left out, each is a break"
        )
    sort_marks(recording, [mark for mark in marks if not mark[2].upper().startswith(_SKIP)], pieces)


def _with_late_parts(raw: mne.io.BaseRaw, pieces: Pieces, recording: Recording) -> Pieces:
    """Return the pieces with a break where a part of a recording does not begin at the sample where the last ended.

    MNE puts the parts one behind the other, and counts marks by the clock of the first.
    """
    firsts, lasts = np.asarray(raw._first_samps), np.asarray(raw._last_samps)
    late = firsts[1:] - lasts[:-1] - 1
    if not late.any():
        return pieces
    if len(pieces.firsts) > 1:
        raise DataError(
            f"{raw.filenames[0].name}: its parts do not follow each other, and there are gaps within them",
            cure="save it anew in one file with MNE, or name each part in acquire.path by itself",
        )
    if (late < 0).any():
        k = int(np.argmax(late < 0))
        raise DataError(
            f"{raw.filenames[k + 1].name} begins {-late[k]} samples before {raw.filenames[k].name} ends: parts overlap",
            cure="check that the parts are of one recording, or name each in acquire.path by itself",
        )
    joins = np.cumsum(lasts - firsts + 1)[:-1][late != 0]
    by = ", ".join(f"{n:+d}" for n in late[late != 0])
    recording.notes.append(f"parts of the recording do not follow each other ({by} samples): each join is a break")
    return _joined(pieces, joins, late[late != 0])


def _joined(pieces: Pieces, joins: np.ndarray, late: np.ndarray) -> Pieces:
    firsts = np.append(0, joins)
    starts = firsts + np.append(0, np.cumsum(late))
    return Pieces(starts / pieces.sfreq, firsts, firsts > 0, pieces.samples, pieces.sfreq)
