"""Other people's recordings, as they are: what each file holds, and that its values are those of MNE's or pyxdf's reading.

The files lie beside the project (``shared/data/recordings``) and are no part of it; without them nothing here runs. Each
fault that they have is also in a file that a test of its format writes. ``docs/real_recordings.md`` shows the table,
which ``python tests/sources/test_real_recordings.py`` prints.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any

import mne
import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "helpers"))

from shared_data import RECORDINGS

from hrcneuro.errors import HrcError
from hrcneuro.sources import channels, triggers
from hrcneuro.sources.formats import READABLE, read_recording
from hrcneuro.sources.matching import histogram, listed

pytestmark = pytest.mark.skipif(not RECORDINGS.is_dir(), reason="other people's recordings are not here (shared/data)")

MUSE = {"columns": ("TP9", "AF7", "AF8", "TP10"), "unit": "uV", "table_rate": 256.0, "time_column": "timestamps",
        "marker_column": "Marker"}  # fmt: skip
OPTIONS = {".csv": MUSE, "clock_resets.xdf": {"stream_rate": "measured"}}

EXPECTED = {
    "bci2000_dat/eeg1_1.dat": ("BCI2000", 64, 160, "StimulusCode 1 × 15, 2 × 15"),
    "bids/tiny_bids/sub-01_ses-eeg_task-rest_eeg.vhdr": ("BrainVision", 67, 5000, "Comment/… × 1"),
}
"""Filled by :func:`seen`; here only what a person should find first."""


def seen(path: Path) -> dict[str, Any]:
    """Return what reading a file gives, or the words with which it is refused."""
    options = next((one for key, one in OPTIONS.items() if path.name.endswith(key)), {})
    try:
        recording = read_recording(path, **options)
    except HrcError as error:
        return {"refused": error.problem, "cure": error.cure}
    channels._retype(recording, {})
    triggers.choose_markers(recording, "StimulusCode" if path.name == "eeg1_1.dat" else "auto")
    return {"recording": recording, "events": listed(histogram(recording.markers))}


def files() -> list[Path]:
    return sorted(path for path in RECORDINGS.rglob("*") if path.is_file() and path.name.lower().endswith(READABLE))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    for path in files():
        found = seen(path)
        one = found.get("recording")
        what = f"{len(one.picks('eeg'))} of {len(one.ch_names)} | {one.sfreq:g} | {found['events'][:70]} | {one.breaks_s} {one.data.shape}" if one else found["refused"]
        print(f"{path.relative_to(RECORDINGS)} | {what}")
    print(mne.__version__, np.__version__)
