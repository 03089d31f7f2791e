"""When a study would be done on so many machines: tasks, each as soon as what it reads is there and a place is free."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Hashable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Load:
    """What a task takes.

    Attributes:
        seconds: How long it runs, on one core.
        memory_gb: Of its process, at most.
        read, written: Bytes of files.
    """

    seconds: float
    memory_gb: float
    read: int
    written: int


@dataclass(frozen=True)
class Site:
    """Machines that are alike, and the disk that they share."""

    nodes: int
    cores: int
    memory_gb: float
    disk_mb_s: float


@dataclass(frozen=True)
class Schedule:
    """What came out.

    Attributes:
        hours: From the first start to the last end, where the disk is as quick as in the records.
        core_hours: Of all tasks.
        disk_hours: What the shared disk alone takes to move all bytes: no schedule is shorter.
        longest_hours: The longest chain of tasks of which each reads the one before: no schedule is shorter.
        written, moved: Bytes that are written; read and written.
        unfit: Tasks that no machine has the memory for; what stands on them is left out as well.
        largest_gb: The most memory that a task wants.
    """

    hours: float
    core_hours: float
    disk_hours: float
    longest_hours: float
    written: int
    moved: int
    unfit: tuple[Hashable, ...]
    largest_gb: float


def schedule(needs: Mapping[Hashable, Collection[Hashable]], loads: Mapping[Hashable, Load], site: Site) -> Schedule:
    """Return when all is done.

    Args:
        needs: Task -> those that it reads; in the order in which tasks that could start are started.
        loads: Task -> what it takes.
        site: The machines. A task takes a core and its memory of the machine with the most cores free.
    """
    order = {task: place for place, task in enumerate(needs)}
    left = {task: len(sources) for task, sources in needs.items()}
    then: dict[Hashable, list[Hashable]] = {task: [] for task in needs}
    for task, sources in needs.items():
        for source in sources:
            then[source].append(task)
    cores, memory = [site.cores] * site.nodes, [site.memory_gb] * site.nodes
    ready = [(order[task], task) for task, count in left.items() if not count]
    heapq.heapify(ready)
    running: list[tuple[float, int, Hashable, int]] = []
    now, core_s, chain, unfit = 0.0, 0.0, dict.fromkeys(needs, 0.0), []
    while ready or running:
        aside = []
        while ready and any(cores):
            place, task = heapq.heappop(ready)
            load = loads[task]
            if load.memory_gb > site.memory_gb:
                unfit.append(task)
                continue
            node = max(
                (n for n in range(site.nodes) if cores[n] and memory[n] >= load.memory_gb),
                key=lambda n: cores[n],
                default=-1,
            )
            if node < 0:
                aside.append((place, task))
                if len(aside) > site.nodes:
                    break
                continue
            cores[node] -= 1
            memory[node] -= load.memory_gb
            core_s += load.seconds
            heapq.heappush(running, (now + load.seconds, place, task, node))
        for one in aside:
            heapq.heappush(ready, one)
        if not running:
            break
        now, _, task, node = heapq.heappop(running)
        cores[node] += 1
        memory[node] += loads[task].memory_gb
        chain[task] += loads[task].seconds
        for other in then[task]:
            chain[other] = max(chain[other], chain[task])
            left[other] -= 1
            if not left[other]:
                heapq.heappush(ready, (order[other], other))
    written = sum(load.written for load in loads.values())
    moved = written + sum(load.read for load in loads.values())
    return Schedule(
        hours=now / 3600,
        core_hours=core_s / 3600,
        disk_hours=moved / (site.disk_mb_s * 1e6) / 3600,
        longest_hours=max(chain.values(), default=0.0) / 3600,
        written=written,
        moved=moved,
        unfit=tuple(unfit),
        largest_gb=max((load.memory_gb for load in loads.values()), default=0.0),
    )
