"""Another version of a library on one of the nodes: ``python tests/chaos/versions.py [TRIALS] [SEED]``.

Runs with two versions at once on one cache must not mix: each computes its own, under keys of its own. A worker with
another version computes nothing and says so. (The other version is one that an installation says it has: what decides
is the name in the key. Python's own version stands beside it there.)
"""

import importlib.util
import os
import random
import shutil
import subprocess
import sys
import time

from study import COMMAND, RUN, around, call, complete, contents, fresh, reference, states  # isort: skip
from dask_lab import dask_lab
from table import Fault, Lost, tell


def main(trials=4, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("versions"), random.Random(seed)
    other = base / "other"
    for name in ("numpy", "scipy", "mne", "pandas"):
        folder = other / f"{name}-99.1.dist-info"
        folder.mkdir(parents=True)
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 99.1\n")
    wanted = reference(base)
    mixed, worker = Fault("another library version, runs at once"), Fault("another library version, a dask worker")
    for number in range(trials):
        with mixed.trial(f"trial {number + 1}"):
            _at_once(base, other, wanted, draw)
    if not importlib.util.find_spec("distributed"):
        worker.skip("the extra dask is not installed")
    for number in range(0 if worker.note else trials):
        with worker.trial(f"trial {number + 1}"):
            _worker(base / f"dask{number}", base, other, wanted)
    shutil.rmtree(base)
    return tell([mixed, worker])


def _environment(other, cache=None):
    given = {"PYTHONPATH": os.pathsep.join([str(other), around()["PYTHONPATH"]])}
    return {**given, **({"HRCNEURO_CACHE": str(cache)} if cache else {})}


def _at_once(base, other, wanted, draw):
    shared = base / "shared"
    environments = [{"HRCNEURO_CACHE": str(shared)}, _environment(other, shared)]
    runs = []
    for number, environment in enumerate(environments):
        words = [*COMMAND, *RUN, "--workdir", base / f"node{number}", "-q", "--executor", "serial"]
        runs.append(
            subprocess.Popen([*map(str, words)], cwd=base, env=around(environment), stderr=subprocess.PIPE, text=True)
        )
        time.sleep(draw.uniform(0.0, 1.0))
    for run in runs:
        _, err = run.communicate(timeout=300)
        if run.returncode != 0:
            raise Lost(f"a run ends with {run.returncode}: {err[-500:]}")
    found = contents(shared)
    if other_bytes := [name for name in wanted if found.get(name) != wanted[name]]:
        raise Lost(f"other bytes under this version's keys: {other_bytes[:3]}")
    if len(found) != 2 * len(wanted):
        raise Lost(f"{len(found)} artifacts instead of {2 * len(wanted)}: the versions share keys")
    for number, environment in enumerate(environments):
        again = call(base, *RUN, "--workdir", base / f"node{number}", "--json", environment=environment)
        if set(states(again).values()) != {"hit"}:
            raise Lost(f"a second run does not find what the first made: {states(again)}")
    for folder in (shared, base / "node0", base / "node1"):
        shutil.rmtree(folder)


def _worker(folder, base, other, wanted):
    folder.mkdir()
    study = folder / "study"
    with dask_lab(folder, workers=1) as lab:
        lab.add_worker(PYTHONPATH=_environment(other)["PYTHONPATH"])
        words = [*RUN, "--workdir", study, "--executor", "dask", "--set", f"cluster.scheduler={lab.address}"]
        done = call(base, *words)
        found = contents(study / "cache")
        if any(wanted.get(name) != digest for name, digest in found.items()):
            raise Lost("a worker of another version has published something")
        if done.returncode == 0:
            complete(study, wanted)
        elif "a worker's installation differs from that of the run: libs: " not in done.stderr:
            raise Lost(f"exit code {done.returncode}: {done.stderr[-500:]}")
        lab.workers[-1].kill()
        lab.workers[-1].wait()
        again = call(base, *words)
        if again.returncode != 0:
            raise Lost(f"without that worker the run ends with {again.returncode}: {again.stderr[-500:]}")
        complete(study, wanted)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
