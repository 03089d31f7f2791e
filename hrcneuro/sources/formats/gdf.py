"""GDF, the General Data Format for biosignals, of both kinds (1.x and 2.x).

MNE reads the samples. The header is read here to know whether the file is whole and what its units are, and so is the
table of events: MNE places events by the rate of the samples where the table states one of its own. Layout, types,
units and event codes: Schlögl 2006, arXiv cs/0608052.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.formats.gdf_header import Header, check_size, read_events, read_header
from hrcneuro.sources.formats.pieces import Pieces
from hrcneuro.sources.formats.reading import read_raw, sort_marks
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.units import voltage_unit

if TYPE_CHECKING:
    import mne

_NEW_SEGMENT = 0x7FFE


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    header = read_header(path)
    notes = check_size(header, path)
    return read_raw(
        path,
        lambda: mne.io.read_raw_gdf(path, preload=False, verbose="warning"),
        notes=notes,
        finish=lambda raw, recording: _finish(raw, recording, header, path),
        dealt_with=("Unsupported physical dimension", "Could not determine channel type"),
    )


def _finish(raw: mne.io.BaseRaw, recording: Recording, header: Header, path: Path) -> None:
    """Give channels the units of the header, and the recording the events and breaks of its table."""
    _units(raw, recording, header)
    rates = sorted({header.rate(i) for i in range(header.channels)})
    if len(rates) > 1:
        listed = ", ".join(f"{rate:g} Hz" for rate in rates)
        recording.notes.append(f"channels at {listed}: all are brought to {recording.sfreq:g} Hz")
    events = read_events(header, path)
    rate = events.rate or recording.sfreq
    marks, breaks = [], {0}
    for at, code, samples in zip(events.positions, events.codes, events.durations, strict=True):
        onset = (int(at) - 1) / rate  # counted from 1
        if code == _NEW_SEGMENT:
            breaks.add(round(onset * recording.sfreq))
        else:
            marks.append((onset, int(samples) / rate, str(int(code))))
    sort_marks(recording, marks, Pieces.joined(sorted(breaks), recording.data.shape[1], recording.sfreq))


def _units(raw: mne.io.BaseRaw, recording: Recording, header: Header) -> None:
    """Scale voltages that MNE takes for volts though the header says mV (1.x) or nV, and keep the word of the rest."""
    for row, name in enumerate(recording.ch_names):
        signal = raw.ch_names.index(name)
        unit = header.units[signal]
        known = voltage_unit(unit) if unit else None
        recording.units[row] = known or unit or "V"
        done = _scale_of_mne(header, unit)
        if known and VOLTS[known] != done:
            recording.data[row] *= VOLTS[known] / done


def _scale_of_mne(header: Header, unit: str) -> float:
    """Return what MNE multiplies by: of text only uV is known to it, of the codes of 2.x also mV."""
    if unit.startswith("uV"):
        return 1e-6
    return 1e-3 if unit == "mV" and header.version >= 1.9 else 1.0
