"""A recording as EEGLAB saves it: the header in ``.set``, the samples beside it in ``.fdt`` (single precision, µV)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hrcneuro.errors import ConfigError

if TYPE_CHECKING:
    import mne

Event = tuple[int | str, float, float]
"""Type (a number, or a word), onset in samples from the first one, duration in samples."""

TYPES = ("eeg", "eog", "ecg", "emg", "misc")
_CHUNK_S = 60.0
_MATLAB_TEXT = 116  # bytes of a MAT file that hold free text, by scipy with the date


def require_eeglabio() -> None:
    """Refuse to go on without the writer.

    Raises:
        ConfigError: eeglabio is not installed.
    """
    try:
        import eeglabio  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            "writing EEGLAB files needs eeglabio, which is not installed", cure="pip install 'hrcneuro[export]'"
        ) from error


def write_set(raw: mne.io.BaseRaw, events: list[Event], path: Path, *, comments: str) -> list[str]:
    """Write ``path`` (``.set``) and its ``.fdt``; return the channels left out, whose numbers are no voltages.

    The same recording gives the same bytes: neither date nor folder is kept.
    """
    picks = [i for i, kind in enumerate(raw.get_channel_types()) if kind in TYPES]
    _write_samples(raw, picks, path.with_suffix(".fdt"))
    header = _header(raw, picks, path)
    header |= {
        "setname": path.stem,
        "filename": path.name,
        "filepath": "",
        "data": f"{path.stem}.fdt",
        "datfile": f"{path.stem}.fdt",
        "comments": comments,
        "pnts": float(raw.n_times),
        "xmax": (raw.n_times - 1) / raw.info["sfreq"],
        "event": _events(events),
    }
    from scipy.io import savemat

    savemat(path, header, appendmat=False, oned_as="row")
    with path.open("r+b") as file:
        file.write(b"MATLAB 5.0 MAT-file, EEGLAB data set written by hrcneuro".ljust(_MATLAB_TEXT))
    return [raw.ch_names[i] for i in range(len(raw.ch_names)) if i not in picks]


def _header(raw: mne.io.BaseRaw, picks: list[int], path: Path) -> dict[str, Any]:
    """Return the header's variables as eeglabio writes them, for a recording of one sample.

    eeglabio keeps the samples in the header. EEGLAB itself saves them beside it, and so did the authors.
    """
    import eeglabio.raw
    from scipy.io import loadmat

    kinds = raw.get_channel_types()
    places = np.array([raw.info["chs"][i]["loc"][:3] for i in picks], float)
    known = np.isfinite(places).all(axis=1) & places.any(axis=1)
    # EEGLAB's X points to the nose, MNE's to the right ear; EEGLAB counts in millimetres.
    mm = 1000 * np.stack([places[:, 1], -places[:, 0], places[:, 2]], axis=1)
    eeglabio.raw.export_set(
        str(path),
        np.zeros((len(picks), 1)),
        raw.info["sfreq"],
        np.array([raw.ch_names[i] for i in picks], dtype=object),
        np.where(known[:, None], mm, 0.0),
        ch_types=np.array([kinds[i].upper() for i in picks], dtype=object),
    )
    header = {name: value for name, value in loadmat(path, appendmat=False).items() if not name.startswith("__")}
    for row, there in zip(header["chanlocs"].flat, known, strict=True):
        if not there:
            for name in row.dtype.names:
                if name not in ("labels", "type"):
                    row[name] = np.zeros((0, 0))
    return header


def _write_samples(raw: mne.io.BaseRaw, picks: list[int], path: Path) -> None:
    step = max(int(_CHUNK_S * raw.info["sfreq"]), 1)
    with path.open("wb") as file:
        for start in range(0, raw.n_times, step):
            volts = raw.get_data(picks=picks, start=start, stop=min(start + step, raw.n_times), verbose="error")
            # Sample by sample, all channels of one together.
            file.write(np.ascontiguousarray((volts * 1e6).T, dtype="<f4").tobytes())


def _events(events: list[Event]) -> np.ndarray:
    """Return EEGLAB's event structure; its latencies count from one and may fall between two samples."""
    table = np.zeros(len(events), dtype=[("type", object), ("latency", object), ("duration", object)])
    for row, (kind, onset, duration) in zip(table, sorted(events, key=lambda e: e[1]), strict=True):
        row["type"] = kind if isinstance(kind, str) else float(kind)
        row["latency"], row["duration"] = float(onset) + 1, float(duration)
    return table
