"""Universes of a study: what they share, the order that lets entries go early, what they will cost, what may go when.

A task's lineage is what decides its result through all that it stands on, known before anything runs: its parameters,
code, libraries and sources, and the lineages of what it reads. Universes in which a task has one lineage share it; the
cache's own keys, which hash what was really written, may share more, never less.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hrcneuro import stages
from hrcneuro.cache import fingerprint
from hrcneuro.cache.record import Entry, Record, dropped, read_record
from hrcneuro.config.settings import Settings
from hrcneuro.contract import OF_ALL
from hrcneuro.pipeline import graph, slimming
from hrcneuro.pipeline.claims import claimed_by_others
from hrcneuro.pipeline.graph import Graph, Task
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.keys import Keys
from hrcneuro.pipeline.workdir import Workdir

_CLEAN = "preprocess"
# Smaller files stay: tables that verdicts rest on, and that say what a universe was.
_SMALL = 1_000_000
# So do a group's tests, however large: as the code that judges changes, they are judged anew without being made again.
_TESTED = "_stats.parquet"

Lineage = tuple[str, str, str]
"""A task's stage and unit, and what decides its result."""


@dataclass(frozen=True)
class Universe:
    """One way to analyse the study.

    Attributes:
        number: 0 is the study's own.
        chosen: Choice -> name of the value that was taken.
        settings: The configuration with these choices.
        graph: Its tasks, numbers alone.
        lineages: Task -> its lineage.
    """

    number: int
    chosen: Mapping[str, str]
    settings: Settings
    graph: Graph
    lineages: Mapping[Task, Lineage]

    @property
    def id(self) -> str:
        """What decides all its results, 16 digits."""
        return fingerprint.digest(sorted(self.lineages.values()))[:16]

    def analysis(self, stage: str) -> str:
        """Return what decides all results of a stage, 16 digits."""
        return fingerprint.digest(sorted(self.of(stage)))[:16]

    def of(self, stage: str) -> tuple[Lineage, ...]:
        """Return the lineages of a stage's tasks."""
        return tuple(lineage for lineage in self.lineages.values() if lineage[0] == stage)


def universe(number: int, chosen: Mapping[str, str], settings: Settings, names: Sequence[str], keys: Keys) -> Universe:
    """Return a universe of these stages.

    Raises:
        ConfigError: The stages need one that moves an arm in real time.
        DataError: A source file is missing or cannot be read.
    """
    tasks = graph.closure(settings, graph.targets(settings, names, ()))
    graph.check_unattended(settings, tasks)
    return Universe(number, chosen, settings, tasks, lineages(keys.of(settings), tasks))


def lineages(keys: Keys, tasks: Graph) -> dict[Task, Lineage]:
    """Return what decides the result of each task of a graph, which is in an order that respects its needs."""
    found: dict[Task, Lineage] = {}
    for task, needs in tasks.items():
        above = {f"{one.name}/{one.unit}": [found[one][2], need.files, need.required] for one, need in needs.items()}
        digest = fingerprint.digest({"own": keys.parts(task, ()), "above": above})[:16]
        found[task] = (task.name, task.unit, digest)
    return found


def chains(universes: Iterable[Universe]) -> dict[int, int]:
    """Return universe's number -> number of its preprocessing chain, from 0, in the order in which they come."""
    known: dict[tuple[Lineage, ...], int] = {}
    return {one.number: known.setdefault(one.of(_CLEAN), len(known)) for one in universes}


def in_order(universes: Sequence[Universe]) -> list[Universe]:
    """Return universes so that those that share a stage's results follow each other, stage by stage: what one chain
    needs can go before the next one begins.
    """
    ranks: list[dict[tuple[Lineage, ...], int]] = []
    for name in stages.NAMES:
        seen: dict[tuple[Lineage, ...], int] = {}
        for one in universes:
            seen.setdefault(one.of(name), len(seen))
        ranks.append(seen)
    places = {
        one.number: [seen[one.of(name)] for name, seen in zip(stages.NAMES, ranks, strict=True)] for one in universes
    }
    return sorted(universes, key=lambda one: (places[one.number], one.number))


def last_uses(universes: Sequence[Universe]) -> dict[Lineage, int]:
    """Return lineage -> number of the last of these universes, in their order, that needs its result."""
    return {lineage: one.number for one in universes for lineage in one.lineages.values()}


def droppable(record: Record) -> list[str]:
    """Return the names of an entry's files that go after their last use: signals and large tables, but no tests."""
    suffix, of_all = slimming.SUFFIX, record.unit in OF_ALL
    return [
        name
        for name, about in record.outputs.items()
        if (name.endswith(suffix) or about["size"] >= _SMALL) and not (of_all and name.endswith(_TESTED))
    ]


def let_go(workdir: Workdir, study: Workdir, items: Iterable[Item]) -> int:
    """Drop what these tasks wrote and nothing needs any more; return how many bytes went.

    Records, small tables and a group's tests stay. Only entries that the multiverse has made itself go, and none that
    another study, or another run, points at.

    Args:
        workdir: The multiverse's.
        study: The study's, whose results point at what is its own, whether the cache's list says so or not.
        items: Of the tasks.

    Raises:
        DataError: What other studies point at is not known.
        HrcError: A file cannot be removed.
    """
    used = claimed_by_others(workdir) | study.keys()
    mine, size = workdir.study().ids, 0
    for item in items:
        entry: Entry = (item.stage, item.unit, item.key)
        folder = workdir.cache.folder(*entry)
        record = read_record(folder)
        if record is None or entry in used or record.provenance.get("study") not in mine:
            continue
        names = [name for name in droppable(record) if name not in dropped(folder)]
        files = [folder / name for name in names]
        if files and slimming.drop(workdir, entry, files):
            size += sum(record.outputs[name]["size"] for name in names)
    return size


def judged_place(folder: Path, one: Universe, code: str) -> Path:
    """Return where the verdicts of a universe are kept, by what decides them: its results, and the code that judges."""
    return folder / f"{fingerprint.digest([one.id, code])[:16]}.json"
