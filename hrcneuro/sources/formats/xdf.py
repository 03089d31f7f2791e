"""XDF, the file of LabRecorder: streams with clocks of their own, brought onto the samples of the EEG stream."""

from __future__ import annotations

import contextlib
import gzip
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.channels import VOLTS
from hrcneuro.sources.recording import CHANNEL_TYPES, Recording, markers_of

_GZIP = b"\x1f\x8b"
_UNITS = {"microvolts": "uV", "uv": "uV", "millivolts": "mV", "mv": "mV", "volts": "V", "v": "V"}


def read(path: Path, *, stream: str = "") -> Recording:
    """Return the EEG stream of an XDF file, with the markers of every marker stream on its samples.

    The sampling rate is the nominal one; onsets are placed by the synchronised clocks, so that a clock that runs
    fast or slow moves no marker. A gap in the stream becomes a break.

    Raises:
        ConfigError: pyxdf is not installed, or the stream to use is not clear.
        DataError: The file holds no such stream or cannot be read.
    """
    try:
        import pyxdf
    except ImportError as error:
        raise ConfigError(
            "reading XDF needs pyxdf, which is not installed", cure="pip install 'hrcneuro[xdf]'"
        ) from error
    with _complaints() as notes, _opened(path) as file:
        try:
            streams, _ = pyxdf.load_xdf(file, verbose=False)
        except Exception as error:
            # pyxdf raises whatever a damaged chunk leads to; for a person it is one thing.
            raise DataError(f"{path.name} cannot be read as XDF: {error}", cure="copy the recording again") from error
    signals = [s for s in streams if _rate(s) > 0 and len(s["time_stamps"]) > 1]
    eeg = _choose(signals, stream, path)
    recording = _signals(eeg, path)
    marks = [s for s in streams if _rate(s) == 0 and (_info(s, "type") == "Markers" or _is_text(s))]
    _place(recording, eeg["time_stamps"], marks)
    recording.breaks_s = [start / recording.sfreq for start, _ in eeg["info"]["segments"] if start > 0]
    recording.notes += notes
    recording.notes.append(
        f"stream {_info(eeg, 'name')!r}: {len(eeg['time_stamps'])} samples at {recording.sfreq:g} Hz "
        f"(measured {float(eeg['info']['effective_srate']):.3f} Hz); marker streams: "
        + (", ".join(_info(s, "name") for s in marks) or "none")
    )
    return recording


def _opened(path: Path) -> BinaryIO:
    # Opened here, since pyxdf leaves a file open that it refuses.
    file: BinaryIO = path.open("rb")
    if file.read(2) == _GZIP:
        file.close()
        return cast("BinaryIO", gzip.open(path, "rb"))
    file.seek(0)
    return file


@contextlib.contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collect what pyxdf logs of damaged chunks, which it skips, instead of showing it on the terminal."""
    notes: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: notes.append(f"pyxdf: {record.getMessage()}")  # type: ignore[method-assign]
    logger = logging.getLogger("pyxdf")
    before, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield notes
    finally:
        logger.removeHandler(handler)
        logger.propagate = before


def _choose(signals: list[dict[str, Any]], wanted: str, path: Path) -> dict[str, Any]:
    names = [_info(s, "name") for s in signals]
    if wanted:
        hits = [s for s in signals if _info(s, "name") == wanted]
        if not hits:
            raise ConfigError(
                f"{path.name} has no regular stream {wanted!r}{did_you_mean(wanted, names)}; it has "
                f"{', '.join(names) or 'none'}",
                cure="correct acquire.stream",
            )
        return hits[0]
    eeg = [s for s in signals if _info(s, "type").upper() == "EEG"] or signals
    if not eeg:
        raise DataError(f"{path.name} holds no regularly sampled stream", cure="record the EEG stream too")
    if len(eeg) > 1:
        raise ConfigError(
            f"{path.name} holds {len(eeg)} streams that may be the EEG: {', '.join(_info(s, 'name') for s in eeg)}",
            cure=f"name one: acquire.stream = {_info(eeg[0], 'name')!r}",
        )
    return eeg[0]


def _signals(stream: dict[str, Any], path: Path) -> Recording:
    """Return the stream's samples in volts, with the labels, types and units of its description."""
    values = np.asarray(stream["time_series"], float).T
    about = _channels(stream)
    if len(about) != len(values):
        about = [{} for _ in values]
    names = [one.get("label") or f"EEG{i + 1:03d}" for i, one in enumerate(about)]
    names = [n if names.count(n) == 1 else f"{n}-{names[:i].count(n)}" for i, n in enumerate(names)]
    kinds = [one.get("type", "eeg").lower() for one in about]
    units = [_UNITS.get(one.get("unit", "microvolts").lower(), "uV") for one in about]
    types = [k if k in CHANNEL_TYPES else "misc" for k in kinds]
    for row, unit, kind in zip(values, units, types, strict=True):
        row *= 1.0 if kind == "stim" else VOLTS[unit]
    recording = Recording(values, names, types, _rate(stream), markers_of([], []), units=units)
    if not _channels(stream):
        recording.notes.append(f"{path.name} names no channels: they are called EEG001 …, in microvolts")
    return recording


def _place(recording: Recording, stamps: np.ndarray, marks: list[dict[str, Any]]) -> None:
    """Put each marker at its place among the samples; markers outside the stream are left out."""
    times = np.concatenate([np.asarray(s["time_stamps"], float) for s in marks] or [np.zeros(0)])
    texts = [str(value[0]).removesuffix(".0") for s in marks for value in s["time_series"]]
    period = 1 / recording.sfreq
    inside = (times >= stamps[0] - period) & (times <= stamps[-1] + period)
    at = np.interp(times[inside], stamps, np.arange(len(stamps)))
    recording.markers = markers_of(at * period, [text for text, keep in zip(texts, inside, strict=True) if keep])
    if not inside.all():
        recording.notes.append(f"{int((~inside).sum())} markers lie before or after the EEG stream and are left out")


def _channels(stream: dict[str, Any]) -> list[dict[str, str]]:
    """Return the description of each channel as plain strings; an empty list where there is none."""
    try:
        channels = stream["info"]["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        return []
    return [{key: value[0] for key, value in one.items() if value and isinstance(value[0], str)} for one in channels]


def _info(stream: dict[str, Any], key: str) -> str:
    return str((stream["info"].get(key) or [""])[0] or "")


def _rate(stream: dict[str, Any]) -> float:
    return float(_info(stream, "nominal_srate") or 0)


def _is_text(stream: dict[str, Any]) -> bool:
    return _info(stream, "channel_format") == "string"
