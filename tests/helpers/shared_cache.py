"""Studies that share one cache, and what may happen to them in any order: runs, gc, kill -9, copies, moves."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from hrcneuro.pipeline.claims import claimed
from hrcneuro.pipeline.workdir import Workdir

COMMAND = [sys.executable, "-m", "hrcneuro"]
# Two values a study can switch between, so that entries come to be shared and to be left.
SEEDS = (1, 2, 3)


def simulate(seed, folder):
    """Return the words of the smallest run there is."""
    return [
        *("simulate", "--no-figures", "--executor", "serial", "-q", "--workdir", str(folder)),
        *("--set", "simulate.repetitions=2", "--set", "simulate.episodes=20"),
        *("--set", "simulate.learner_repetitions=0", "--set", f"simulate.seed={seed}"),
    ]


class Sharers:
    """Two studies and their copies in ``base``, with ``base/cache``."""

    def __init__(self, base, draw=None):
        self.base = base
        self.draw = draw or random.Random(0)
        self.cache = base / "cache"
        self.folders = [base / "one", base / "two"]
        self.log = []
        for folder in self.folders:
            folder.mkdir()

    def start(self, words):
        """Start a command in a process of its own."""
        self.log.append(" ".join(words))
        return subprocess.Popen(
            [*COMMAND, *words],
            env={**os.environ, "HRCNEURO_CACHE": str(self.cache)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def finish(self, *processes):
        """Wait for commands that must end well."""
        for process in processes:
            out = process.communicate(timeout=300)[0]
            assert process.returncode == 0, (out, self.log)

    def words(self, kind):
        """Return the words of a run, a forced run or a gc of one of the studies."""
        folder, seed = self.draw.choice(self.folders), self.draw.choice(SEEDS)
        if kind == "gc":
            return ["cache", "gc", "-q", "--workdir", str(folder)]
        return [*simulate(seed, folder), *(["--force"] if kind == "force" else [])]

    def step(self):
        """Let something happen."""
        kind = self.draw.choice(("run", "run", "gc", "force", "at once", "kill", "kill at once", "copy", "move"))
        begun = [self.start(self.words(self.draw.choice(("run", "gc", "force")))) for _ in range(3 * ("at" in kind))]
        if kind in ("copy", "move"):
            old = self.draw.choice(self.folders)
            new = self.base / f"place{len(self.log)}"
            if kind == "copy":
                shutil.copytree(old, new)
                self.folders.append(new)
            else:
                old.rename(new)
                self.folders[self.folders.index(old)] = new
            self.log.append(f"{kind} {old.name} {new.name}")
        elif not begun:
            begun.append(self.start(self.words(self.draw.choice(("run", "gc", "force")) if kind == "kill" else kind)))
        if "kill" in kind:
            time.sleep(self.draw.uniform(0.3, 3.0))
            victim = begun.pop()
            os.killpg(victim.pid, signal.SIGKILL)
            victim.communicate()
        self.finish(*begun)

    def lost(self):
        """Return the pointers of all studies whose entry is not there and whole, after what a next command mends."""
        lost: list[tuple[str, ...]] = []
        for folder in self.folders:
            workdir = Workdir(folder)
            workdir.cache = type(workdir.cache)(self.cache)
            workdir.studies = type(workdir.studies)(self.cache)
            workdir.cache.sweep()
            # Not entered in the list by us: a copy may lie there and never have run.
            workdir.cache.settle(lambda workdir=workdir: claimed(workdir))
            pointed = workdir.keys()
            lost += [(folder.name, *e) for e in pointed if workdir.cache.lookup(*e, verify=True) is None]
        return lost


def main(schedules=20, seed=0, steps=12):
    """Return how many random schedules were tried, in which nobody lost anything."""
    import tempfile

    for number in range(schedules):
        with tempfile.TemporaryDirectory(prefix="hrcneuro-share-") as base:
            sharers = Sharers(Path(base), random.Random(1000 * seed + number))
            for _ in range(steps):
                sharers.step()
                assert not (lost := sharers.lost()), (number, lost, sharers.log)
            entries = len(list(sharers.cache.glob("[!.]*/*/*")))
            print(f"schedule {number:3}: {len(sharers.log)} commands, {entries} entries, nothing lost", flush=True)
    return schedules
