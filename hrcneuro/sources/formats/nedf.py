"""NEDF, the format of Neuroelectrics' Enobio and Starstim, read by MNE."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.sources.formats.extras import needed
from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.recording import Recording


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    needed("defusedxml", "NEDF")
    return read_raw(path, lambda: mne.io.read_raw_nedf(path, preload=False, verbose="warning"))
