"""EDF, EDF+, BDF and BDF+: a header, then records of equal length."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.recording import Recording


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    reader = mne.io.read_raw_edf if path.suffix.lower() == ".edf" else mne.io.read_raw_bdf
    return read_raw(path, lambda: reader(path, preload=False, verbose="warning"))
