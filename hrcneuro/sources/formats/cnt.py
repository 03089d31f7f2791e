"""``.cnt``, which two makers use for formats that have nothing else in common: ANT Neuro's eego, and Neuroscan."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.sources.formats import ant, neuroscan
from hrcneuro.sources.recording import Recording


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    with path.open("rb") as file:
        head = file.read(12)
    if head[:4] in (b"RIFF", b"RF64") and head[4:] != b"":
        return ant.read(path)
    if head.startswith(b"Version 3"):
        return neuroscan.read(path)
    raise DataError(
        f"{path.name} is neither ANT's .cnt nor Neuroscan's: it begins with {head[:9]!r}",
        cure="save it from the program that recorded it as one of these, or as BrainVision or EDF",
    )
