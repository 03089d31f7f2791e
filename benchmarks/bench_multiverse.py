"""What a multiverse costs beside what it shares: processor time and disk, both measured in one sitting.

``python benchmarks/bench_multiverse.py [FILE] [--config CONFIG] [--subjects N] [--jobs N]``: FILE is a file of choices
(default multiverses/smoke.toml). In empty folders, numbers alone:

1. what all universes share: acquire, and the stages that no choice reaches (simulate, robot);
2. one chain, as the study has it: all its other stages, once;
3. the whole multiverse, by one command.

The budget is (1) + chains × (2) + what differs within chains. The last is what the records of (3) say of each stage,
without as many variants of it as there are chains, in processor seconds by the rate of (2). That no result was computed
twice is seen by their number: at most as many as differ by what decides them. Disk is looked at twice a second. The
12-subject study takes ``multiverses/paper.toml``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import _measure

ROOT = Path(__file__).parents[1]
SHARED = ("acquire", "simulate", "robot")
LIMIT = 1.2


class Disk(threading.Thread):
    """Looks how much lies in a folder, and remembers the most."""

    def __init__(self, folder: Path) -> None:
        super().__init__(daemon=True)
        self.folder, self.most, self.over = folder, 0, threading.Event()

    def run(self) -> None:
        while not self.over.wait(0.5):
            self.look()

    def look(self) -> int:
        total = 0
        for folder, _, names in os.walk(self.folder):
            for name in names:
                try:
                    total += os.lstat(os.path.join(folder, name)).st_blocks * 512
                except OSError:
                    continue
        self.most = max(self.most, total)
        return total


def run(arguments: list[str]) -> tuple[_measure.Seconds, Any]:
    """Return what a command took, with all processes that it started, and its answer."""
    env = {**os.environ, **dict.fromkeys(_measure.THREADS, "1"), "PYTHONPATH": str(ROOT)}
    env.pop("HRCNEURO_CACHE", None)
    start = time.perf_counter()
    command = [sys.executable, "-m", "hrcneuro", *arguments, "--json", "-q"]
    process = subprocess.Popen(command, env=env, cwd=ROOT, stdout=subprocess.PIPE)
    assert process.stdout is not None
    answer = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"hrcneuro {' '.join(arguments)} failed with status {status}")
    return _measure.Seconds(time.perf_counter() - start, usage.ru_utime + usage.ru_stime), json.loads(answer)


def recorded(work: Path) -> dict[str, list[tuple[str, float]]]:
    """Return stage -> unit and processor seconds of each entry."""
    found = defaultdict(list)
    for path in work.glob("cache/*/*/*/record.json"):
        record = json.loads(path.read_text())
        found[record["stage"]].append((record["unit"], record["provenance"]["cpu_seconds"]))
    return found


def differs(entries: dict[str, list[tuple[str, float]]], chains: int) -> float:
    """Return the recorded seconds of what is beyond one variant of each stage a chain."""
    total = 0.0
    for stage, of in entries.items():
        variants = max(Counter(unit for unit, _ in of).values())
        if stage not in SHARED:
            total += sum(seconds for _, seconds in of) * max(0, variants - chains) / variants
    return total


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("file", metavar="FILE", nargs="?", type=Path, default=ROOT / "multiverses" / "smoke.toml")
    options.add_argument("--config", type=Path, help="a configuration in place of the file's own")
    options.add_argument("--subjects", type=int, default=0, help="only the first so many of the study")
    options.add_argument("--jobs", type=int, default=1, help="jobs at a time (default 1)")
    options.add_argument("--workdir", type=Path, help="keep the multiverse here; else it goes with the benchmark")
    options.add_argument("--quick", action="store_true", help="no effect: the smoke study is quick")
    chosen = options.parse_args()
    config = ["--config", str(chosen.config.resolve())] if chosen.config else []
    if chosen.subjects:
        names = [f"s{number:02d}" for number in range(1, chosen.subjects + 1)]
        excluded = [name for name in names if name == "s07"]
        for key, value in (("subjects", names), ("exclude", excluded)):
            config += ["--set", f"study.{key}={json.dumps(value)}"]
    given = [*config, "-j", str(chosen.jobs)]
    asked = tomllib.loads(chosen.file.read_text())
    own = config if chosen.config else ["--config", str(chosen.file.parent / asked["config"]), *config]
    with tempfile.TemporaryDirectory() as folder:
        plan = measure(chosen, given, own, asked, Path(folder))
    print(f"{_measure.machine()}; {chosen.file.name}, {chosen.jobs} jobs at a time")
    print("\n".join(plan))


def measure(chosen: Any, given: list[str], own: list[str], asked: Any, folder: Path) -> list[str]:
    """Return the lines of the answer."""
    one, whole = folder / "one", chosen.workdir or folder / "whole"
    stages = asked.get("stages") or ["acquire", "preprocess", "epoch", "erp", "ersp", "decode", "simulate", "robot"]
    jobs = ["-j", str(chosen.jobs), "--no-figures", "--workdir", str(one)]
    shared = [run([stage, *own, *jobs])[0] for stage in SHARED if stage in stages]
    chain_stages = [stage for stage in stages if stage not in SHARED]
    pipeline = folder / "chain.toml"
    pipeline.write_text(f"stages = {json.dumps(chain_stages)}\nreport = false\n")
    before = {stage: len(of) for stage, of in recorded(one).items()}
    chain, _ = run(["run", str(pipeline), *own, *jobs])
    taken = sum(seconds for stage, of in recorded(one).items() if stage not in before for _, seconds in of)
    disk = Disk(whole)
    disk.start()
    all_of_it, answer = run(["multiverse", str(chosen.file), *given, "--workdir", str(whole)])
    disk.over.set()
    disk.join()
    cost = answer["cost"]
    rate = chain.cpu / taken
    results = recorded(whole)
    computed = sum(map(len, results.values()))
    rest = rate * differs(results, cost["chains"])
    first = sum(one.cpu for one in shared)
    budget = first + cost["chains"] * chain.cpu + rest
    ratio = all_of_it.cpu / budget
    return [
        f"{cost['universes']} universes on {cost['chains']} chains, {cost['units']} different results, of which "
        f"{computed} were computed{'' if computed <= cost['units'] else ' TOO MANY'}",
        "| what | processor s | by the clock, s |",
        "|---|---|---|",
        f"| shared by all ({', '.join(s for s in SHARED if s in stages)}) | {first:.1f} "
        f"| {sum(one.wall for one in shared):.1f} |",
        f"| one chain ({', '.join(chain_stages)}) | {chain.cpu:.1f} | {chain.wall:.1f} |",
        f"| what differs within chains | {rest:.1f} | |",
        f"| budget | {budget:.1f} | |",
        f"| the multiverse | {all_of_it.cpu:.1f} | {all_of_it.wall:.1f} |",
        f"| ratio (at most {LIMIT:g}) | {ratio:.2f}{'' if ratio <= LIMIT else ' TOO MUCH'} | |",
        f"disk: {disk.most / 1e9:.3f} GB at most, {disk.look() / 1e9:.3f} GB in the end; said before: "
        f"{cost['disk'] / 1e9:.3f} GB at most, {cost['kept'] / 1e9:.3f} GB in the end",
    ]


if __name__ == "__main__":
    main()
