"""One subject of full size, raw FIF to decoding, by ``hrcneuro run`` against a careful script (``peer_subject.py``).

Whole processes are compared, from their start: imports, reading, computing and, on our side, all artifacts and the
cache; in one row the numbers alone, in the other with every picture. Permutation p values, which the script has not,
are left out; so are EEGLAB's interpolation and BIOSIG's offset.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import _measure
import mne
import numpy as np
import pandas as pd

from hrcneuro.io.tables import read_lists, read_table

HERE = Path(__file__).parent
ROOT = HERE.parent
STAGES = ("preprocess", "epoch", "erp", "ersp", "decode")
PLAIN = ("preprocess.interpolation=perrin", "preprocess.eog_offset=false", "decode.permutations=0")
TARGETS = {"the numbers alone": 8, "with every picture": 6}
MEMORY_LIMIT_MB = 900


def hrcneuro(work: Path, *arguments: str) -> list[str]:
    settings = [part for value in PLAIN for part in ("--set", value)]
    config = ("--config", str(ROOT / "configs" / "paper.toml"))
    return [sys.executable, "-m", "hrcneuro", *arguments, *config, *settings, "--workdir", str(work), "-j", "1", "-q"]


def run(command: list[str]) -> tuple[float, float, float]:
    """Return wall seconds, processor seconds and the peak memory (MB) of a process and what it started."""
    start = time.perf_counter()
    env = {**os.environ, **dict.fromkeys(_measure.THREADS, "1")}
    process = subprocess.Popen(command, env=env)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed with status {status}")
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def medians(runs: list[tuple[float, float, float]]) -> _measure.Seconds:
    return _measure.Seconds(_measure.median(one[0] for one in runs), _measure.median(one[1] for one in runs))


def newest(work: Path, stage: str) -> Path:
    return next((work / "cache" / stage / "s01").glob("*/record.json")).parent


def difference(work: Path, peer: Path) -> str:
    """Return how far the two averages lie apart, and both mean accuracies."""
    theirs = np.load(peer)
    found = mne.read_evokeds(newest(work, "erp") / "s01_ave.fif", condition="all/RH_before", verbose="error")
    erp = np.abs(found.get_data() * 1e6 - theirs["erp"]).max()
    path = newest(work, "ersp") / "ersp.parquet"
    table = read_table(path).drop(columns="magnitude_uv")
    mine = ((table["scenario"] == "all") & (table["condition"] == "RH_before")).to_numpy()
    maps = read_lists(path, "magnitude_uv")[mine].reshape(theirs["ersp"].shape)
    scores = pd.read_parquet(newest(work, "decode") / "scores.parquet")["bacc"].mean()
    relative = np.abs(maps - theirs["ersp"]).max() / theirs["ersp"].max()
    return f"ERP {erp:.0e} µV, ERSP {relative:.0e}, mean accuracy {scores:.1f} and {100 * theirs['bacc'].mean():.1f} %"


def main() -> None:
    chosen = _measure.options(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        run(hrcneuro(work, "acquire", "s01"))
        acquired = newest(work, "acquire")
        pipeline = work / "subject.toml"
        pipeline.write_text(f'stages = {list(STAGES)}\nsubjects = ["s01"]\nreport = false\n'.replace("'", '"'))
        script = [sys.executable, str(HERE / "peer_subject.py"), str(acquired / "s01_raw.fif")]
        script += [str(acquired / "trials.parquet"), str(work / "peer.npz")]
        kinds = dict(zip(TARGETS, (["--no-figures"], []), strict=True))
        theirs, ours = [], {kind: [] for kind in kinds}
        for _ in range(chosen.repeats):
            theirs.append(run(script))
            for kind, more in kinds.items():
                # The pictures are entries of their own.
                for entries in (work / "cache").glob("[!.]*"):
                    if entries.name != "acquire":
                        shutil.rmtree(entries)
                ours[kind].append(run(hrcneuro(work, "run", str(pipeline), *more)))
        _measure.heading()
        for kind, target in TARGETS.items():
            name = f"one subject, raw to decode, {kind}; MNE + scikit-learn script"
            told = difference(work, work / "peer.npz")
            _measure.row(name, medians(theirs), medians(ours[kind]), target, told)
        peaks = [max(one[2] for one in runs) for runs in (theirs, *ours.values())]
        print(f"  peak memory: script {peaks[0]:.0f} MB, ours {max(peaks[1:]):.0f} MB (limit {MEMORY_LIMIT_MB})")
        for stage in STAGES:
            seconds = float(read_seconds(newest(work, stage)))
            print(f"  {stage}: {seconds:.1f} s")


def read_seconds(entry: Path) -> float:
    import json

    record = json.loads((entry / "record.json").read_text())
    return float(record["provenance"]["seconds"])


if __name__ == "__main__":
    main()
