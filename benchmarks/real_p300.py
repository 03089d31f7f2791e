"""Real P300s, from the recordings to the verdict: ``python FILE RECORDINGS [OUT.png] [SHUFFLES]``.

RECORDINGS holds ``fif_p300`` and ``csv_muse_p300`` (where from: docs/real_recordings.md). Both studies run as a user
would run them. Printed: the difference between targets and standards in the usual window of a P300, tested by labels
that are permuted over the trials, of each take by itself, too; single-trial decoding with its permutation test; and the
same decoding of copies of the recordings whose labels were shuffled.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mne
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import hrcneuro

PERMUTATIONS = 9999


@dataclass(frozen=True)
class Study:
    """A study, and what is expected of it: sign of the difference at some sites in a window, in s."""

    title: str
    config: str
    subject: str
    files: str
    sites: tuple[str, ...]
    sign: int
    window_s: tuple[float, float]


STUDIES = (
    Study("Emotiv EPOC X", "p300_emotiv", "speller", "fif_p300/train_*_raw.fif", ("F3", "F4"), +1, (0.25, 0.5)),
    Study("Muse", "p300_muse", "muse", "csv_muse_p300/data_2017-02-04-*.csv", ("TP9", "TP10"), -1, (0.25, 0.5)),
)


def call(study: Study, files: Path, work: Path, *words: str) -> dict[str, Any]:
    """Return what a command says of a study whose recordings are ``files``, a pattern."""
    given = ("--config", study.config, "--set", f"acquire.path={files}", "--workdir", str(work), "-j", "1", "--json")
    command = [sys.executable, "-m", "hrcneuro", *words, *given]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def decoded(study: Study, files: Path, work: Path) -> dict[str, Any]:
    """Return the numbers of the study's decoder."""
    items = call(study, files, work, "decode", study.subject, "--no-figures")["items"]
    found = next(item for item in items if item["stage"] == "decode")
    return found["summary"]["all"]["targetVSstandard"]


def shuffled(study: Study, root: Path, out: Path, rng: np.random.Generator) -> Path:
    """Write the study's recordings with the labels of their stimuli shuffled; return their pattern."""
    out.mkdir(parents=True)
    for path in sorted(root.glob(study.files)):
        if path.suffix == ".csv":
            table = pd.read_csv(path)
            at = np.flatnonzero(table["Marker"])
            table.loc[at, "Marker"] = rng.permutation(table["Marker"].to_numpy()[at])
            table.to_csv(out / path.name, index=False)
            continue
        raw = mne.io.read_raw_fif(path, preload=True, verbose="error")
        row = raw._data[raw.ch_names.index("STIM")]
        starts = np.flatnonzero(np.append(False, (row[1:] != 0) & (row[1:] != row[:-1])))
        codes = rng.permutation(row[starts])
        for start, code in zip(starts, codes, strict=True):
            stop = start + int(np.argmax(np.append(row[start:] != row[start], True)))
            row[start:stop] = code
        raw.save(out / path.name, verbose="error")
    return out / Path(study.files).name


def component(study: Study, files: Path, work: Path) -> dict[str, Any]:
    """Return the difference of targets and standards, tested by labels that are permuted over the trials."""
    made = hrcneuro.open(work, study.config, set=[f"acquire.path={files}"])
    epochs = made.epochs(study.subject).apply_baseline((-0.2, 0), verbose="error")
    uv = epochs.get_data(picks=list(study.sites)).mean(axis=1) * 1e6
    target = (epochs.metadata["event"] == "target").to_numpy()
    inside = (epochs.times >= study.window_s[0]) & (epochs.times <= study.window_s[1])
    trials = uv[:, inside].mean(axis=1)
    marks = made.raw(study.subject).annotations
    second = epochs.metadata["onset_s"].to_numpy() > marks.onset[marks.description == "EDGE boundary"][0]
    parts = {"both takes": slice(None), "first": ~second, "second": second}
    mean, error = (
        {kind: of(uv[labels]) for kind, labels in (("target", target), ("standard", ~target))}
        for of in (lambda x: x.mean(axis=0), lambda x: x.std(axis=0, ddof=1) / np.sqrt(len(x)))
    )
    curve = study.sign * (mean["target"] - mean["standard"]) * (epochs.times > 0)
    return {
        "n": {"target": int(target.sum()), "standard": int((~target).sum())},
        "takes": {name: tested(trials[rows], target[rows], study.sign) for name, rows in parts.items()},
        "peak_ms": 1e3 * float(epochs.times[np.argmax(curve)]), "peak_uv": study.sign * float(curve.max()),
        "times": epochs.times, "mean": mean, "error": error,
    }  # fmt: skip


def tested(trials: np.ndarray, target: np.ndarray, sign: int) -> tuple[float, float]:
    """Return the difference of the means, and how often chance has one as large in its direction."""
    rng = np.random.default_rng(0)

    def difference(labels: np.ndarray) -> float:
        return float(trials[labels].mean() - trials[~labels].mean())

    found = difference(target)
    chance = np.array([difference(rng.permutation(target)) for _ in range(PERMUTATIONS)])
    return found, (1 + int((sign * chance >= sign * found).sum())) / (1 + PERMUTATIONS)


def draw(found: list[tuple[Study, dict[str, Any], dict[str, Any], list[float]]], out: Path) -> None:
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    axes = figure.subplots(len(found), 2, width_ratios=[2, 1])
    for (study, wave, numbers, chance), (left, right) in zip(found, axes, strict=True):
        for kind, colour in (("standard", "0.4"), ("target", "#1f66ad")):
            middle, error = wave["mean"][kind], wave["error"][kind]
            left.plot(wave["times"] * 1e3, middle, color=colour, label=f"{kind} ({wave['n'][kind]})")
            left.fill_between(wave["times"] * 1e3, middle - error, middle + error, color=colour, alpha=0.2, lw=0)
        left.axvspan(*(1e3 * at for at in study.window_s), color="#e8b33f", alpha=0.15, lw=0)
        left.axhline(0, color="0.7", lw=0.6)
        left.axvline(0, color="0.7", lw=0.6)
        left.set(xlim=(-200, 800), xlabel="time from the flash (ms)", ylabel=f"{' and '.join(study.sites)} (µV)")
        left.set_title(
            f"{study.title}: one person, two takes; p = {wave['takes']['both takes'][1]:.4f} in the window", fontsize=10
        )
        left.legend(frameon=False, fontsize=8)
        right.hist(chance, bins=np.arange(35, 90, 2.5), color="0.7", label=f"labels shuffled ({len(chance)} copies)")
        right.axvline(numbers["bacc"], color="#1f66ad", label=f"labels as recorded, p = {numbers['p']:.3f}")
        right.axvline(50, color="0.4", lw=0.6, ls=":")
        right.set(xlim=(35, 90), xlabel="balanced accuracy (%)", ylabel="copies")
        right.set_title("single trials, rlda", fontsize=10)
        # Below the panel: within it there is no place that neither a bar nor a line may need.
        right.legend(frameon=False, fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.18))
    figure.savefig(out, dpi=110)


def main(root: str, out: str = "real_p300.png", shuffles: str = "20") -> None:
    warnings.simplefilter("ignore")
    found = []
    for study in STUDIES:
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            numbers = decoded(study, Path(root) / study.files, place / "work")
            wave = component(study, Path(root) / study.files, place / "work")
            rng, chance, p = np.random.default_rng(1), [], []
            for k in range(int(shuffles)):
                files = shuffled(study, Path(root), place / f"copy{k}", rng)
                one = decoded(study, files, place / f"work{k}")
                chance.append(one["bacc"])
                p.append(one["p"])
        n = wave["n"]
        low, high = (round(1e3 * at) for at in study.window_s)
        n = wave["n"]
        print(f"{study.title}: {n['target']} targets and {n['standard']} standards of one person")
        print(f"  {'+'.join(study.sites)}, {low}-{high} ms, target - standard:")
        for name, (difference, p_value) in wave["takes"].items():
            print(f"    {name}: {difference:+.2f} µV, p = {p_value:.4f} ({PERMUTATIONS} permutations, one-sided)")
        print(f"    largest {wave['peak_uv']:+.1f} µV at {wave['peak_ms']:.0f} ms")
        print(f"  decoding, {numbers['decoder']}: accuracy {numbers['acc']:.1f} %, balanced {numbers['bacc']:.1f} %,")
        print(f"    chance {numbers['chance']:.1f} %, p = {numbers['p']:.3f}")
        if chance:
            spread = f"{np.mean(chance):.1f} ± {np.std(chance, ddof=1):.1f} %, largest {max(chance):.1f} %"
            few = int((np.array(p) <= 0.05).sum())
            print(f"  labels shuffled, {len(chance)} copies: balanced {spread}; p <= 0.05 in {few}")
        found.append((study, wave, numbers, chance))
    draw(found, Path(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
