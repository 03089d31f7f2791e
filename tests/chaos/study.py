"""The study that every fault is tried on: seven tasks, three seconds; commands in processes that start at once."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))
# A process that forks must have no other thread: libraries read this when they are loaded.
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import table
from tiny_study import ROOT, alive, half_written, write_tiny

from hrcneuro.cache.store import Store
from hrcneuro.pipeline.workdir import Workdir

COMMAND = [sys.executable, "-m", "hrcneuro"]
RUN = ("run", "pipeline.toml", "--no-figures")


def fresh(name):
    """Return an empty folder with the study's configuration; who is done with it removes it."""
    return write_tiny(Path(tempfile.mkdtemp(prefix=f"hrcneuro-{name}-")))


def call(folder, *words, environment=None, timeout=300, prefix=(), user=None):
    """Run a command to its end and return what it did."""
    return subprocess.run(
        [*prefix, *COMMAND, *map(str, words)],
        cwd=folder, env=around(environment), capture_output=True, text=True, timeout=timeout, check=False, user=user,
    )  # fmt: skip


def around(environment=None):
    """Return the environment of a command: this package, and no other cache than its folder's."""
    given = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1", **(environment or {})}
    if "HRCNEURO_CACHE" not in (environment or {}):
        given.pop("HRCNEURO_CACHE", None)
    return given


def states(done):
    """Return ``{"stage unit": state}`` of what a command printed with ``--json``."""
    return {f"{item['stage']} {item['unit']}": item["state"] for item in json.loads(done.stdout)["items"]}


def reference(folder):
    """Return the digests of all artifacts of a study that nobody disturbed, in one process."""
    done = call(folder, *RUN, "--executor", "serial", "--workdir", "calm")
    assert done.returncode == 0, done.stderr
    return contents(folder / "calm" / "cache")


def contents(cache):
    """Return ``{entry/file: sha256}`` of all visible entries, by their bytes; a record that names more is a loss."""
    found = {}
    for record in sorted(cache.glob("[!.]*/*/[!.]*/record.json")):
        entry = record.parent
        for name in json.loads(record.read_text())["outputs"]:
            path = entry / name
            if not path.is_file():
                raise table.Lost(f"{path.relative_to(cache)} is missing")
            found[path.relative_to(cache).as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def check(study, wanted, before=()):
    """Return what is visible in a study's cache, after checking that it is sound.

    Args:
        study: The working folder.
        wanted: What an undisturbed study has; other bytes are a loss.
        before: What was visible before; what is gone is a loss.
    """
    now = contents(study / "cache")
    other = sorted(name for name, digest in now.items() if wanted.get(name) != digest)
    gone = sorted(set(before) - set(now))
    if other or gone:
        raise table.Lost(f"other bytes: {other[:3]}; gone: {gone[:3]}")
    store = Store(study / "cache")
    bad = [str(entry) for entry in store.entries() if store.diagnose(*entry.parts[-3:], verify=True)]
    pointed = Workdir(study, study / "cache").keys()
    bad += ["/".join(one) for one in pointed if store.lookup(*one) is None]
    if bad:
        raise table.Lost(f"not sound: {bad[:3]}")
    return now


def complete(study, wanted):
    """Raise what is missing, or too much, of a study that says it is complete."""
    now = check(study, wanted)
    if now != wanted:
        raise table.Lost(f"it says it is complete, and has {len(now)} of {len(wanted)} artifacts")
    if left := half_written(study):
        raise table.Lost(f"half-written: {left[:2]}")


def ended(process, seconds=30.0):
    """Wait until nobody of a process group lives; kill what does not end."""
    deadline = time.monotonic() + seconds
    while alive(process.pid):
        if time.monotonic() > deadline:
            os.killpg(process.pid, signal.SIGKILL)
            raise table.Lost("its processes do not end")
        time.sleep(0.01)
