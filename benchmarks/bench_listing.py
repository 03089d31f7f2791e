"""What many subjects and many entries cost a command that computes nothing: status, a run of hits, a look-up, a list.

A small synthetic study of two subjects is computed once. Its records, with other units and keys, and files of a few
bytes stand for those of a study of hundreds, under the keys that such a study has: an executor publishes them where a
worker would compute. Then ``hrcneuro status`` is timed in processes of its own, with modules that are compiled, and
look-ups in a cache that grows from 10^2 to 10^5 entries. The exit code is 1 where a status of the numbers (median of
five) takes a second of the processor or more, or look-ups in one of the caches more than one and a half times those in
another.
"""

from __future__ import annotations

import argparse
import concurrent.futures as futures
import hashlib
import json
import os
import random
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import _measure

from hrcneuro.cache.record import Record, write_record
from hrcneuro.cache.store import Store
from hrcneuro.config import settings as config
from hrcneuro.contract import OF_ALL
from hrcneuro.pipeline import graph
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import Job, Outcome
from hrcneuro.pipeline.walk import Run
from hrcneuro.pipeline.workdir import Workdir

ROOT = Path(__file__).parents[1]
SMOKE = ROOT / "configs" / "smoke.toml"
ENTRIES = (100, 1_000, 10_000, 100_000)
_LIMIT_S, _LIMIT_RATIO, _LOOKED_UP = 1.0, 1.5, 2000

_COMPILED = tempfile.TemporaryDirectory()

Models = Mapping[tuple[str, bool], Record]
"""(name of a task, whether it is of all subjects) -> a record that a real one wrote."""


class Pretend:
    """An executor whose jobs compute nothing: each publishes what a real one of its kind has published."""

    def __init__(self, models: Models) -> None:
        self._models = models
        self.writing_s = 0.0

    def __enter__(self) -> Pretend:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def submit(self, call: Callable[..., Outcome], job: Job) -> futures.Future:
        """Return a finished future."""
        start = time.perf_counter()
        model = self._models[job.task.name, job.task.unit in OF_ALL]
        record = entry(job.root, model, job.task.unit, job.key, job.parts)
        self.writing_s += time.perf_counter() - start
        future: futures.Future = futures.Future()
        future.set_result(Outcome(State.RAN, record))
        return future


def entry(root: Path, model: Record, unit: str, key: str, parts: Mapping) -> Record:
    """Write an entry like another one, of another unit and key; nothing waits for the disk."""
    folder = root / model.stage / unit / key
    folder.mkdir(parents=True)
    outputs = {}
    for known in model.outputs:
        name = known.replace(model.unit, unit) if model.unit not in OF_ALL else known
        content = f"{model.stage} {unit} {name}".encode()
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
        outputs[name] = {"sha256": hashlib.sha256(content).hexdigest(), "size": len(content)}
    record = replace(model, unit=unit, key=key, parts=parts, outputs=outputs)
    write_record(folder, record)
    return record


def command(*arguments: str | Path) -> _measure.Seconds:
    """Return what a command of the program took."""
    env = {**os.environ, **dict.fromkeys(_measure.THREADS, "1"), "PYTHONPATH": str(ROOT)}
    # As where the program is installed: its modules were compiled at the first call. Here, away from the sources.
    env.pop("PYTHONDONTWRITEBYTECODE", None)
    env.setdefault("PYTHONPYCACHEPREFIX", _COMPILED.name)
    start = time.perf_counter()
    given = [sys.executable, "-m", "hrcneuro", *map(str, arguments)]
    process = subprocess.Popen(given, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"hrcneuro {' '.join(map(str, arguments))} failed with status {status}")
    return _measure.Seconds(time.perf_counter() - start, usage.ru_utime + usage.ru_stime)


def models_of(folder: Path) -> Models:
    """Return the records of a small study, computed in a folder."""
    command("run", "--config", SMOKE, "--set", 'study.subjects=["s01", "s02"]', "--workdir", folder, "-j", "1")
    workdir = Workdir(folder)
    places = [(stage, unit) for stage, unit, _ in sorted(workdir.keys()) if unit != "s02"]
    return {(stage, unit in OF_ALL): workdir.record(stage, unit) for stage, unit in places}


def study_of(subjects: int, folder: Path) -> list[str]:
    """Return the options of a command over a study of so many subjects."""
    names = json.dumps([f"s{number:05d}" for number in range(1, subjects + 1)])
    (folder / "many.toml").write_text(SMOKE.read_text().replace('["s01", "s02", "s03"]', names))
    return ["--config", str(folder / "many.toml"), "--workdir", str(folder)]


def walked(subjects: int, folder: Path, models: Models) -> tuple[int, float]:
    """Make a study of so many subjects; return its tasks, and the seconds of the walk, without writing the results."""
    study_of(subjects, folder)
    settings = config.load(folder / "many.toml", [], folder=folder)
    numbers = graph.closure(settings, graph.targets(settings, settings.stages, ()))
    tasks = numbers | graph.pictures(settings, numbers, joint=True)
    pretend = Pretend(models)
    start = time.perf_counter()
    items = Run(settings, Workdir(folder), tasks).run(pretend)
    taken = time.perf_counter() - start
    for item in items:
        if not item.state.done:
            raise SystemExit(f"{item.stage} of {item.unit}: {item.why}")
    return len(items), taken - pretend.writing_s


def statuses(subjects: int, models: Models) -> bool:
    """Print what status over a study of so many subjects takes; return whether it is soon enough."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tasks, walk_s = walked(subjects, folder, models)
        print(
            f"| the walk of a run of {subjects} subjects, {tasks} tasks, without the work | {walk_s:.2f} |", flush=True
        )
        given = study_of(subjects, folder)
        seconds = []
        for what, more in (("numbers", ["--no-figures"]), ("with pictures", [])):
            calls = [command("status", *given, *more) for _ in range(5)]
            cpu = _measure.median([one.cpu for one in calls])
            seconds += [cpu] if more else []
            each = ", ".join(f"{one.cpu:.2f}" for one in calls)
            wall = _measure.median([one.wall for one in calls])
            print(f"| status, {subjects} subjects, {what}: median of {each} | {wall:.2f} ({cpu:.2f}) |", flush=True)
        # The program's modules are read and parsed anew, as after an update.
        (folder / "cache" / ".memo.json").unlink()
        took = command("status", *given, "--no-figures")
        print(f"| … numbers, where nothing of the program is remembered | {took.wall:.2f} ({took.cpu:.2f}) |")
        took = command("run", *given, "--dry-run", "--no-figures")
        print(f"| run --dry-run, {subjects} subjects, numbers | {took.wall:.2f} ({took.cpu:.2f}) |", flush=True)
    return max(seconds) < _LIMIT_S


def lookups(models: Models, most: int) -> bool:
    """Print what look-ups take in caches of several sizes; return whether their number does not matter."""
    model = models["erp", False]
    rng = random.Random(2023)
    medians = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        store, places = Store(folder / "cache"), []
        for size in (one for one in ENTRIES if one <= most):
            while len(places) < size:
                places.append((f"s{len(places):06d}", secrets.token_hex(8)))
                entry(store.root, model, *places[-1], model.parts)
            found, absent = [], []
            for unit, key in rng.choices(places, k=_LOOKED_UP):
                start = time.perf_counter()
                hit = store.lookup("erp", unit, key)
                found.append(time.perf_counter() - start)
                start = time.perf_counter()
                miss = store.lookup("erp", unit, key[::-1])
                absent.append(time.perf_counter() - start)
                if hit is None or miss is not None:
                    raise SystemExit(f"the look-up of {unit} {key} went wrong")
            medians.append(_measure.median(found))
            hit_us, miss_us = 1e6 * medians[-1], 1e6 * _measure.median(absent)
            print(
                f"| a look-up among {size:,} entries, there (absent) | {hit_us:.0f} µs ({miss_us:.0f} µs) |", flush=True
            )
        for words in (["cache", "ls"], ["cache", "gc", "--dry-run", "--unlisted"]):
            took = command(*words, "--workdir", folder)
            print(f"| {' '.join(words)}, {len(places):,} entries | {took.wall:.1f} ({took.cpu:.1f}) |", flush=True)
    return max(medians) <= _LIMIT_RATIO * min(medians)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="up to 10,000 entries, and 40 subjects")
    parser.add_argument("--subjects", type=int, default=400, help="subjects of the study (default 400)")
    chosen = parser.parse_args()
    subjects, most = (40, 10_000) if chosen.quick else (chosen.subjects, ENTRIES[-1])
    print(_measure.machine())
    print("| what | seconds by the clock (of the processor) |\n|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        models = models_of(Path(folder))
    soon, flat = statuses(subjects, models), lookups(models, most)
    print(f"status within {_LIMIT_S:g} s: {soon}; look-ups do not depend on the number of entries: {flat}")
    return int(not (soon and flat))


if __name__ == "__main__":
    sys.exit(main())
