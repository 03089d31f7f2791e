"""One subject of full size, raw FIF to decoding, by ``hrcneuro run`` against a careful script (``peer_subject.py``).

Whole processes are compared, from their start: imports, reading, computing and, on our side, all artifacts, figures and
the cache. Permutation p values, which the script has not, are left out; so are EEGLAB's interpolation and BIOSIG's
offset.
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
TARGET, MEMORY_LIMIT_MB = 6, 1600


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
        measured: tuple[list, list] = ([], [])
        for _ in range(chosen.repeats):
            measured[0].append(run(script))
            for stage in STAGES:
                shutil.rmtree(work / "cache" / stage, ignore_errors=True)
            measured[1].append(run(hrcneuro(work, "run", str(pipeline))))
        peer, ours = (
            _measure.Seconds(_measure.median(m[0] for m in runs), _measure.median(m[1] for m in runs))
            for runs in measured
        )
        _measure.heading()
        _measure.row(
            "one subject, raw to decode; MNE + scikit-learn script",
            peer,
            ours,
            TARGET,
            difference(work, work / "peer.npz"),
        )
        theirs, mine = (max(m[2] for m in runs) for runs in measured)
        print(f"  peak memory: script {theirs:.0f} MB, ours {mine:.0f} MB (limit {MEMORY_LIMIT_MB})")
        for stage in STAGES:
            seconds = float(read_seconds(newest(work, stage)))
            print(f"  {stage}: {seconds:.1f} s")


def read_seconds(entry: Path) -> float:
    import json

    record = json.loads((entry / "record.json").read_text())
    return float(record["provenance"]["seconds"])


if __name__ == "__main__":
    main()
