"""What universes will cost, said before they start: units, processor time and disk, by what earlier runs recorded."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from hrcneuro.answers.words import counted, roughly
from hrcneuro.cache.disk import free_bytes
from hrcneuro.cache.record import Record
from hrcneuro.contract import GROUP, OF_ALL
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.pipeline.disk_forecast import estimate, large
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.measured import Measured, of_kind
from hrcneuro.pipeline.universes import Lineage, Universe, droppable, last_uses
from hrcneuro.pipeline.workdir import Workdir

# Of what a group wrote in the study of twelve subjects: means, and strata; the tests stay.
_GROUP_GOES = 0.55


@dataclass(frozen=True)
class Cost:
    """What is still to be done of a multiverse.

    Attributes:
        universes, chains: How many there are in all.
        judged: Universes that have come to an end before.
        units: Results to compute, each once however many universes share it.
        shared: How many more it would be if every universe computed all that it needs by itself.
        there: Results that are in the cache already.
        seconds: Of processor time, of the units of which it is known.
        untimed: Stages of which nobody knows how long they take.
        disk: The most bytes at a time beyond what is there now.
        kept: Bytes that stay in the end.
        estimated: Whether sizes are partly estimated from the length of a session.
        unsized: Stages of which nobody knows how much they write.
        free: What is free where the cache lies, in bytes.
        limit: What was allowed, in bytes; None without a limit.
    """

    universes: int
    chains: int
    judged: int
    units: int
    shared: int
    there: int
    seconds: float
    untimed: tuple[str, ...]
    disk: int
    kept: int
    estimated: bool
    unsized: tuple[str, ...]
    free: int
    limit: int | None = None

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {**vars(self), "untimed": list(self.untimed), "unsized": list(self.unsized)}

    def lines(self) -> list[str]:
        """Return it in words."""
        known = f"; {self.judged} are judged already" if self.judged else ""
        found = [
            f"{counted(self.universes, 'universe')} on {counted(self.chains, 'preprocessing chain')}{known}",
            f"to compute: {counted(self.units, 'result')}, each once ({self.shared:,} more without sharing); "
            f"{self.there:,} are there already",
        ]
        if self.units:
            found += [f"processor time: {self._time()}", f"disk: {self._disk()}"]
        return found

    def _time(self) -> str:
        unknown = f"of {', '.join(self.untimed)} nothing has run yet: how long that takes is not known"
        if not self.seconds and self.untimed:
            return unknown
        known = f"about {roughly(self.seconds)}, by what earlier runs took"
        return f"{known}; {unknown}" if self.untimed else known

    def _disk(self) -> str:
        origin = "partly an estimate by the length of a session" if self.estimated else "by what earlier runs wrote"
        lacking = f"; of {', '.join(self.unsized)} it is not known" if self.unsized else ""
        limit = f", {large(self.limit)} are allowed" if self.limit is not None else ""
        return (
            f"about {large(self.disk)} at most at a time, {large(self.kept)} in the end, {origin}{lacking}; "
            f"{large(self.free)} are free{limit}"
        )

    def refuse(self) -> None:
        """Refuse a multiverse that does not fit on the disk.

        Raises:
            ConfigError: It does not.
        """
        room = self.free if self.limit is None else min(self.free, self.limit)
        if self.disk <= room:
            return
        allowed = f"{large(self.free)} are free" if room == self.free else f"--disk allows {large(room)}"
        larger = "" if room == self.free else "; or allow more: --disk GB"
        raise ConfigError(
            f"the multiverse needs about {large(self.disk)} of disk at a time, and {allowed}; nothing has run",
            cure="make room ('hrcneuro cache gc' drops what no study uses, 'hrcneuro cache slim preprocess epoch' "
            f"signals that can be made again), choose another place (--workdir DIR or HRCNEURO_CACHE){larger}; or let "
            "fewer subjects take part (--set study.subjects=...): one preprocessing chain must fit at a time",
        )


@dataclass(frozen=True)
class _Size:
    """What a task is expected to take; None where nobody knows."""

    seconds: float | None
    size: int | None
    goes: int
    estimated: bool


def cost(
    workdir: Workdir,
    every: Sequence[Universe],
    pending: Sequence[Universe],
    plan: Callable[[Universe], Iterable[Item]],
    *,
    chains: int,
    limit: int | None = None,
) -> Cost:
    """Return what the universes that are not judged yet will cost.

    Args:
        workdir: The study's, whose results' records tell what tasks took.
        every: All universes.
        pending: Those that are not judged, in the order in which they run.
        plan: Returns how a universe's tasks stand.
        chains: Preprocessing chains of all.
        limit: What disk is allowed, in bytes.
    """
    new: dict[Lineage, _Size] = {}
    there: set[Lineage] = set()
    expected, needs = _Expected(workdir), 0
    untimed, unsized = dict[str, None](), dict[str, None]()
    now = peak = 0
    last = last_uses(pending)
    for one in pending:
        states = {(item.stage, item.unit): item.state for item in plan(one)}
        for task, lineage in one.lineages.items():
            if lineage in new:
                needs += 1
            elif states[task.name, task.unit] is State.WOULD_RUN:
                # Perhaps again: an earlier universe can do without a signal that was dropped, and this one cannot.
                there.discard(lineage)
                new[lineage] = taken = expected.of(task, one)
                now += taken.size or 0
                untimed.update({task.name: None} if taken.seconds is None else {})
                unsized.update({task.name: None} if taken.size is None else {})
            else:
                there.add(lineage)
        peak = max(peak, now)
        now -= sum(
            new[lineage].goes for lineage in one.lineages.values() if lineage in new and last[lineage] == one.number
        )
    return Cost(
        universes=len(every),
        chains=chains,
        judged=len(every) - len(pending),
        units=len(new),
        shared=needs,
        there=len(there),
        seconds=sum(one.seconds or 0.0 for one in new.values()),
        untimed=tuple(untimed),
        disk=peak,
        kept=now,
        estimated=any(one.estimated for one in new.values()),
        unsized=tuple(unsized),
        free=free_bytes(workdir.cache.root),
        limit=limit,
    )


class _Expected:
    """What tasks are expected to take: as last time, as others of their kind, or by the length of a session."""

    def __init__(self, workdir: Workdir) -> None:
        self._workdir = workdir
        self._own: dict[tuple[str, str], Record | None] = {}
        self._alike: dict[tuple[str, bool], list[Record]] = {}

    def of(self, task: Task, universe: Universe) -> _Size:
        records = self._records(task)
        if records:
            seconds = [s for s in (Measured.of(record).seconds for record in records) if s]
            goes = [sum(record.outputs[name]["size"] for name in droppable(record)) for record in records]
            size = statistics.median(record.size for record in records)
            middle = statistics.median(seconds) if seconds else None
            return _Size(middle, round(size), round(statistics.median(goes)), False)
        size_ = estimate(task.name, task.unit, universe.settings)
        goes_ = (size_ or 0) * (_GROUP_GOES if task.unit in OF_ALL else 1.0)
        return _Size(None, size_, round(goes_), size_ is not None)

    def _records(self, task: Task) -> list[Record]:
        place = (task.name, task.unit)
        if place not in self._own:
            try:
                self._own[place] = self._workdir.record(*place)
            except DataError:
                self._own[place] = None
        own = self._own[place]
        if own is not None:
            return [own]
        kind = (task.name, task.unit == GROUP)
        if kind not in self._alike:
            self._alike[kind] = of_kind(self._workdir, task.name, group=kind[1])
        return self._alike[kind]
