"""preprocess, step by step, against EEGPrep (EEGLAB in Python), which runs in an environment of its own.

Both read one FIF file, a synthetic subject of the study's size (with ``--quick`` its first 270 s), and run the same
steps: ``peer_eegprep.py`` as one process, ours in this one. Differences are those of the signals after each step, in
µV. Without the environment nothing is measured. To make it:

    python -m venv build/eegprep && build/eegprep/bin/pip install eegprep
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import _measure
import mne
import numpy as np

from hrcneuro.analyses import electrodes
from hrcneuro.eeg import cleaning
from hrcneuro.eeg.params import CleaningParams
from hrcneuro.io.fif import read_raw, read_samples, write_raw

HERE = Path(__file__).parent
ROOT = HERE.parent
PEER = ROOT / "build" / "eegprep" / "bin" / "python"
STEPS = ("filtered", "eog", "interpolated", "reference", "resampled")
LABELS = {
    "filtered": "band-pass, 3301 taps; EEGPrep with `usefftfilt`",
    "eog": "EOG regression; EEGPrep has none: NumPy in the script",
    "interpolated": "kurtosis and splines; ours also PREP's criteria",
    "reference": "common average",
    "resampled": "512 Hz",
}
QUICK_S = 270.0
# Both resamplers see at the ends what is not there.
ENDS = 1024


@dataclass
class Chain:
    """Runs our chain, and notes what each step takes and how far it lies from EEGPrep's (with ``folder``)."""

    path: Path
    folder: Path | None = None
    took: dict[str, _measure.Seconds] = field(default_factory=dict)
    apart: dict[str, tuple[float, float]] = field(default_factory=dict)

    def run(self) -> cleaning.Cleaned:
        signals = read(self.path)
        self._start()
        cleaned = cleaning.clean(signals, CleaningParams(), on_step=self._step)
        self._step("resampled", cleaned.eeg)
        return cleaned

    def _start(self) -> None:
        self.last = time.perf_counter(), time.process_time()

    def _step(self, name: str, eeg: np.ndarray) -> None:
        now = time.perf_counter(), time.process_time()
        self.took[name] = _measure.Seconds(now[0] - self.last[0], now[1] - self.last[1])
        if self.folder is not None:
            theirs = np.load(self.folder / f"{name}.npy", mmap_mode="r")
            self.apart[name] = apart(eeg, theirs, ENDS if name == "resampled" else 0)
        self._start()


def apart(ours: np.ndarray, theirs: np.ndarray, ends: int = 0) -> tuple[float, float]:
    """Return the largest and the RMS difference of two signals, without so many samples at both ends."""
    inner = slice(ends, min(ours.shape[1], theirs.shape[1]) - ends)
    largest = squares = 0.0
    for mine, other in zip(ours, theirs, strict=False):
        difference = mine[inner] - other[inner]
        largest = max(largest, float(np.abs(difference).max()))
        squares += float(difference @ difference) / len(difference)
    return largest, (squares / len(ours)) ** 0.5


def read(path: Path) -> cleaning.Signals:
    raw = read_raw(path)
    eeg, eog = (list(mne.pick_types(raw.info, exclude=(), **{kind: True})) for kind in ("eeg", "eog"))
    names = [[raw.ch_names[i] for i in picks] for picks in (eeg, eog)]
    data = read_samples(raw, [*eeg, *eog], 1e6)
    places = np.array([raw.info["chs"][i]["loc"][:3] for i in eeg])
    return cleaning.Signals(data, float(raw.info["sfreq"]), *names, places)


def recording(work: Path, quick: bool) -> Path:
    """Return the file that both read: EEG, then EOG, positions around the centre of the head, which EEGPrep expects."""
    given = ("--config", str(ROOT / "configs" / "paper.toml"), "--workdir", str(work))
    command = [sys.executable, "-m", "hrcneuro"]
    subprocess.run([*command, "acquire", "s01", "--no-figures", "-j", "1", "-q", *given], check=True)
    acquired = next((work / "cache" / "acquire" / "s01").glob("*/record.json")).parent / "s01_raw.fif"
    raw = mne.io.read_raw_fif(acquired, preload=True, verbose="error")
    kinds = {kind: mne.pick_types(raw.info, exclude=(), **{kind: True}) for kind in ("eeg", "eog")}
    raw.reorder_channels([raw.ch_names[i] for picks in kinds.values() for i in picks])
    if quick:
        raw.crop(0, QUICK_S, include_tmax=False)
    for row, at in enumerate(electrodes.positions(raw, range(len(kinds["eeg"])), "eeglab")):
        raw.info["chs"][row]["loc"][:3] = at
    path = work / "both_raw.fif"
    write_raw(raw, path)
    return path


def eegprep(path: Path, folder: Path, bads: list[str], *more: str) -> dict[str, Any]:
    """Return what EEGPrep's script says of its steps."""
    env = {**os.environ, **dict.fromkeys(_measure.THREADS, "1")}
    env.pop("PYTHONPATH", None)
    command = [str(PEER), str(HERE / "peer_eegprep.py"), str(path), str(folder), ",".join(bads), *more]
    subprocess.run(command, env=env, check=True)
    return json.loads((folder / "steps.json").read_text())


def alone(path: str) -> cleaning.Cleaned:
    return Chain(Path(path)).run()


def middle(runs: list[dict[str, _measure.Seconds]], step: str) -> _measure.Seconds:
    return _measure.Seconds(*(_measure.median(getattr(run[step], what) for run in runs) for what in ("wall", "cpu")))


def total(seconds: list[_measure.Seconds]) -> _measure.Seconds:
    return _measure.Seconds(sum(one.wall for one in seconds), sum(one.cpu for one in seconds))


def seconds(told: dict[str, Any]) -> dict[str, _measure.Seconds]:
    """Return EEGPrep's seconds by our steps: what it does in two belongs to one of ours."""
    taken = {step: _measure.Seconds(one["wall"], one["cpu"]) for step, one in told["steps"].items()}
    taken["interpolated"] = total([taken.pop("judged"), taken["interpolated"]])
    return taken


def main() -> None:
    chosen = _measure.options(__doc__)
    if not PEER.exists():
        print(f"EEGPrep is left out: there is no {PEER.relative_to(ROOT)}; make it by")
        print("  python -m venv build/eegprep && build/eegprep/bin/pip install eegprep")
        return
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        path = recording(folder, chosen.quick)
        first = Chain(path).run()
        names = read(path).eeg_names
        bads = [name for name, why in zip(names, first.reason, strict=True) if why]
        told = eegprep(path, folder, bads, "keep")
        compared = Chain(path, folder)
        compared.run()
        runs, ours = [], []
        for _ in range(chosen.repeats):
            runs.append(eegprep(path, folder, bads))
            chain = Chain(path)
            chain.run()
            ours.append(chain.took)
        say(told, bads, names, first, compared)
        table(runs, ours, compared)
        memory(runs, path)


def say(told: dict[str, Any], bads: list[str], names: list[str], ours: cleaning.Cleaned, compared: Chain) -> None:
    """Print which channels each rejects, and what EEGPrep's defaults change."""
    print(f"EEGPrep {told['version']}, {len(names)} EEG channels")
    print(f"  rejected by |z| > 2 of kurtosis: EEGPrep {', '.join(told['rejected']) or 'none'}; ours {', '.join(bads)}")
    largest = max(range(len(names)), key=lambda i: abs(ours.z[i]))
    print(f"  largest z, {names[largest]}: EEGPrep {told['z'][largest]:.2f}, ours {ours.z[largest]:.2f}")
    rows = [names.index(name) for name in bads]
    kinds = ("interpolated", "interpolated by default")
    far, rms = apart(*(np.load(compared.folder / f"{kind}.npy", mmap_mode="r")[rows] for kind in kinds))
    print(f"  pop_interp, which offers no double precision, against eeg_interp in it: {far:.0e} µV, RMS {rms:.0e}")


def table(runs: list[dict[str, Any]], ours: list[dict[str, _measure.Seconds]], compared: Chain) -> None:
    """Print a row a step, one of the default band-pass, and one of all steps."""
    _measure.heading()
    theirs = [seconds(one) for one in runs]
    for step in STEPS:
        far, rms = compared.apart[step]
        difference = f"{far:.0e} µV, RMS {rms:.0e}"
        _measure.row(LABELS[step], middle(theirs, step), middle(ours, step), None, difference)
    sides = [total([middle(side, step) for step in STEPS]) for side in (theirs, ours)]
    _measure.row("all steps", *sides, None, "as in the last row")
    default = middle(theirs, "filtered by default")
    _measure.row("band-pass, EEGPrep's default", default, middle(ours, "filtered"), None, "–")


def memory(runs: list[dict[str, Any]], path: Path) -> None:
    """Print the peak memory of both, from the file to the last step."""
    steps = runs[0]["steps"]
    default = steps.pop("filtered by default")["peak_mb"]
    most = max(steps, key=lambda step: steps[step]["peak_mb"])
    _, mine = _measure.peak_mb(alone, str(path))
    size = read(path).data.nbytes / 2**20
    print(f"  peak memory, file to 512 Hz: EEGPrep {steps[most]['peak_mb']:.0f} MB (step {most!r}; the default")
    print(f"  band-pass {default:.0f} MB), ours {mine:.0f} MB; the recording in double precision: {size:.0f} MB")


if __name__ == "__main__":
    main()
