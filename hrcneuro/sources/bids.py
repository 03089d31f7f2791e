"""The recordings of a BIDS data set with what its tables say of them: types, units, bad channels, places and events.

The recording itself is read as any other file is; where the two contradict each other, the summary says so. Tables and
columns: BIDS specification 1.10, "Electroencephalography" and "Task events".
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hrcneuro.errors import DataError
from hrcneuro.sources import bids_events, bids_layout, layout
from hrcneuro.sources.bids_tables import NO_NUMBER, NO_WORD, Row, read_rows
from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.formats.reading import Mark, marker_name, sort_marks
from hrcneuro.sources.joining import join
from hrcneuro.sources.kinds import kind_of_type
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.units import is_no_voltage, voltage_unit

if TYPE_CHECKING:
    import mne

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
# Of these systems an axis is known to point elsewhere: to the nose, and to the left ear.
_NOSE_FIRST = ("EEGLAB", "EEGLAB-HJ", "CTF")


def read(files: Mapping[str, Path], options: Source) -> Recording:
    """Return a subject's recordings as one, with what their tables say.

    Args:
        files: As :func:`hrcneuro.sources.bids_layout.files` gives them.
        options: Which column of the events names them.

    Raises:
        DataError, ConfigError: A recording or a table cannot be read, or recordings cannot be joined.
    """
    column = bids_events.naming_column(bids_layout.events_of(files), options.event_column)
    recordings, names = [], []
    for label, path in files.items():
        if path not in layout.recordings({label: path}):
            continue
        mark = label.removeprefix("recording")
        table = {kind: files.get(f"{kind}{mark}") for kind in ("channels", "events", "electrodes", "coordsystem")}
        one = read_recording(path)
        if table["channels"]:
            # EEGLAB's files have no word on their unit.
            _channels(one, table["channels"], unit_stated=path.suffix.lower() != ".set")
        if table["electrodes"] and table["coordsystem"]:
            _places(one, table["electrodes"], table["coordsystem"])
        _events(one, files[f"events{mark}"], column)
        recordings.append(one)
        names.append(path.name)
    joined = join(recordings, names)
    if joined.markers.empty:
        tables = ", ".join(path.name for path in bids_layout.events_of(files))
        raise DataError(
            f"{tables} holds no events within the recording, only breaks and bad stretches",
            cure="write the events there, a row each; onsets are in s from the recording's first sample",
        )
    joined.reference = _reference(files)
    return joined


def _channels(recording: Recording, table: Path, *, unit_stated: bool) -> None:
    """Give channels the types, units and marks of channels.tsv."""
    rows = read_rows(table)
    about = _matched(recording, rows, table)
    unknown: list[str] = []
    for i, name in enumerate(recording.ch_names):
        row = about[name]
        word = row.get("type", "n/a")
        kind = kind_of_type(word) or ("misc" if word.lower() not in NO_WORD else recording.ch_types[i])
        unknown += [f"{name} ({word})"] if kind == "misc" and not kind_of_type(word) and word != "n/a" else []
        _unit(recording, i, row.get("units", "n/a"), kind, table.name if unit_stated else "")
        recording.ch_types[i] = kind
        if row.get("status", "").lower() == "bad" and name not in recording.bads:
            recording.bads.append(name)
    if unknown:
        recording.notes.append(f"{table.name}: taken for misc by their type: {', '.join(unknown[:8])}")


def _matched(recording: Recording, rows: list[Row], table: Path) -> dict[str, Row]:
    """Return channel -> its row, by name, else by place: then the channel gets the table's name."""
    by_name = {row.get("name", ""): row for row in rows}
    if set(recording.ch_names) <= set(by_name):
        return by_name
    if len(rows) != len(recording.ch_names) or len(by_name) != len(rows):
        lacking = [name for name in recording.ch_names if name not in by_name]
        raise DataError(
            f"{table.name} has {len(rows)} channels and lacks {', '.join(lacking[:6])}, which the recording has",
            cure="correct the table: a row for each channel, in the recording's order",
        )
    renamed = {old: row["name"] for old, row in zip(recording.ch_names, rows, strict=True) if old != row["name"]}
    recording.notes.append(
        f"{table.name} names {len(renamed)} channels otherwise than the recording, by their order: "
        + ", ".join(f"{old} = {new}" for old, new in list(renamed.items())[:6])
    )
    if recording.montage is not None:
        known = {old: new for old, new in renamed.items() if old in recording.montage.ch_names}
        recording.montage.rename_channels(known)
    recording.bads = [renamed.get(name, name) for name in recording.bads]
    recording.ch_names = [row["name"] for row in rows]
    return by_name


def _unit(recording: Recording, i: int, word: str, kind: str, table: str) -> None:
    """Scale a channel by the table's unit, or say that the file's own one stands where it has one (``table``)."""
    believed = recording.units[i] if recording.units else "V"
    unit = voltage_unit(word) if word.lower() not in NO_WORD else None
    if kind == "stim":
        if recording.ch_types[i] != "stim":
            recording.data[i] /= VOLTS.get(believed, 1.0)
    elif unit and unit != believed and not table:
        recording.data[i] *= VOLTS[unit] / VOLTS.get(believed, 1.0)
        recording.units[i] = unit
    elif unit and voltage_unit(believed) and unit != believed:
        recording.notes.append(
            f"{table} gives {recording.ch_names[i]} in {word}, the recording itself in {believed}, which stands"
        )
    elif kind == "misc" and is_no_voltage(word):
        recording.units[i] = word
    elif not unit and word.lower() not in NO_WORD:
        recording.notes.append(f"the unit {word!r} of {recording.ch_names[i]} is no voltage and is not used")


def _events(recording: Recording, table: Path, column: str) -> None:
    """Give the recording the events of events.tsv, and its bad stretches; those of the file itself are left aside."""
    rows = read_rows(table)
    marks: list[Mark] = []
    mine: dict[tuple[float, str], list[Row]] = {}
    unplaced = unnamed = 0
    for row in rows:
        onset, text = bids_events.seconds(row.get("onset", "n/a"), table), marker_name(row[column])
        if np.isnan(onset):
            unplaced += 1
        elif text.lower() in NO_WORD:
            unnamed += 1
        else:
            duration = bids_events.seconds(row.get("duration", "n/a"), table)
            marks.append((onset, 0.0 if np.isnan(duration) else duration, text))
            mine.setdefault((onset, text), []).append(row)
    aside, breaks = len(recording.markers), set(recording.breaks_s)
    recording.spans, recording.named_breaks = [], []
    sort_marks(recording, marks)
    recording.breaks_s = sorted(breaks | set(recording.breaks_s))
    _keep_inside(recording, table)
    kept = [mine[key].pop(0) for key in zip(recording.markers["onset_s"], recording.markers["event"], strict=True)]
    if bids_layout.is_ours(_root(table)):
        words = pd.DataFrame(kept).replace("n/a", None)
        words = words.rename(columns={"duration": "t_f_s"}).drop(columns=["onset", column, "sample"], errors="ignore")
        recording.markers = pd.concat([recording.markers, words], axis=1)
    recording.notes.append(f"{table.name}: {len(rows)} rows, named by {column}")
    for count, what in ((unplaced, "an onset"), (unnamed, f"a name in {column}")):
        if count:
            recording.notes.append(f"{table.name}: {count} rows without {what} are left out")
    if aside:
        recording.notes.append(f"{aside} markers of the recording itself left aside: {table.name} has the events")


def _keep_inside(recording: Recording, table: Path) -> None:
    inside = recording.markers["onset_s"].between(-0.5 / recording.sfreq, recording.duration_s)
    if not inside.all():
        recording.warnings.append(
            f"{table.name}: {int((~inside).sum())} events lie before or after the recording and are left out"
        )
        recording.markers = recording.markers[inside].reset_index(drop=True)


def _places(recording: Recording, table: Path, system: Path) -> None:
    """Give EEG channels the places of electrodes.tsv, where its system of coordinates is known."""
    import mne

    try:
        about: dict[str, Any] = dict(json.loads(system.read_text(encoding="utf-8")))
    except (ValueError, TypeError) as error:
        raise DataError(f"{system.name} is no JSON object: {error}", cure="write it as BIDS has it") from error
    name, scale = str(about.get("EEGCoordinateSystem")), _LENGTHS.get(str(about.get("EEGCoordinateUnits")))
    marks = about.get("AnatomicalLandmarkCoordinates") or {}
    landmarks = {ours: marks.get(theirs) for ours, theirs in (("nasion", "NAS"), ("lpa", "LPA"), ("rpa", "RPA"))}
    known = all(isinstance(one, list) and len(one) == 3 for one in landmarks.values())
    if scale is None or not (known or name == "CapTrak"):
        recording.notes.append(
            f"{table.name}: places in {name} ({about.get('EEGCoordinateUnits')}) without landmarks are not used"
        )
        return

    def turned(place: Any) -> np.ndarray:
        x, y, z = np.asarray(place, float) * scale
        return np.array([-y, x, z]) if name in _NOSE_FIRST else np.array([x, y, z])

    places = {}
    for row in read_rows(table):
        cells = [row.get(axis, "n/a") for axis in "xyz"]
        if any(cell.lower() in NO_NUMBER for cell in cells):
            continue
        try:
            places[row.get("name", "")] = turned(cells)
        except ValueError as error:
            raise DataError(
                f"{table.name}: {', '.join(cells)} of {row.get('name')} is no place",
                cure="write x, y and z as numbers, or n/a",
            ) from error
    # CapTrak is defined as MNE's head: origin between the ears, x through them, y through the nose.
    frame = "head" if name == "CapTrak" else "unknown"
    fixed: dict[str, Any] = {one: turned(place) for one, place in landmarks.items()} if known else {}
    montage: mne.channels.DigMontage = mne.channels.make_dig_montage(places, coord_frame=frame, **fixed)
    recording.montage = montage


def _reference(files: Mapping[str, Path]) -> str:
    """Return what the first recording's sidecar says of its reference; empty where it says nothing."""
    try:
        stated = json.loads(files["sidecar"].read_text(encoding="utf-8")).get("EEGReference")
    except (KeyError, OSError, ValueError, AttributeError):
        return ""
    return stated if isinstance(stated, str) and stated.lower() != "n/a" else ""


def _root(table: Path) -> Path:
    return next((one for one in table.absolute().parents if (one / "dataset_description.json").is_file()), table.parent)
