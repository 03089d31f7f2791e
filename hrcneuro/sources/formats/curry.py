"""Curry of Compumedics Neuroscan: ``.cdt`` (Curry 8, 9) and ``.dat`` (Curry 7), read by MNE and their curryreader."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.errors import DataError
from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.formats.curry_names import beside, parameter_file
from hrcneuro.sources.formats.extras import needed
from hrcneuro.sources.formats.reading import complaints, marks_of, read_raw, sort_marks
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.units import voltage_unit

if TYPE_CHECKING:
    import mne

_OF_MNE = ("uV", "V")  # what MNE scales, and what needs none


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    import mne

    needed("curryreader", "Curry")
    _check(path)
    # curryreader would set up logging for the whole program, and write to the terminal.
    with complaints("") as said:
        recording = read_raw(
            path,
            lambda: mne.io.read_raw_curry(path, preload=False, verbose="warning"),
            finish=lambda raw, recording: _finish(raw, recording, path),
            dealt_with=("no event annotations found",),
        )
    recording.notes += [f"{path.name}: {text}" for text in dict.fromkeys(said)]
    return recording


def _finish(raw: mne.io.BaseRaw, recording: Recording, path: Path) -> None:
    """Scale channels in units that MNE takes for volts (mV, nV), and place the marks."""
    for i, unit in enumerate(recording.units):
        known = voltage_unit(unit)
        if known and known not in _OF_MNE:
            recording.data[i] *= VOLTS[known]
            recording.units[i] = known
    marks, remarks = marks_of(raw), _remarks(path)
    if len(remarks) == len(marks):
        # MNE gives all events of a type the words of the first.
        marks = [(at, lasts, own or text) for (at, lasts, text), own in zip(marks, remarks, strict=True)]
    sort_marks(recording, marks)


def _remarks(path: Path) -> list[str]:
    """Return what the file of events says of each, in order of time; none where there is no such file."""
    files = beside(path)
    for label in ("cef", "ceo"):
        if label in files:
            text = files[label].read_text(encoding="utf-8", errors="replace")
            found = [
                re.search(rf"{name} START_LIST[^\n]*\n(.*?){name} END_LIST", text, re.DOTALL)
                for name in ("NUMBER_LIST", "REMARK_LIST")
            ]
            rows, words = (one[1].strip("\n").splitlines() if one else [] for one in found)
            if len(rows) == len(words):
                return [word.strip() for _, word in sorted(zip(rows, words, strict=True), key=_sample)]
    return []


def _sample(event: tuple[str, str]) -> int:
    return int(event[0].split()[0])


def _check(path: Path) -> None:
    parameters = parameter_file(path)
    if parameters is None:
        raise DataError(
            f"{path.name} needs its parameters beside it ({path.name}.dpa or .dpo, of Curry 7 {path.stem}.dap)",
            cure="copy all files of the recording into one folder",
        )
    text = parameters.read_text(encoding="utf-8", errors="replace")
    samples, channels, trials = (_number(text, name) for name in ("NumSamples", "NumChannels", "NumTrials"))
    if trials > 1:
        raise DataError(
            f"{path.name} holds {trials} epochs, not a continuous recording",
            cure="export the recording before it was cut into epochs",
        )
    size, ascii_ = path.stat().st_size, re.search(r"DataFormat\s*=\s*ASCII", text)
    if not ascii_ and samples > 0 and size < 4 * samples * channels:
        raise DataError(
            f"{path.name} announces {samples} samples of {channels} channels, {4 * samples * channels} bytes; it has "
            f"{size}: it is truncated",
            cure="copy or download the file again; one that Curry compressed, export from there as raw float",
        )


def _number(text: str, name: str) -> int:
    found = re.search(rf"{name}\s*=\s*(-?\d+)", text)
    return int(found[1]) if found else 0
