"""What the paper's study costs, stage by stage, wall clock and processor time; several working trees in one sitting.

``python benchmarks/bench_study.py [TREE ...]``: each TREE is a folder with this program's source (``git worktree``), by
default this one alone. A stage's numbers, and then its pictures, are a command each; the last row is one command for
the whole study. It is computed in the system's place for temporary files, twice a tree, each time 8 GB for twelve
subjects.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import _measure

ROOT = Path(__file__).parents[1]
STAGES = ("acquire", "preprocess", "epoch", "erp", "ersp", "decode", "simulate", "robot")
WHOLE = "the whole study, one command"


def run(tree: Path, arguments: list[str]) -> _measure.Seconds:
    """Return what a command of a tree's program took, with all processes that it started."""
    env = {**os.environ, **dict.fromkeys(_measure.THREADS, "1"), "PYTHONPATH": str(tree)}
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-m", "hrcneuro", *arguments, "-q"], env=env, cwd=tree)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{tree}: hrcneuro {' '.join(arguments)} failed with status {status}")
    return _measure.Seconds(time.perf_counter() - start, usage.ru_utime + usage.ru_stime)


def study(tree: Path, subjects: int, jobs: int, keep: Path | None = None) -> dict[str, _measure.Seconds]:
    """Return what each stage's numbers and pictures take in an empty folder, and all by one command in another one.

    The other one is ``keep``, where that is given.
    """
    names = [f"s{number:02d}" for number in range(1, subjects + 1)]
    config = ["--config", str(tree / "configs" / "paper.toml"), "-j", str(jobs)]
    for key, value in (("subjects", names), ("exclude", [name for name in names if name == "s07"])):
        config += ["--set", f"study.{key}={json.dumps(value)}"]
    taken = {}
    with tempfile.TemporaryDirectory() as folder:
        for stage in STAGES:
            for what, more in (("numbers", ["--no-figures"]), ("pictures", [])):
                taken[f"{stage}, {what}"] = run(tree, [stage, *config, *more, "--workdir", folder])
    with tempfile.TemporaryDirectory() as folder:
        taken[WHOLE] = run(tree, ["run", *config, "--workdir", str(keep or folder)])
    return taken


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("trees", metavar="TREE", nargs="*", type=Path, default=[ROOT])
    options.add_argument("--subjects", type=int, default=12, help="how many subjects (default 12)")
    options.add_argument("--jobs", type=int, default=2, help="jobs at a time (default 2)")
    options.add_argument("--quick", action="store_true", help="one subject, one job")
    options.add_argument("--keep", metavar="FOLDER", type=Path, help="an empty folder for the last tree's whole study")
    chosen = options.parse_args()
    if chosen.keep and chosen.keep.is_dir() and any(chosen.keep.iterdir()):
        raise SystemExit(f"{chosen.keep} is not empty: what lies there would not be computed")
    if chosen.quick:
        chosen.subjects, chosen.jobs = 1, 1
    trees = [tree.resolve() for tree in chosen.trees]
    print(f"{_measure.machine()}; {chosen.subjects} subjects, {chosen.jobs} jobs at a time")
    print("seconds by the clock (of the processor), each of a command with its start")
    taken = []
    for number, tree in enumerate(trees, 1):
        print(f"tree {number}: {_commit(tree)}", flush=True)
        keep = chosen.keep.resolve() if chosen.keep and number == len(trees) else None
        taken.append(study(tree, chosen.subjects, chosen.jobs, keep))
    print("| | " + " | ".join(f"tree {number}" for number in range(1, len(trees) + 1)) + " |")
    print("|---" * (len(trees) + 1) + "|")
    for row in taken[0]:
        print(f"| {row} | " + " | ".join(f"{one[row].wall:.1f} ({one[row].cpu:.1f})" for one in taken) + " |")


def _commit(tree: Path) -> str:
    command = ["git", "-C", str(tree), "log", "-1", "--format=%h %s"]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    return told.stdout.strip() or tree.name


if __name__ == "__main__":
    main()
