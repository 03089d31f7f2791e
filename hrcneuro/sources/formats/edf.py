"""EDF, EDF+, BDF and BDF+: a header, then records of equal length.

MNE reads the samples; header, annotations and BioSemi's Status are read here, where MNE takes records that follow each
other in the file for continuous, and 17 of 24 status bits for a trigger's code.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.formats import biosemi, edf_annotations
from hrcneuro.sources.formats.edf_header import Header, check_size, read_header
from hrcneuro.sources.formats.pieces import Pieces
from hrcneuro.sources.formats.reading import read_raw, sort_marks
from hrcneuro.sources.labels import kind_of
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.units import voltage_unit

if TYPE_CHECKING:
    import mne

_OF_MNE = ("uV", "\u00b5V", "\u03bcV", "mV", "V")


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    header = read_header(path)
    notes = check_size(header, path.name)
    reader = mne.io.read_raw_bdf if header.width == 3 else mne.io.read_raw_edf
    return read_raw(
        path,
        # Annotations are read here; in latin-1 every byte has a meaning, so MNE refuses none.
        lambda: reader(path, preload=False, encoding="latin1", verbose="warning"),
        notes=notes,
        finish=lambda raw, recording: _finish(raw, recording, header, path),
        dealt_with=("Number of records from the header", "Omitted", "Limited", "Loading an EDF with mixed"),
    )


def _finish(raw: mne.io.BaseRaw, recording: Recording, header: Header, path: Path) -> None:
    """Give the recording its marks, at their true time, its breaks, and what BioSemi's Status tells."""
    records = np.memmap(path, np.uint8, "r", header.size, (header.found, header.record_bytes))
    each = raw.n_times // header.found
    found = edf_annotations.parse(header, records)
    pieces, notes = edf_annotations.pieces(header, found.records_s, each=each, sfreq=recording.sfreq, name=path.name)
    recording.notes += notes
    if found.legacy:
        recording.notes.append(f"{path.name}: annotations that are not UTF-8 are read as cp1252")
    start = edf_annotations.origin(found.records_s)
    marks = [(onset - start, duration, text) for onset, duration, text in found.marks]
    status = _status(header, records)
    if status is not None:
        scale = each * len(records) / len(status)
        pieces = _with_pauses(pieces, [int(at * scale) for at in biosemi.breaks(status)], recording)
    _mixed_rates(raw, recording, header, pieces)
    _rare_units(recording, header)
    sort_marks(recording, marks, pieces)
    _trigger_channels(recording, header, records, status)
    if status is not None:
        _tell_status(recording, status)


def _rare_units(recording: Recording, header: Header) -> None:
    """Scale channels whose unit is a voltage in a spelling that MNE takes for volts: ``uv``, ``microV``, ``nV``.

    Of a unit that is no voltage MNE keeps no word.
    """
    for row, signal in enumerate(header.signals):
        unit = header.units[signal]
        known = voltage_unit(unit)
        if known and unit not in _OF_MNE:
            recording.data[row] *= VOLTS[known]
            recording.units[row] = known
        elif unit and not known:
            recording.units[row] = unit


def _mixed_rates(raw: mne.io.BaseRaw, recording: Recording, header: Header, pieces: Pieces) -> None:
    """Note which channels were resampled; where there are breaks, resample each piece by itself."""
    counts = {header.counts[i] for i in header.signals}
    if len(counts) == 1:
        return
    rates = ", ".join(f"{count / header.record_s:g} Hz" for count in sorted(counts))
    recording.notes.append(f"channels at {rates}: all are brought to {recording.sfreq:g} Hz")
    firsts = pieces.firsts[pieces.breaks]
    if len(firsts):
        edges = [0, *map(int, firsts), raw.n_times]
        recording.data = np.hstack([raw.get_data(recording.ch_names, a, b) for a, b in pairwise(edges)])


def _trigger_channels(recording: Recording, header: Header, records: np.ndarray, status: np.ndarray | None) -> None:
    """Give trigger channels the codes that stand in the file, each held until the next.

    MNE cuts decimals off them, and resamples them as it does signals unless they are called Status or Trigger.
    """
    samples = recording.data.shape[1]
    for row, signal in enumerate(header.signals):
        label = header.labels[signal]
        if kind_of(label) != "stim":
            continue
        if status is not None and label.lower() == "status":
            codes = (status & biosemi.TRIGGERS).astype(float)
        else:
            codes = _values(header, records, signal)
        recording.data[row] = codes[np.arange(samples) * len(codes) // samples]
        recording.ch_types[row], recording.units[row] = "stim", ""


def _values(header: Header, records: np.ndarray, signal: int) -> np.ndarray:
    """Return a signal's values, shape (n,): in its unit in EDF, as they stand in BDF, where they are words of bits."""
    content = np.ascontiguousarray(records[:, header.columns(signal)])
    if header.width == 3:
        words = biosemi.words(content.reshape(-1, 3))
        return np.where(words < 1 << 23, words, words - (1 << 24)).astype(float)
    steps = content.view("<i2").ravel().astype(float)
    low, high, least, most = header.ranges[signal]
    return np.rint((steps - least) * (high - low) / (most - least) + low) if most > least else steps


def _status(header: Header, records: np.ndarray) -> np.ndarray | None:
    """Return the words of BioSemi's Status, shape (n,), or None where there are none."""
    at = [i for i, label in enumerate(header.labels) if label.lower() == "status"]
    if not header.biosemi or not at:
        return None
    status = biosemi.words(np.ascontiguousarray(records[:, header.columns(at[0])]).reshape(-1, 3))
    return status if biosemi.is_biosemi(status) else None


def _with_pauses(pieces: Pieces, pauses: list[int], recording: Recording) -> Pieces:
    """Return the pieces with a break at each pause: how long it was the Status does not say."""
    pauses = [at for at in pauses if at not in set(pieces.firsts[pieces.breaks].tolist())]
    if not pauses:
        return pieces
    recording.notes.append(f"Status marks {len(pauses)} pauses of the recording: each is a break")
    firsts = np.union1d(pieces.firsts, pauses)
    before = np.searchsorted(pieces.firsts, firsts, side="right") - 1
    starts = pieces.starts_s[before] + (firsts - pieces.firsts[before]) / pieces.sfreq
    known = np.isin(firsts, pieces.firsts[pieces.breaks])
    return replace(pieces, starts_s=starts, firsts=firsts, breaks=known | np.isin(firsts, pauses))


def _tell_status(recording: Recording, status: np.ndarray) -> None:
    """Mark where the reference was open, and note what else the amplifier says of itself."""
    rate = len(status) / recording.duration_s
    open_s = [(start / rate, (stop - start) / rate, "BAD_CMS") for start, stop in biosemi.out_of_range(status)]
    recording.spans += open_s
    if open_s:
        recording.notes.append(
            f"Status says that CMS was out of range in {len(open_s)} stretches: they are marked BAD_CMS"
        )
    recording.notes += biosemi.remarks(status)
