"""BCI2000's ``.dat``: a header in words, then samples, each followed by the states of the system.

Read here, not by MNE, whose reader (1.13) keeps neither the channels' names nor the header's gains and offsets, and of
all states only one. Layout and calibration, (number − offset) · gain in µV: BCI2000 wiki, "User Reference: BCI2000 File
Format".
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.kinds import numbered
from hrcneuro.sources.recording import Recording, markers_of
from hrcneuro.sources.units import voltage_unit

_TYPES = {"int16": "<i2", "int32": "<i4", "float32": "<f4"}
# States that count time: no marker.
_CLOCKS = ("SourceTime", "StimulusTime", "KeystrokeTime")


@dataclass(frozen=True)
class _Header:
    size: int
    channels: int
    state_bytes: int
    type: np.dtype
    states: dict[str, tuple[int, int]]  # name -> bits, first bit of the vector
    parameters: dict[str, list[str]]


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`.

    A state that changes becomes a trigger channel of its name.
    """
    header = _header(path)
    each = header.channels * header.type.itemsize + header.state_bytes
    rows = np.memmap(path, np.uint8, "r", header.size)
    count, rest = divmod(len(rows), each)
    frames = rows[: count * each].reshape(count, each)
    notes = [f"{path.name} ends within a sample: {rest} bytes are left out"] if rest else []
    width = header.channels * header.type.itemsize
    values = np.ascontiguousarray(frames[:, :width]).view(header.type).reshape(count, -1).T.astype(float)
    data, units = _calibrated(values, header, path)
    names = numbered(_names(header), notes)
    states, still = _states(np.ascontiguousarray(frames[:, width:]), header)
    if still:
        notes.append(f"states that never change, or count time, left out: {', '.join(still)}")
    data = np.concatenate([data, *(row[None] for row in states.values())])
    kinds = ["eeg"] * len(names) + ["stim"] * len(states)
    recording = Recording(data, [*names, *states], kinds, _rate(header, path), markers_of([], []))
    recording.units = units + [""] * len(states)
    recording.notes = notes
    return recording


def _header(path: Path) -> _Header:
    with path.open("rb") as file:
        first = file.readline(1000).decode("latin-1")
        words = dict(re.findall(r"(\w+)\s*=\s*(\S+)", first))
        try:
            size = int(words["HeaderLen"])
            counts = int(words["SourceCh"]), int(words["StatevectorLen"])
        except (KeyError, ValueError) as error:
            raise DataError(
                f"{path.name} is no recording of BCI2000: its first line does not state HeaderLen, SourceCh and "
                "StatevectorLen",
                cure="name another file; of Curry 7, the .dap file belongs beside its .dat",
            ) from error
        text = file.read(max(size - file.tell(), 0)).decode("latin-1")
    form = words.get("DataFormat", "int16")
    if form not in _TYPES or path.stat().st_size < size:
        problem = f"samples of type {form}" if form not in _TYPES else "less than its own header"
        raise DataError(f"{path.name} holds {problem}", cure="copy the file again")
    states, parameters, section = {}, {}, ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("["):
            section = line
        elif "State" in section and len(parts := line.split()) >= 5 and all(p.lstrip("-").isdigit() for p in parts[1:]):
            states[parts[0]] = int(parts[1]), 8 * int(parts[3]) + int(parts[4])
        elif "Parameter" in section and "=" in line:
            left, _, right = line.partition("=")
            kind, name = (["", *left.split()])[-2:]
            parameters[name] = _value(kind, right.partition("//")[0].split())
    return _Header(size, *counts, np.dtype(_TYPES[form]), states, parameters)


def _value(kind: str, words: list[str]) -> list[str]:
    """Return the value of a parameter; a list begins with its length, and limits follow."""
    if kind.endswith("list"):
        count = words[0] if words else "0"
        return words[1 : 1 + int(count)] if count.isdigit() else _labelled(words)
    return words[:1]


def _labelled(words: list[str]) -> list[str]:
    """Return the values of a list whose places have names: ``{ a b } 1 2``."""
    end = words.index("}") if "}" in words else -1
    return words[end + 1 : end + 1 + max(end - 1, 0)]


def _rate(header: _Header, path: Path) -> float:
    found = re.match(r"[\d.]+", (header.parameters.get("SamplingRate") or [""])[0])
    if found is None or not float(found[0]):
        raise DataError(f"{path.name} states no sampling rate", cure="save it with BCI2000's own tools again")
    return float(found[0])


def _names(header: _Header) -> list[str]:
    names = header.parameters.get("ChannelNames", [])
    return names if len(names) == header.channels else [f"EEG{i + 1}" for i in range(header.channels)]


def _calibrated(values: np.ndarray, header: _Header, path: Path) -> tuple[np.ndarray, list[str]]:
    """Return volts and the units that the header's gains are in; without a unit microvolts."""
    gains, offsets = (header.parameters.get(name, []) for name in ("SourceChGain", "SourceChOffset"))
    if len(gains) != len(values) or len(offsets) != len(values):
        raise DataError(
            f"{path.name} has {len(values)} channels, {len(gains)} gains and {len(offsets)} offsets",
            cure="save it with BCI2000's own tools again",
        )
    units = []
    for row, gain, offset in zip(values, gains, offsets, strict=True):
        number, unit = _number(gain)
        row -= _number(offset)[0]
        row *= number * VOLTS[unit]
        units.append(unit)
    return values, units


def _number(text: str) -> tuple[float, str]:
    hit = re.match(r"([-+\d.eE]+)(.*)", text)
    try:
        return float(hit[1] if hit else text), voltage_unit(hit[2] if hit and hit[2] else "uV") or "uV"
    except ValueError as error:
        raise DataError(f"{text!r} is no number for a gain or an offset", cure="correct the header") from error


def _states(rows: np.ndarray, header: _Header) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the states that change as rows of codes, and the names of the rest.

    Args:
        rows: ndarray, shape (n_times, state_bytes), uint8.
        header: Where each state lies.
    """
    bits = np.unpackbits(rows, axis=1, bitorder="little")
    found, still = {}, []
    for name, (length, first) in header.states.items():
        values = bits[:, first : first + length].astype(np.int64) @ (1 << np.arange(min(length, bits.shape[1] - first)))
        if name in _CLOCKS or not len(values) or (values == values[0]).all():
            still.append(name)
        else:
            found[name] = values.astype(float)
    return found, still
