"""BrainVision: a header (``.vhdr``) that names a data file and a marker file.

The header is read here, by Brain Products' core data format 1.0, whatever its code page and spelling. MNE gets a plain
copy of it, with what was found for names and units, and reads the samples.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.errors import DataError
from hrcneuro.sources.channels import standard_sites
from hrcneuro.sources.formats import brainvision_text as text
from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.kinds import numbered
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.units import voltage_unit

if TYPE_CHECKING:
    import mne

_VALUE_BYTES = {"INT_16": 2, "INT_32": 4, "IEEE_FLOAT_32": 4}
_UNITS = {"uV": "µV", "mV": "mV", "nV": "nV", "V": "V"}
_HEAD_M = 0.095
_STRAY_S = 1.0
"""A marker this far behind the last sample is a slip of the recorder; one beyond it means that samples are missing."""

Sections = Mapping[str, Mapping[str, str]]


@dataclass
class _Channel:
    name: str
    resolution: str
    unit: str
    place: tuple[float, ...]
    """x, y, z in m; empty where the header has none, three zeros where it is not known."""
    is_voltage: bool


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    notes: list[str] = []
    return read_raw(path, lambda: _open(path, notes), notes=notes)


def _open(path: Path, notes: list[str]) -> mne.io.BaseRaw:
    import mne

    sections = text.read_sections(path)
    _refuse_cut_up(path, sections)
    files = text.named_files(path, sections)
    if files.data is None:
        raise DataError(
            f"{path.name} names a data file that is not there: {files.data_name or '(no DataFile= line)'}",
            cure=f"put it beside {path.name} (git lfs pull, where the repository uses LFS), "
            "or correct DataFile= in the header, where it was renamed",
        )
    channels = _channels(path, sections, notes)
    samples = _whole_samples(path, sections, files.data, len(channels), notes)
    raw = _raw(path, sections, files.data, channels, samples)
    _check_announced(path, sections, len(raw.times))
    _type(raw, channels, notes)
    if places := {one.name: one.place for one in channels if any(one.place)}:
        raw.set_montage(mne.channels.make_dig_montage(places, coord_frame="head"), on_missing="ignore", verbose="error")
    _mark(raw, path, sections, files, notes)
    return raw


def _value(path: Path, sections: Sections, section: str, key: str) -> str:
    value = sections.get(section.lower(), {}).get(key.lower(), "")
    if not value:
        raise DataError(
            f"{path.name} has no line {key}= under [{section}]",
            cure="the header is cut off or damaged: copy it again",
        )
    return value


def _refuse_cut_up(path: Path, sections: Sections) -> None:
    """Refuse what is no continuous recording: spectra, averages, epochs."""
    common = sections.get("common infos", {})
    segments = common.get("segmentationtype", "NOTSEGMENTED").upper()
    single = common.get("segmentdatapoints", "") == common.get("datapoints", " ")
    if common.get("datatype", "TIMEDOMAIN").upper() != "TIMEDOMAIN":
        what = f"DataType={common['datatype']}, no signal over time"
    elif common.get("averaged", "NO").upper() == "YES":
        what = "Averaged=YES, an average over epochs"
    elif segments != "NOTSEGMENTED" and not single:
        what = f"SegmentationType={segments}, epochs of {common.get('segmentdatapoints', 'some')} samples"
    else:
        return
    raise DataError(f"{path.name} holds {what}", cure="export the continuous recording, before it was cut into epochs")


def _channels(path: Path, sections: Sections, notes: list[str]) -> list[_Channel]:
    count = int(_value(path, sections, "Common Infos", "NumberOfChannels"))
    rows, places = sections.get("channel infos", {}), sections.get("coordinates", {})
    missing = [i for i in range(1, count + 1) if f"ch{i}" not in rows]
    if missing:
        raise DataError(
            f"{path.name} announces {count} channels and describes {count - len(missing)}; Ch{missing[0]} is missing",
            cure="the header is cut off or damaged: copy it again",
        )
    channels = [_channel(rows[f"ch{i}"], f"Ch{i}", places.get(f"ch{i}", "")) for i in range(1, count + 1)]
    for one, name in zip(channels, numbered([one.name for one in channels], notes), strict=True):
        one.name = name
    return channels


def _channel(row: str, number: str, place: str) -> _Channel:
    name, _, resolution, unit = (text.channel_fields(row) + [""] * 4)[:4]
    # The format's defaults: one microvolt.
    volts = voltage_unit(unit or "uV")
    return _Channel(
        name or number, resolution or "1", _UNITS[volts] if volts else unit, _place(place), volts is not None
    )


def _place(row: str) -> tuple[float, ...]:
    """Return x, y, z in m of radius, theta and phi, in mm and degrees; radius 1 stands for any head."""
    try:
        radius, theta, phi = (float(part) for part in row.split(","))
    except ValueError:
        return ()
    size = _HEAD_M if radius == 1 else radius / 1000
    theta, phi = math.radians(theta), math.radians(phi)
    return (size * math.sin(theta) * math.cos(phi), size * math.sin(theta) * math.sin(phi), size * math.cos(theta))


def _whole_samples(path: Path, sections: Sections, data: Path, channels: int, notes: list[str]) -> int | None:
    """Return how many whole samples the data file holds; None where its values are written as text."""
    if _value(path, sections, "Common Infos", "DataFormat").upper() != "BINARY":
        return None
    kind = _value(path, sections, "Binary Infos", "BinaryFormat")
    if kind not in _VALUE_BYTES:
        raise DataError(
            f"{path.name} has BinaryFormat={kind}; allowed: {', '.join(_VALUE_BYTES)}", cure="export it in one of these"
        )
    if path.suffix.lower() == ".ahdr":
        channels += 1  # its own recorder adds one that the header does not count
    size = _VALUE_BYTES[kind] * channels
    samples, rest = divmod(data.stat().st_size, size)
    if not rest:
        return samples
    problem = (
        f"{data.name} has {data.stat().st_size} bytes, no multiple of {channels} channels × {_VALUE_BYTES[kind]} "
        "bytes: it ends inside a sample, as where a copy or the recorder stopped"
    )
    if _value(path, sections, "Common Infos", "DataOrientation").upper() == "VECTORIZED":
        raise DataError(
            f"{problem}, and its channels stand one after the other", cure="copy or download the data file again"
        )
    notes.append(f"{problem}; the {samples} whole samples are read")
    return samples


def _check_announced(path: Path, sections: Sections, samples: int) -> None:
    announced = sections["common infos"].get("datapoints", "")
    if announced.isdigit() and int(announced) not in (0, samples):
        missing = int(announced) > samples
        raise DataError(
            f"{path.name} announces {announced} samples, its data file holds {samples}: "
            f"it is {'truncated' if missing else 'too long'}",
            cure="copy or download all files again; they must come from the same saving (where the data are right, "
            "delete the line DataPoints= in the header)",
        )


def _raw(path: Path, sections: Sections, data: Path, channels: list[_Channel], samples: int | None) -> mne.io.BaseRaw:
    """Open the samples by MNE through a plain header, which is needed only until they are open."""
    import mne

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.with_suffix(path.suffix.lower()).name
        copy.write_text(_plain_header(path, sections, data.absolute(), channels, samples), encoding="utf-8")
        return mne.io.read_raw_brainvision(copy, preload=False, verbose="warning")


def _plain_header(path: Path, sections: Sections, data: Path, channels: list[_Channel], samples: int | None) -> str:
    common = {
        key: _value(path, sections, "Common Infos", key).upper()
        for key in ("DataFormat", "DataOrientation", "NumberOfChannels", "SamplingInterval")
    }
    lines = ["Brain Vision Data Exchange Header File Version 1.0", "[Common Infos]", "Codepage=UTF-8"]
    lines += [f"DataFile={data}", *(f"{key}={value}" for key, value in common.items())]
    if samples is not None:
        lines += [f"DataPoints={samples}", "[Binary Infos]"]
        lines += [f"BinaryFormat={_value(path, sections, 'Binary Infos', 'BinaryFormat')}"]
    else:
        ascii_infos = {"decimalsymbol": ".", "skiplines": "0", **sections.get("ascii infos", {})}
        lines += ["[ASCII Infos]", *(f"{key}={value}" for key, value in ascii_infos.items())]
    lines.append("[Channel Infos]")
    for i, one in enumerate(channels, start=1):
        name, unit = (value.replace(",", r"\1") for value in (one.name, one.unit))
        lines.append(f"Ch{i}={name},,{one.resolution},{unit}")
    return "\n".join(lines) + "\n"


def _type(raw: mne.io.BaseRaw, channels: list[_Channel], notes: list[str]) -> None:
    """Take channels for something else than EEG by their units, or where only they have no position, and say so."""
    other = [f"{one.name} ({one.unit})" for one in channels if not one.is_voltage]
    if other:
        notes.append(f"channels in units of no voltage taken for misc: {', '.join(other)}")
    placed = [any(one.place) for one in channels]
    if not any(placed):
        return
    scalp = {name.lower() for name in standard_sites()}
    lost = [
        name
        for name, kind, known in zip(raw.ch_names, raw.get_channel_types(), placed, strict=True)
        if kind == "eeg" and not known and name.lower() not in scalp and "EOG" not in name.upper()
    ]
    if lost:
        raw.set_channel_types(dict.fromkeys(lost, "misc"), verbose="error")
        notes.append(
            "channels without a position in a header that gives positions, and without a name of the 10-05 system, "
            f"taken for misc: {', '.join(lost)}"
        )


def _mark(raw: mne.io.BaseRaw, path: Path, sections: Sections, files: text.Files, notes: list[str]) -> None:
    """Put the markers of the marker file on the recording."""
    import mne

    notes += _which_markers(files)
    if files.markers is None:
        return
    marks, lost = text.read_markers(files.markers)
    if lost:
        notes.append(f"{files.markers.name}: {lost} lines that are no markers")
    sfreq, samples = float(raw.info["sfreq"]), len(raw.times)
    _refuse_missing(path, sections, [m.position for m in marks], samples, sfreq)
    # The first segment begins with the recording; its marker has the date.
    marks = [m for m in marks if m.kind != "New Segment" or m.position > 1]
    raw.set_annotations(
        mne.Annotations(
            [(m.position - 1) / sfreq for m in marks],
            # One sample long is what the format calls a point.
            [m.size / sfreq if m.size > 1 else 0.0 for m in marks],
            ["New Segment/" if m.kind == "New Segment" else f"{m.kind}/{m.text}" for m in marks],
        )
    )


def _which_markers(files: text.Files) -> list[str]:
    """Return a note where the markers come from another file than the header names, or more than one is there."""
    named = Path(files.marker_name.replace("\\", "/")).name
    if files.markers is None:
        return [f"the marker file {named}, which the header names, is not there: no markers"] if named else []
    if files.spare is not None:
        return [f"markers come from {files.markers.name}, which the header names; {files.spare.name} is not read"]
    if files.markers.name != named:
        return [f"markers come from {files.markers.name}: {named}, which the header names, is not there"]
    return []


def _refuse_missing(path: Path, sections: Sections, positions: list[int], samples: int, sfreq: float) -> None:
    """Refuse markers far behind the last sample where the header does not say how many there are."""
    beyond = [at for at in positions if at > samples + _STRAY_S * sfreq]
    if beyond and not sections["common infos"].get("datapoints", "").strip("0"):
        raise DataError(
            f"the data of {path.name} are truncated: they hold {samples / sfreq:.1f} s, and {len(beyond)} of "
            f"{len(positions)} markers lie behind that, the last one at {max(beyond) / sfreq:.1f} s",
            cure="copy or download the data file again (where no more was ever recorded, delete those markers)",
        )
