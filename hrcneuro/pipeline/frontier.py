"""Which task of a walk comes next: the first, in the order in which people read them, whose upstream is settled."""

from __future__ import annotations

import concurrent.futures as futures
import heapq
import queue
from collections.abc import Collection, Iterator, Mapping

from hrcneuro.pipeline.graph import Task


class Frontier:
    """Tasks that wait for those that they stand on.

    What a task's end costs depends on what stands on it, and not on how many tasks there are: of 10,000 subjects there
    are 130,000, and to look through all of them each time would take longer than the work on a large cluster.
    """

    def __init__(self, needs: Mapping[Task, Collection[Task]]) -> None:
        """Let all tasks wait; their order is that of ``needs``."""
        self._tasks = list(needs)
        self._places = {task: place for place, task in enumerate(self._tasks)}
        self._open = {task: len(sources) for task, sources in needs.items()}
        self._standing: dict[Task, list[Task]] = {task: [] for task in needs}
        for task, sources in needs.items():
            for source in sources:
                self._standing[source].append(task)
        self._waiting = set(needs)
        self._ready = [place for place, task in enumerate(self._tasks) if not self._open[task]]
        self._later: list[int] = []

    def __bool__(self) -> bool:
        """Return whether any task waits."""
        return bool(self._waiting)

    def take(self) -> Task | None:
        """Return the next task, which waits no more; None where there is none yet."""
        while self._ready:
            task = self._tasks[heapq.heappop(self._ready)]
            if task in self._waiting and not self._open[task]:
                self._waiting.remove(task)
                return task
        return None

    def settle(self, task: Task) -> None:
        """Take in that a task that was taken is settled."""
        for other in self._standing[task]:
            self._open[other] -= 1
            if not self._open[other]:
                heapq.heappush(self._ready, self._places[other])

    def wait_again(self, task: Task, *altered: Task) -> None:
        """Let a task that was taken wait anew, and with it settled ones on which it stands, until :meth:`resume`."""
        for source in altered:
            for other in self._standing[source]:
                self._open[other] += 1
            self._wait(source)
        self._wait(task)

    def resume(self) -> None:
        """Let those be taken again that wait anew."""
        for place in self._later:
            heapq.heappush(self._ready, place)
        self._later.clear()

    def _wait(self, task: Task) -> None:
        self._waiting.add(task)
        self._later.append(self._places[task])


class Ended:
    """Jobs that have ended, in the order in which they did; none is looked at before."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[futures.Future] = queue.SimpleQueue()

    def __bool__(self) -> bool:
        """Return whether there is one."""
        return not self._queue.empty()

    def watch(self, future: futures.Future) -> None:
        """Take in a job that was begun."""
        future.add_done_callback(self._queue.put)

    def take(self) -> Iterator[futures.Future]:
        """Yield those that there are; wait for the first."""
        yield self._queue.get()
        while self:
            yield self._queue.get()
