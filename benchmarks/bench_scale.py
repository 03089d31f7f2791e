"""What a subject costs by stage as a study grows, from the cache's own records.

Small synthetic studies of 1, 2, 4, 8 and 16 subjects are computed, numbers alone, by the serial executor, each by one
command in an empty folder. The exit code is 1 where a subject of 16 takes another processor time than one of 2, by more
than 15 %, be it in its own tasks or as its share of the whole command. ``benchmarks/scale_schedule.py`` says from
records like these what hundreds of subjects would take.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import _measure
from bench_study import ROOT, STAGES, run

from hrcneuro.cache.record import Record
from hrcneuro.contract import OF_ALL
from hrcneuro.pipeline.measured import Measured
from hrcneuro.pipeline.workdir import Workdir

COUNTS = (1, 2, 4, 8, 16)
_TOLERANCE = 0.15

Kind = tuple[str, bool]
"""(name of a task, whether it is of all subjects)."""
Records = Mapping[Kind, Sequence[Record]]


def study(subjects: int) -> tuple[float, Records]:
    """Compute a small study; return the processor time of the command, and its records."""
    names = json.dumps([f"s{number:02d}" for number in range(1, subjects + 1)])
    given = ["--config", str(ROOT / "configs" / "smoke.toml"), "--set", f"study.subjects={names}"]
    with tempfile.TemporaryDirectory() as folder:
        pipeline = Path(folder) / "numbers.toml"
        pipeline.write_text(f"stages = {json.dumps(STAGES)}\nreport = false\n")
        how = ["--workdir", folder, "--executor", "serial", "--no-figures"]
        took = run(ROOT, ["run", str(pipeline), *given, *how])
        return took.cpu, records_of(Workdir(Path(folder)))


def records_of(workdir: Workdir) -> Records:
    """Return the records that a study's results point at, those of each kind of task by unit."""
    found: dict[Kind, list[Record]] = {}
    entries = workdir.keys()
    for stage, unit, _ in sorted(entries):
        found.setdefault((stage, unit in OF_ALL), []).append(workdir.record(stage, unit))
    return found


def read_of(record: Record, records: Records) -> int:
    """Return the bytes of the files that a task was handed."""
    every = {(one.stage, one.unit): one.outputs for some in records.values() for one in some}
    places = (name.split("/", 2) for name in record.parts["inputs"])
    return sum(every[stage, unit][name]["size"] for stage, unit, name in places)


def costs(counts: Sequence[int]) -> bool:
    """Print what a subject costs in studies of several sizes; return whether that stays within the tolerance."""
    cpu: dict[int, float] = {}
    known: dict[int, Records] = {}
    for subjects in counts:
        cpu[subjects], known[subjects] = study(subjects)
        print(f"{subjects} subjects: {cpu[subjects]:.1f} s of the processor", flush=True)
    table("processor s", known, lambda one, n: Measured.of(one).cpu_seconds)
    table("s by the clock", known, lambda one, n: Measured.of(one).seconds)
    table("MB written", known, lambda one, n: one.size / 1e6)
    table("MB read", known, lambda one, n: read_of(one, known[n]) / 1e6)
    table("MB of memory, of the process up to then", known, lambda one, n: Measured.of(one).peak_mb)
    each = {n: _of_subjects(known[n]) / n for n in counts}
    few, many = counts[1], counts[-1]
    ratio, by_one = each[many] / each[few], cpu[many] / many / (cpu[few] / few)
    print("\nprocessor s of a subject, all stages: " + ", ".join(f"{s:.2f} (of {n})" for n, s in each.items()))
    print(f"a subject of {many} to one of {few}: {ratio:.3f}; the command, with start and groups: {by_one:.3f}")
    return max(abs(ratio - 1), abs(by_one - 1)) <= _TOLERANCE


def table(what: str, known: Mapping[int, Records], value: Callable[[Record, int], float]) -> None:
    """Print a value of the records by stage and size of the study: the median of its subjects."""
    print(f"\n{what}\n| stage | {' | '.join(f'{n} subjects' for n in known)} |\n{'|---' * (len(known) + 1)}|")
    for name, of_all in next(iter(known.values())):
        medians = [statistics.median(value(one, n) for one in records[name, of_all]) for n, records in known.items()]
        print(f"| {name}{', group' if of_all else ''} | {' | '.join(f'{one:.2f}' for one in medians)} |", flush=True)


def _of_subjects(records: Records) -> float:
    return sum(Measured.of(one).cpu_seconds for (_, of_all), some in records.items() if not of_all for one in some)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="1, 2 and 4 subjects")
    chosen = parser.parse_args()
    print(_measure.machine())
    return int(not costs(COUNTS[:3] if chosen.quick else COUNTS))


if __name__ == "__main__":
    sys.exit(main())
