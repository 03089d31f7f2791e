"""Times what costs nobody anything: ``hrcneuro --help``, and a 12-subject study of which everything is cached.

``python benchmarks/bench_cached.py [--quick] [WORKDIR]``; with a folder, the study that it holds is kept and used
again. ``--quick`` takes two subjects and one run of each.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMITS_S = {"--help": 0.3, "cached study": 2.0}
NUMERIC = ("numpy", "scipy", "pandas", "mne", "pyarrow", "sklearn", "matplotlib")
# Everything that the paper's study has, each part as short as it can be: what is cached costs the same.
PIPELINE = 'config = "short.toml"\n'
QUICK = """
[study]
subjects = ["s01", "s02"]
exclude = []
"""
CONFIG = """
[acquire]
sfreq = 128.0
[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 1
[acquire.timing]
break_s = 1.0
pause_s = 1.0
[preprocess]
sfreq = 128.0
h_freq = 40.0
[ersp]
high_hz = 40.0
[decode]
repeats = 1
permutations = 19
[simulate]
repetitions = 2
episodes = 20
[robot]
episodes = [1]
"""


def main(folder: Path, *, quick: bool) -> int:
    """Return 1 where a limit is passed or a numeric library is loaded in vain."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "short.toml").write_text(QUICK + CONFIG if quick else CONFIG)
    (folder / "pipeline.toml").write_text(PIPELINE)
    study = ("run", folder / "pipeline.toml", "--workdir", folder)
    start = time.perf_counter()
    call(*study, "-q")
    print(f"{2 if quick else 12} short subjects brought up to date in {time.perf_counter() - start:.0f} s")
    items = json.loads(call(*study, "--json").stdout)["items"]
    assert all(item["state"] == "hit" for item in items), "the second run is not all hits"
    loaded = numeric_libraries(*study)
    took = {
        "--help": seconds("--help", times=1 if quick else 10),
        "cached study": seconds(*study, times=1 if quick else 5),
    }
    for name, limit in LIMITS_S.items():
        wall, cpu = took[name]
        note = f", {len(items)} units" if name == "cached study" else ""
        print(f"{name}: {wall:.2f} s by the clock, {cpu:.2f} s of processor time (limit {limit:g} s{note})")
    print(f"numeric libraries loaded by the cached study: {', '.join(sorted(loaded)) or 'none'}")
    # On a busy machine the clock measures the neighbours: only what both find too slow is too slow.
    return int(bool(loaded) or any(min(took[name]) > limit for name, limit in LIMITS_S.items()))


def seconds(*arguments: str | Path, times: int) -> tuple[float, float]:
    """Return the median duration of a command by the clock, and in processor time."""
    wall, cpu = [], []
    for _ in range(times):
        start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        call(*arguments)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall.append(time.perf_counter() - start)
        cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(wall), statistics.median(cpu)


def numeric_libraries(*arguments: str | Path) -> set[str]:
    """Return the numeric libraries that a command imports."""
    lines = call(*arguments, options=("-X", "importtime")).stderr.splitlines()
    names = {line.rpartition("|")[2].strip().partition(".")[0] for line in lines if line.startswith("import time:")}
    return names & set(NUMERIC)


def call(*arguments: str | Path, options: tuple[str, ...] = ()) -> subprocess.CompletedProcess:
    """Run ``hrcneuro``."""
    command = [sys.executable, *options, "-m", "hrcneuro", *map(str, arguments)]
    environment = {k: v for k, v in os.environ.items() if k != "HRCNEURO_CACHE"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr)
    return done


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="two subjects, one run of each command")
    parser.add_argument("workdir", type=Path, nargs="?", help="keep the study here and use it again")
    chosen = parser.parse_args()
    if chosen.workdir:
        sys.exit(main(chosen.workdir, quick=chosen.quick))
    with tempfile.TemporaryDirectory() as temporary:
        sys.exit(main(Path(temporary), quick=chosen.quick))
