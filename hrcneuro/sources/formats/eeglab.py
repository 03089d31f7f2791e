"""EEGLAB: a MATLAB file (``.set``), its samples inside or in a ``.fdt`` beside it.

The structure is read here, as EEGLAB's own ``eeg_checkset`` and ``pop_loadset`` take it: scripts write it in forms that
no other reader expects (no channel information, one event, empty fields).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.sources.formats.eeglab_names import data_files
from hrcneuro.sources.formats.reading import read_raw
from hrcneuro.sources.kinds import kind_of_type, numbered
from hrcneuro.sources.pointers import refuse_pointer
from hrcneuro.sources.recording import Recording

if TYPE_CHECKING:
    import mne

_VALUE_BYTES = 4
_MICRO = 1e-6
_BOUNDARY = -99.0  # where all types are numbers


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    notes: list[str] = []
    return read_raw(path, lambda: _open(path, notes), notes=notes)


def _open(path: Path, notes: list[str]) -> mne.io.BaseRaw:
    import mne
    from pymatreader import read_mat

    content = read_mat(path)
    if "ALLEEG" in content:
        raise DataError(
            f"{path.name} holds several data sets (ALLEEG)", cure="save each as a file of its own in EEGLAB"
        )
    eeg = content.get("EEG", content)
    _refuse_epochs(eeg, path)
    data = _data(eeg, path, notes)
    names, kinds, places = _channels(eeg, len(data), path, notes)
    data[[kind != "stim" for kind in kinds]] *= _MICRO
    raw = mne.io.RawArray(
        data, mne.create_info(names, float(_number(eeg, "srate", path)), kinds), copy="auto", verbose="error"
    )
    if places is not None:
        raw.set_montage(_montage(raw.ch_names, places))
    raw.set_annotations(_annotations(eeg, raw.info["sfreq"], notes))
    return raw


def _number(eeg: Mapping[str, Any], key: str, path: Path) -> float:
    value = np.asarray(eeg.get(key, [])).ravel()
    if value.size != 1 or not np.issubdtype(value.dtype, np.number) or not np.isfinite(value[0]):
        raise DataError(
            f"{path.name} has no number in EEG.{key}", cure="check that it is a data set of EEGLAB, saved by it"
        )
    return float(value[0])


def _refuse_epochs(eeg: Mapping[str, Any], path: Path) -> None:
    trials = np.asarray(eeg.get("trials", 1)).ravel()
    if trials.size and trials[0] > 1:
        raise DataError(
            f"{path.name} holds {int(trials[0])} epochs, not a recording", cure="save it before it is cut into epochs"
        )


def _data(eeg: Mapping[str, Any], path: Path, notes: list[str]) -> np.ndarray:
    """Return the samples as they stand, shape (n_channels, n_times); refuse what contradicts the header."""
    channels, samples = (int(_number(eeg, key, path)) for key in ("nbchan", "pnts"))
    if isinstance(eeg.get("data"), str):
        return _data_file(path, channels, samples, notes)
    data = np.array(eeg.get("data", []), dtype=float)
    data = data.reshape(1, -1) if channels == 1 else data
    if data.shape != (channels, samples):
        raise DataError(
            f"{path.name} announces {channels} channels × {samples} samples and holds {data.shape} values",
            cure="load and save it in EEGLAB, whose eeg_checkset sets them right",
        )
    return data


def _data_file(path: Path, channels: int, samples: int, notes: list[str]) -> np.ndarray:
    files = data_files(path)
    if files.data is None:
        raise DataError(
            f"{path.name} names a data file that is not there: {files.name}",
            cure=f"put it beside {path.name} (git lfs pull, where the repository uses LFS)",
        )
    if files.data.name != files.name:
        notes.append(f"samples come from {files.data.name}, by the name of {path.name}; inside stands {files.name}")
    if files.spare is not None:
        notes.append(f"{files.spare.name} is not read")
    refuse_pointer(files.data)
    _check_size(files.data, path, channels, samples)
    values = np.fromfile(files.data, "<f4")
    # The older .dat has the channels one after the other.
    by_time = files.data.suffix.lower() != ".dat"
    data: np.ndarray = values.reshape(samples, channels).T if by_time else values.reshape(channels, samples)
    return np.ascontiguousarray(data, dtype=float)


def _check_size(data: Path, path: Path, channels: int, samples: int) -> None:
    """Refuse a data file whose size contradicts the header."""
    wanted, got = samples * channels * _VALUE_BYTES, data.stat().st_size
    if got != wanted:
        raise DataError(
            f"{data.name} has {got} bytes; {path.name} announces {channels} channels × {samples} samples × "
            f"{_VALUE_BYTES} bytes = {wanted}: it is {'truncated' if got < wanted else 'too long'}",
            cure="copy or download both files again; they must come from the same saving",
        )


def _channels(
    eeg: Mapping[str, Any], count: int, path: Path, notes: list[str]
) -> tuple[list[str], list[str], np.ndarray | None]:
    """Return names, types and, where there are some, positions in m: x to the right ear, y to the nose."""
    rows = _records(eeg.get("chanlocs"), "labels")
    if not rows:
        notes.append(f"{path.name} names no channels: they are called EEG 000 …")
        return [f"EEG {i:03d}" for i in range(count)], ["eeg"] * count, None
    if len(rows) != count:
        raise DataError(
            f"{path.name} describes {len(rows)} channels (EEG.chanlocs) and has {count}",
            cure="load and save it in EEGLAB, whose eeg_checkset sets them right",
        )
    names = numbered([_word(row["labels"]) or f"EEG {i:03d}" for i, row in enumerate(rows)], notes)
    kinds = _kinds([_word(row.get("type")) for row in rows], names, notes)
    # EEGLAB's x points to the nose, its y to the left ear.
    places = np.array([[-_coordinate(row, "Y"), _coordinate(row, "X"), _coordinate(row, "Z")] for row in rows])
    known = np.isfinite(places).all(axis=1)
    if not known.any():
        return names, kinds, None
    radius = float(np.linalg.norm(places[known], axis=1).mean())
    # A head has 5 to 11 cm: metres, decimetres (a sphere of radius one), centimetres or millimetres.
    unit_m = next(unit for unit, most in ((1.0, 0.25), (0.1, 2.5), (0.01, 25.0), (0.001, np.inf)) if radius < most)
    return names, kinds, places * unit_m


def _kinds(words: list[str], names: list[str], notes: list[str]) -> list[str]:
    kinds = []
    for word, name in zip(words, names, strict=True):
        kind = kind_of_type(word)
        kinds.append(kind or "eeg")
        if kind == "misc":
            notes.append(f"channel {name} taken for misc by its type {word!r}")
        elif word and kind is None:
            notes.append(f"channel {name} taken for EEG: its type {word!r} is not known")
    return kinds


def _montage(names: list[str], places: np.ndarray) -> mne.channels.DigMontage:
    """Return the positions; ears and nose stand at the electrodes' mean distance on the axes, as MNE puts them."""
    import mne

    radius = float(np.nanmean(np.linalg.norm(places, axis=1)))
    return mne.channels.make_dig_montage(
        dict(zip(names, places, strict=True)),
        coord_frame="head",
        nasion=[0, radius, 0],
        lpa=[-radius, 0, 0],
        rpa=[radius, 0, 0],
    )


def _annotations(eeg: Mapping[str, Any], sfreq: float, notes: list[str]) -> mne.Annotations:
    import mne

    marks, lost, cut = [], 0, 0.0
    for event in _records(eeg.get("event"), "type"):
        at = _scalar(event.get("latency", event.get("sample")))
        text, duration = _word(event.get("type")), np.nan_to_num(_scalar(event.get("duration")))
        if not text or not np.isfinite(at):
            lost += 1
        elif text.lower() == "boundary" or text in (str(_BOUNDARY), f"{_BOUNDARY:.0f}"):
            cut += duration
            marks.append((at, 0.0, "EDGE boundary"))
        else:
            marks.append((at, duration, text))
    if lost:
        notes.append(f"events without a type or a latency left out: {lost}")
    if cut:
        notes.append(f"{cut / sfreq:.1f} s were cut out of the recording, at its boundaries")
    # Latencies count samples from one.
    onsets = [(at - 1) / sfreq for at, _, _ in marks]
    return mne.Annotations(onsets, [d / sfreq for _, d, _ in marks], [text for _, _, text in marks])


def _records(value: Any, key: str) -> list[Mapping[str, Any]]:
    """Return the elements of a structure array that has ``key``: many come as lists by field, one as plain fields."""
    if isinstance(value, list):
        return [one for one in value if isinstance(one, Mapping)]
    if not isinstance(value, Mapping) or key not in value:
        return []
    lists = {name: column for name, column in value.items() if isinstance(column, list)}
    if key not in lists:
        return [value]
    return [{name: column[i] for name, column in lists.items()} for i in range(len(lists[key]))]


def _word(value: Any) -> str:
    """Return a field as text: empty where it is empty, a whole number without decimals."""
    if value is None or np.size(value) == 0:
        return ""
    one = value if isinstance(value, str) else np.asarray(value).ravel()[0]
    if isinstance(one, np.floating | float) and float(one).is_integer():
        one = int(one)
    return str(one).strip()


def _coordinate(row: Mapping[str, Any], key: str) -> float:
    return _scalar(row.get(key))


def _scalar(value: Any) -> float:
    """Return a field as a number, NaN where it is empty or none."""
    try:
        numbers = np.asarray(value, float).ravel()
    except (TypeError, ValueError):
        return np.nan
    return float(numbers[0]) if numbers.size else np.nan
