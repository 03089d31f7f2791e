"""Small BIDS data sets, written file by file as other programs leave them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from foreign import save_set

SFREQ = 128.0
NAMES = ("Fz", "Cz", "Pz", "C3", "C4", "P3", "P4", "O1", "O2", "EOG1")
SECONDS = 60.0


def oddball(seed: int, seconds: float = SECONDS) -> tuple[np.ndarray, list[tuple[str, float]]]:
    """Return an oddball in µV, shape (n_channels, n_times), and its events: a target is followed by a wave.

    The wave lasts from 250 to 450 ms and is 15 µV high.
    """
    rng = np.random.default_rng(seed)
    data = rng.normal(0, 8, (len(NAMES), int(seconds * SFREQ))).astype(np.float32)
    onsets = np.arange(2.0, seconds - 2, 1.1) + rng.uniform(0, 0.05, len(np.arange(2.0, seconds - 2, 1.1)))
    events = [("target" if i % 3 == 0 else "standard", float(np.round(at, 4))) for i, at in enumerate(onsets)]
    wave = 15 * np.hanning(int(0.2 * SFREQ))
    gain = np.array([0.3, 0.7, 1.0, 0.5, 0.5, 0.8, 0.8, 0.5, 0.5, 0.0])[:, None]
    for kind, at in events:
        if kind == "target":
            start = round((at + 0.25) * SFREQ)
            data[:, start : start + len(wave)] += (gain * wave).astype(np.float32)
    return data, events


def recording(root: Path, name: str, seed: int = 0, *, seconds: float = SECONDS, names: Sequence[str] = NAMES) -> Path:
    """Write one recording (EEGLAB) with its tables of channels and events; ``name`` is ``sub-01_ses-1_task-odd``."""
    parts = dict(part.split("-") for part in name.split("_"))
    home = root / f"sub-{parts['sub']}" / (f"ses-{parts['ses']}" if "ses" in parts else "") / "eeg"
    home.mkdir(parents=True, exist_ok=True)
    data, events = oddball(seed, seconds)
    save_set(home / f"{name}_eeg.set", data[: len(names)], names, SFREQ, [("x", 10)])
    kinds = ["EOG" if one.startswith("EOG") else "EEG" for one in names]
    table(home / f"{name}_channels.tsv", ["name", "type", "units"], [*zip(names, kinds, ["µV"] * 99, strict=False)])
    rows = [(at, 0, kind, i % 7) for i, (kind, at) in enumerate(events)]
    table(home / f"{name}_events.tsv", ["onset", "duration", "trial_type", "value"], rows)
    describe(root)
    return home / f"{name}_eeg.set"


def describe(root: Path, **more: object) -> None:
    """Write the data set's description."""
    about = {"Name": "an oddball", "BIDSVersion": "1.10.0", **more}
    (root / "dataset_description.json").write_text(json.dumps(about))


def table(path: Path, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> Path:
    """Write a table of BIDS."""
    lines = ["\t".join(map(str, row)) for row in (columns, *rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
