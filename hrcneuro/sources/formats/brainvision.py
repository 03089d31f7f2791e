"""BrainVision: a header (``.vhdr``) that names a data file and a marker file."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.recording import Recording


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    return read_raw(path, lambda: mne.io.read_raw_brainvision(path, preload=False, verbose="warning"))
