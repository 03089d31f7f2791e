"""A recording cleaned by EEGPrep, as a careful user of it would write it: ``FIF FOLDER BADS [keep]``.

Not a benchmark by itself: ``bench_eegprep.py`` runs it in EEGPrep's own environment, which has no hrcneuro. BADS are
the channels to interpolate, joined by commas, so that results can be compared; which EEGPrep would have taken is said.
Into FOLDER goes ``steps.json``: seconds and peak memory of each step; with ``keep``, the signal after each, too (µV).
"""

from __future__ import annotations

import json
import logging
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import eegprep
import mne
import numpy as np

BAND_HZ, THRESHOLD_SD, TARGET_SFREQ = (1.0, 40.0), 2.0, 512.0


class Clock:
    """Notes what each step takes, and keeps what it makes."""

    def __init__(self, folder: Path, keep: bool) -> None:
        self.folder, self.keep = folder, keep
        self.steps: dict[str, dict[str, float]] = {}

    def __call__(self, step: str, work: Callable[[], Any]) -> Any:
        # Linux: 5 resets the peak (VmHWM) to what is in use now.
        Path("/proc/self/clear_refs").write_text("5")
        wall, cpu = time.perf_counter(), time.process_time()
        made = work()
        self.steps[step] = {
            "wall": time.perf_counter() - wall,
            "cpu": time.process_time() - cpu,
            "peak_mb": peak_mb(),
        }
        if self.keep and isinstance(made, dict):
            np.save(self.folder / f"{step}.npy", made["data"])
        return made


def peak_mb() -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def dataset(path: str) -> tuple[dict[str, Any], int]:
    """Return a recording as EEGPrep has it, and its number of EEG channels, which come first.

    Samples are in µV, axes are EEGLAB's: X points to the nose, MNE's to the right ear.
    """
    raw = mne.io.read_raw_fif(path, preload=True, verbose="error")
    n_eeg = len(mne.pick_types(raw.info, eeg=True, exclude=()))
    data = raw.get_data()
    data *= 1e6
    last_s = (data.shape[1] - 1) / raw.info["sfreq"]
    shape = {"nbchan": len(data), "pnts": data.shape[1], "trials": 1, "srate": raw.info["sfreq"]}
    eeg = eegprep.eeg_emptyset() | {"data": data, **shape, "xmin": 0.0, "xmax": last_s}
    eeg["chanlocs"] = []
    for row, (name, ch) in enumerate(zip(raw.ch_names, raw.info["chs"], strict=True)):
        right, front, up = (float(at) for at in ch["loc"][:3])
        kind = "EEG" if row < n_eeg else "EOG"
        eeg["chanlocs"].append({"labels": name, "type": kind, "X": front, "Y": -right, "Z": up})
    return eegprep.eeg_checkset(eeg), n_eeg


def regressed(eeg: dict[str, Any], n_eeg: int) -> dict[str, Any]:
    """Return the EEG channels without the EOG's share. EEGPrep has no such step, so this is NumPy."""
    signal, noise = eeg["data"][:n_eeg], eeg["data"][n_eeg:]
    noise = noise - noise.mean(axis=1, keepdims=True)
    weights = np.linalg.solve(noise @ noise.T, noise @ signal.T).T
    clean = signal - weights @ noise
    clean -= clean.mean(axis=1, keepdims=True)
    return eeg | {"data": clean, "nbchan": n_eeg, "chanlocs": eeg["chanlocs"][:n_eeg]}


def filtered(eeg: dict[str, Any], **more: Any) -> dict[str, Any]:
    return eegprep.pop_eegfiltnew(eeg, locutoff=BAND_HZ[0], hicutoff=BAND_HZ[1], **more)


def judged(eeg: dict[str, Any]) -> tuple[list[str], list[float]]:
    """Return which channels EEGPrep rejects, and the kurtosis of all, normalised."""
    limits = [-THRESHOLD_SD, THRESHOLD_SD]
    _, found, z = eegprep.pop_rejchan(eeg, threshold=limits, norm="on", measure="kurt", indexonly="on")
    return [eeg["chanlocs"][one - 1]["labels"] for one in found], [float(one) for one in z]


def main(path: str, out: str, bads: str, keep: str = "") -> None:
    # It warns of the kinds of its own empty fields.
    logging.getLogger("eegprep").setLevel(logging.ERROR)
    clock = Clock(Path(out), bool(keep))
    eeg, n_eeg = clock("read", lambda: dataset(path))
    if not keep:
        clock("filtered by default", lambda: filtered(eeg))
    eeg = clock("filtered", lambda: filtered(eeg, usefftfilt=True))
    eeg = clock("eog", lambda: regressed(eeg, n_eeg))
    rejected, z = clock("judged", lambda: judged(eeg))
    if keep:
        clock("interpolated by default", lambda: eegprep.pop_interp(eeg, bads.split(","), "spherical"))
    eeg = clock("interpolated", lambda: eegprep.eeg_interp(eeg, bads.split(","), "spherical", dtype="float64"))
    eeg = clock("reference", lambda: eegprep.pop_reref(eeg, []))
    eeg = clock("resampled", lambda: eegprep.pop_resample(eeg, TARGET_SFREQ))
    told = {"version": eegprep.__version__, "rejected": rejected, "z": z, "steps": clock.steps}
    (Path(out) / "steps.json").write_text(json.dumps(told))


if __name__ == "__main__":
    main(*sys.argv[1:])
