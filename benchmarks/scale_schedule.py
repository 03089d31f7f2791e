"""What hundreds of subjects would take on a cluster, by the records of a study that has run.

``python benchmarks/scale_schedule.py WORKDIR --config FILE``: first the group stages of the study over up to 400
subjects (its own, again and again), in processes of their own; then, from what these and the records tell, a simulated
schedule of the product's own graph for 400 and 10,000 subjects on machines of several sizes, whose cores are as quick
as the one of the records. How quick the disk is that machines share is taken to be what ``SITES`` says.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import statistics
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import _measure
from _schedule import Load, Schedule, Site, schedule
from bench_scale import Kind, records_of
from bench_study import ROOT, STAGES

from hrcneuro import stages
from hrcneuro.cache.record import Record
from hrcneuro.config import settings as config
from hrcneuro.contract import GROUP, OF_ALL, Inputs
from hrcneuro.pipeline import graph
from hrcneuro.pipeline.measured import Measured
from hrcneuro.pipeline.workdir import Workdir

STUDIES = (400, 10_000)
GROUPS = (17, 50, 100, 200, 400)
SITES = {
    "one machine: 8 cores, 64 GB": Site(1, 8, 64.0, 500.0),
    "10 nodes of 32 cores, 128 GB": Site(10, 32, 128.0, 1000.0),
    "100 nodes of 32 cores, 128 GB": Site(100, 32, 128.0, 1000.0),
}
_MOST_SHARE = 0.5  # of this machine's memory, that a group may want to be tried


@dataclass(frozen=True)
class Grown:
    """What a group stage takes with so many subjects: seconds, of the processor, GB at its peak, bytes written."""

    subjects: int
    seconds: float
    cpu: float
    memory_gb: float
    written: int


def group(stage: str, given: Path, folder: Path, subjects: int) -> Grown:
    """Return what a group stage takes over so many subjects: those of a study that has run, again and again."""
    settings, workdir = config.load(given, [], folder=folder), Workdir(folder)
    own = settings.sections[stage]
    work = stages.load(stage).group
    assert work is not None
    units = [unit for name, unit, _ in sorted(workdir.keys()) if name == stage and unit not in OF_ALL]
    files: dict[str, dict[str, dict[str, Path]]] = {}
    for read in work.needed(own):
        for number in range(subjects):
            unit, source = f"s{number + 1:05d}", units[number % len(units)]
            record = workdir.record(read.stage, source)
            place = workdir.cache.folder(read.stage, source, record.key)
            matching = [name for name in record.outputs if any(fnmatch(name, pattern) for pattern in read.files)]
            here = {name.replace(source, unit): place / name for name in matching}
            files.setdefault(read.stage, {}).setdefault(unit, {}).update(here)
    with tempfile.TemporaryDirectory() as out:
        Path("/proc/self/clear_refs").write_text("5")
        begun, cpu = time.perf_counter(), time.process_time()
        work.run(own, Inputs(GROUP, files), Path(out))
        took, cpu = time.perf_counter() - begun, time.process_time() - cpu
        written = sum(path.stat().st_size for path in Path(out).rglob("*") if path.is_file())
    lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024 / 1e9
    return Grown(subjects, took, cpu, peak, written)


def groups(given: Path, folder: Path, counts: Sequence[int]) -> dict[str, list[Grown]]:
    """Print and return what each group stage that has run takes as the study grows."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    entries = Workdir(folder).keys()
    ran = {name for name, unit, _ in entries if unit == GROUP}
    found: dict[str, list[Grown]] = {}
    print("| group stage | subjects | s (of the processor) | peak, GB | written, MB |\n|---|---|---|---|---|")
    for stage in [name for name in STAGES if name in ran and stages.load(name).subject]:
        for subjects in counts:
            before = found.get(stage, [])
            if before and before[-1].memory_gb * subjects / before[-1].subjects > _MOST_SHARE * memory:
                print(f"| {stage} | {subjects} | not tried: too little memory here | | |")
                continue
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                one = pool.apply(group, (stage, given, folder, subjects))
            found.setdefault(stage, []).append(one)
            print(
                f"| {stage} | {subjects} | {one.seconds:.1f} ({one.cpu:.1f}) | {one.memory_gb:.2f} "
                f"| {one.written / 1e6:.1f} |",
                flush=True,
            )
    return found


def line(points: Sequence[tuple[float, float]], at: float) -> float:
    """Return the value at a place of the straight line that fits some points best; never below 0."""
    if len(points) < 2:
        return points[0][1]
    slope, level = statistics.linear_regression(*zip(*points, strict=True))
    return max(0.0, level + slope * at)


def planned(given: Path, folder: Path, subjects: int) -> graph.Graph:
    """Return the graph of a study of so many subjects, with the pictures that the records have."""
    names = [f"s{number:05d}" for number in range(1, subjects + 1)]
    settings = config.load(given, [f"study.subjects={json.dumps(names)}", "study.exclude=[]"], folder=folder)
    numbers = graph.closure(settings, graph.targets(settings, settings.stages, ()))
    return numbers | graph.pictures(settings, numbers, joint=True)


def loads(
    tasks: graph.Graph, records: Mapping[Kind, Sequence[Record]], grown: Mapping[str, Sequence[Grown]], subjects: int
) -> dict[graph.Task, Load]:
    """Return what each task would take: as those of its kind did, one after the other; a group as its line says."""
    found: dict[graph.Task, Load] = {}
    sizes: dict[tuple[Kind, tuple[str, ...]], int] = {}
    counted: dict[Kind, int] = {}

    def size(kind: Kind, patterns: tuple[str, ...]) -> int:
        if (kind, patterns) not in sizes:
            matched = [
                sum(about["size"] for name, about in one.outputs.items() if any(fnmatch(name, p) for p in patterns))
                for one in records[kind]
            ]
            sizes[kind, patterns] = round(statistics.mean(matched))
        return sizes[kind, patterns]

    for task, needs in tasks.items():
        kind = task.name, task.unit in OF_ALL
        known = records[kind]
        number = counted[kind] = counted.get(kind, -1) + 1
        one = Measured.of(known[number % len(known)])
        # On a machine that does nothing else, the clock agrees with the processor; on a busy one it does not.
        read = sum(size((source.name, source.unit in OF_ALL), need.files) for source, need in needs.items())
        seconds, memory = one.cpu_seconds or one.seconds, one.peak_mb * 2**20 / 1e9
        if kind[1] and (points := grown.get(task.name)):
            seconds = line([(p.subjects, p.cpu) for p in points], subjects)
            memory = line([(p.subjects, p.memory_gb) for p in points], subjects)
        found[task] = Load(seconds, memory, read, one.size)
    return found


def schedules(given: Path, folder: Path, grown: Mapping[str, Sequence[Grown]]) -> None:
    """Print what studies of several sizes would take on several clusters."""
    records = records_of(Workdir(folder))
    print(
        "| subjects | tasks | cluster | hours | core-hours | longest chain, h | disk alone, h | written, GB "
        f"| moved, GB | largest task, GB | no room for |\n{'|---' * 11}|"
    )
    for subjects in STUDIES:
        whole = planned(given, folder, subjects)
        tasks = {task: needs for task, needs in whole.items() if (task.name, task.unit in OF_ALL) in records}
        of_tasks = loads(tasks, records, grown, subjects)
        for name, site in SITES.items():
            _row(subjects, name, schedule(tasks, of_tasks, site), len(tasks))


def _row(subjects: int, site: str, one: Schedule, tasks: int) -> None:
    unfit = ", ".join(str(task) for task in one.unfit) or "–"
    print(
        f"| {subjects:,} | {tasks:,} | {site} | {one.hours:.2f} | {one.core_hours:.1f} | {one.longest_hours:.2f} "
        f"| {one.disk_hours:.2f} | {one.written / 1e9:.0f} | {one.moved / 1e9:.0f} | {one.largest_gb:.1f} | {unfit} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workdir", metavar="WORKDIR", type=Path, help="working folder of a study that has run")
    parser.add_argument("--config", metavar="FILE", type=Path, default=ROOT / "configs" / "paper.toml", help="its own")
    parser.add_argument("--quick", action="store_true", help="groups of 17 and 50 subjects")
    chosen = parser.parse_args()
    os.environ.update(dict.fromkeys(_measure.THREADS, "1"))
    print(_measure.machine())
    given, folder = chosen.config.resolve(), chosen.workdir.resolve()
    grown = groups(given, folder, GROUPS[:2] if chosen.quick else GROUPS)
    schedules(given, folder, grown)


if __name__ == "__main__":
    main()
