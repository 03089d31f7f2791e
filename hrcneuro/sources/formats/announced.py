"""The channels that a recording's header announces, read without its samples and without a numeric library."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.brainvision_text import channel_fields, read_sections
from hrcneuro.sources.formats.edf_header import read_header
from hrcneuro.sources.labels import kind_of


def announced_channels(path: Path) -> dict[str, float] | None:
    """Return channel -> sampling rate in Hz as the header of a BrainVision, EDF or BDF file has them, without triggers.

    None where the format is another, or the header says no such thing: whoever reads the recording says what is wrong.
    """
    reads = {".vhdr": _brainvision, ".edf": _edf, ".bdf": _edf}.get(path.suffix.lower())
    try:
        found = reads(path) if reads else None
    except (OSError, ValueError, ZeroDivisionError, DataError):
        return None
    return {name: rate for name, rate in found.items() if kind_of(name) != "stim"} if found else None


def _brainvision(path: Path) -> dict[str, float]:
    sections = read_sections(path)
    interval_us = float(sections.get("common infos", {}).get("samplinginterval", 0))
    rows = sections.get("channel infos", {}).values()
    return {channel_fields(row)[0]: 1e6 / interval_us for row in rows}


def _edf(path: Path) -> dict[str, float]:
    header = read_header(path)
    return {header.labels[i]: header.counts[i] / header.record_s for i in header.signals}
