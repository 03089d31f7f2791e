"""XDF, the file of LabRecorder: streams with clocks of their own, brought onto the samples of the EEG stream."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.eeg import stamps as timestamps
from hrcneuro.errors import DataError
from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.formats.extras import needed
from hrcneuro.sources.formats.packed import unpacked
from hrcneuro.sources.formats.reading import complaints, marker_name
from hrcneuro.sources.formats.xdf_streams import (
    NoSamples,
    choose_eeg,
    in_order,
    info,
    left_aside,
    marker_streams,
    rate_of,
    recorded_gaps,
)  # fmt: skip
from hrcneuro.sources.kinds import kind_of_type, numbered
from hrcneuro.sources.recording import Recording, markers_of
from hrcneuro.sources.units import is_no_voltage, voltage_unit

_SHORT_S = 0.05


def read(path: Path, *, stream: str = "", stream_rate: str = "nominal", rate_tolerance: float = 0.01) -> Recording:
    """Return the EEG stream of an XDF file, with the markers of every marker stream on its samples.

    Onsets are placed by the synchronised clocks, so that a clock that runs fast or slow moves no marker. A gap in the
    stream becomes a break.

    Args:
        path: The file, packed by gzip or not.
        stream: The EEG stream's name, ``name#2`` for the second one of that name, or its source id.
        stream_rate: ``nominal``: the sampling rate that the stream states; ``measured``: by the clock.
        rate_tolerance: By how much, as a share, the two may differ before the nominal one is refused.

    Raises:
        ConfigError: pyxdf is not installed, or the stream to use is not clear.
        DataError: The file holds no such stream, lost some of it, cannot be read, or its rate is not as stated.
    """
    streams, notes = load(path)
    eeg, said = choose_eeg(streams, stream, path.name)
    aside = left_aside(eeg, streams)
    notes += said + _missing(eeg, path)
    if (ordered := in_order(eeg)) is not eeg:
        notes.append(f"stream {info(eeg, 'name')!r}: chunks that came behind younger ones are put in their places")
    streams = [one for one in streams if one is not eeg]
    eeg = ordered
    stamps = np.asarray(eeg["time_stamps"], float)
    if not np.isfinite(stamps).all():
        raise DataError(f"{path.name}: stream {info(eeg, 'name')!r} has time stamps that are no numbers")
    streams, gaps_known = recorded_gaps(streams, stamps)
    parts = timestamps.segments(stamps, rate_of(eeg) or 1 / float(np.median(np.diff(stamps))), gaps_known)
    times, measured = timestamps.steady(stamps, parts)
    sfreq = _sfreq(eeg, measured, stream_rate, rate_tolerance, path)
    recording = _signals(eeg, sfreq, notes)
    notes.append(
        f"stream {info(eeg, 'name')!r}: {len(stamps)} samples at {sfreq:g} Hz "
        f"(nominal {rate_of(eeg):g}, measured {measured:.3f} Hz)"
    )
    recording.breaks_s = [start / sfreq for start, _ in parts[1:]]
    if len(parts) > 1:
        gaps = [float(times[start] - times[start - 1]) for start, _ in parts[1:]]
        lengths = (f"{1e3 * one:.0f} ms" if one < _SHORT_S else f"{one:.1f} s" for one in (sum(gaps), max(gaps)))
        notes.append(f"gaps without samples: {len(gaps)}, {' in all, '.join(lengths)} at most")
    marks, left = marker_streams(streams)
    _place(recording, marks, times, parts, notes)
    notes.append("marker streams: " + (", ".join(info(s, "name") for s in marks) or "none"))
    recording.warnings += aside
    recording.warnings += [
        f"the clock of stream {info(one, 'name')!r} was never compared with the recorder's: its stamps are taken as "
        "they came, and what has another clock may lie anywhere"
        for one in [eeg, *marks]
        if len(one["time_stamps"]) and not len(one.get("clock_times", ()))
    ]
    if left:
        notes.append(f"streams of other kinds, not read: {', '.join(info(s, 'name') for s in left)}")
    recording.notes = notes
    return recording


def load(path: Path) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the streams of a file, their stamps on the recorder's clock, and what pyxdf said of it.

    Raises:
        ConfigError: pyxdf is not installed.
        NoSamples: The file is empty.
        DataError: It cannot be read.
    """
    if not path.stat().st_size:
        raise NoSamples(f"{path.name} is empty", cure="copy the recording again")
    streams, said = _loaded(path)
    # Clocks that were set anew are dealt with here by the gaps that they leave.
    return streams, [f"pyxdf: {text}" for text in said if "clock-segments differ" not in text]


def as_sent(path: Path, ids: list[int]) -> list[dict[str, Any]]:
    """Return some streams of a file, their stamps on the clocks of their senders.

    Raises:
        ConfigError: pyxdf is not installed.
        DataError: It cannot be read.
    """
    return _loaded(path, select_streams=ids, synchronize_clocks=False)[0]


def _loaded(path: Path, **how: Any) -> tuple[list[dict[str, Any]], list[str]]:
    pyxdf = needed("pyxdf", "XDF", extra="xdf")
    with complaints("pyxdf") as said, unpacked(path) as file:
        try:
            streams, _ = pyxdf.load_xdf(file, dejitter_timestamps=False, verbose=False, **how)
        except Exception as error:
            # pyxdf raises whatever a damaged chunk leads to; for a person it is one thing.
            raise DataError(f"{path.name} cannot be read as XDF: {error}", cure="copy the recording again") from error
    return streams, said


def _missing(stream: dict[str, Any], path: Path) -> list[str]:
    """Refuse a stream that has fewer samples than its footer counts; where no footer counts them, a note says so."""
    footer = ((stream.get("footer") or {}).get("info") or {}).get("sample_count") or [None]
    count, name = len(stream["time_stamps"]), info(stream, "name")
    if footer[0] is None:
        return [
            f"stream {name!r} has no end mark with a count of its samples: the recorder was stopped before it wrote "
            "one, or the file is truncated; how much is missing, if anything, is not known"
        ]
    if count < int(footer[0]):
        raise DataError(
            f"{path.name}: stream {name!r} holds {count} of {footer[0]} samples: the file is damaged",
            cure="copy or download it again",
        )
    return []


def _sfreq(stream: dict[str, Any], measured: float, which: str, tolerance: float, path: Path) -> float:
    nominal = rate_of(stream)
    if measured <= 0:
        raise DataError(
            f"{path.name}: the time stamps of stream {info(stream, 'name')!r} do not go forward, so that nothing can "
            "be placed on its samples",
            cure="record again, with a clock that runs",
        )
    if which == "measured":
        return measured
    if nominal == 0:
        raise DataError(
            f"{path.name}: stream {info(stream, 'name')!r} states no sampling rate; measured {measured:.3f} Hz",
            cure="acquire.stream_rate = 'measured' takes that one",
        )
    if abs(measured / nominal - 1) > tolerance:
        raise DataError(
            f"{path.name}: stream {info(stream, 'name')!r} states {nominal:g} Hz and came at {measured:.3f} Hz, "
            f"{100 * abs(measured / nominal - 1):.1f} % off; allowed: {100 * tolerance:g} % (acquire.rate_tolerance)",
            cure="acquire.stream_rate = 'measured', where samples were taken at that rate; where some were lost, "
            "the recording cannot be timed",
        )
    return nominal


def _signals(stream: dict[str, Any], sfreq: float, notes: list[str]) -> Recording:
    """Return the samples in volts, with the labels, types and units of the stream's description."""
    values = np.asarray(stream["time_series"], float).T
    about = channels(stream)
    if len(about) != len(values):
        what = f"describes {len(about)} of its {len(values)} channels" if about else "names no channels"
        notes.append(f"stream {info(stream, 'name')!r} {what}: they are called EEG001 …, in microvolts")
        about = [{} for _ in values]
    names = numbered([one.get("label") or f"EEG{i + 1:03d}" for i, one in enumerate(about)], notes)
    kinds, units = [], []
    for row, name, one in zip(values, names, about, strict=True):
        kind, unit = _kind_and_unit(name, one, notes)
        kinds.append(kind)
        units.append(unit)
        row *= 1.0 if kind == "stim" else VOLTS.get(unit, 1.0)
    return Recording(values, names, kinds, sfreq, markers_of([], []), units=units)


def _kind_and_unit(name: str, about: dict[str, str], notes: list[str]) -> tuple[str, str]:
    """Return type and unit of a channel; without a word it is EEG in microvolts."""
    word, unit = about.get("type", "EEG"), about.get("unit", "")
    kind, volts = kind_of_type(word) or "misc", voltage_unit(unit or "uV")
    if kind != "stim" and kind_of_type(word) != kind:
        notes.append(f"channel {name} taken for misc by its type {word!r}")
    if volts is None and kind == "eeg" and is_no_voltage(unit):
        return kind, unit
    if volts is None and kind in ("eeg", "eog"):
        notes.append(f"channel {name}: unit {unit!r} is no voltage, taken for microvolts (acquire.unit sets another)")
        return kind, "uV"
    return kind, volts or unit


def _place(
    recording: Recording,
    marks: list[dict[str, Any]],
    times: np.ndarray,
    parts: list[tuple[int, int]],
    notes: list[str],
) -> None:
    """Put each marker at its place among the samples; where none was taken, it is left out."""
    when = np.concatenate([np.asarray(s["time_stamps"], float) for s in marks] or [np.zeros(0)])
    texts = [marker_name(str(value[0])) for s in marks for value in s["time_series"]]
    notes += [
        f"marker stream {info(stream, 'name')!r}: the first of its channels is taken for the marker"
        for stream in marks
        if len(stream["time_series"]) and len(stream["time_series"][0]) > 1
    ]
    said = np.array([text not in ("", "nan") for text in texts], dtype=bool)
    places = timestamps.samples_at(times, parts, when, 1 / recording.sfreq)
    placed = np.isfinite(places)
    use = placed & said
    names = [text for text, keep in zip(texts, use, strict=True) if keep]
    recording.markers = markers_of(places[use] / recording.sfreq, names)
    outside = ~placed & ((when < times[0]) | (when > times[-1]))
    if outside.any():
        notes.append(f"{int(outside.sum())} markers lie before or after the EEG stream and are left out")
    if lost := int((~placed & ~outside).sum()):
        notes.append(f"{lost} markers lie where samples are missing and are left out")
    if not said.all():
        notes.append(f"{int((~said).sum())} markers without a text are left out")


def channels(stream: dict[str, Any]) -> list[dict[str, str]]:
    """Return the description of each channel as plain strings; an empty list where there is none."""
    try:
        channels = stream["info"]["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        return []
    return [
        {key: value[0] for key, value in one.items() if value and isinstance(value[0], str)} for one in channels if one
    ]
