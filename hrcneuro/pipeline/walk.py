"""The walk over the graph: what must run and why, and the order in which it runs."""

from __future__ import annotations

import concurrent.futures as futures
import contextlib
import gc
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hrcneuro import interrupts
from hrcneuro.cache import why
from hrcneuro.cache.record import Record
from hrcneuro.config.settings import Settings
from hrcneuro.contract import GROUP, Inputs
from hrcneuro.errors import HrcError
from hrcneuro.pipeline import absent
from hrcneuro.pipeline.claims import Claims
from hrcneuro.pipeline.executors import Executor, outcome
from hrcneuro.pipeline.frontier import Ended, Frontier
from hrcneuro.pipeline.graph import Graph, Need, Task
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.job import Job, Outcome, execute
from hrcneuro.pipeline.keys import Keys
from hrcneuro.pipeline.node import Node
from hrcneuro.pipeline.workdir import Workdir, lock_patience_s


class Run:
    """One walk over a graph: plan each task when its inputs are known, then run it or take it from the cache."""

    def __init__(
        self,
        settings: Settings,
        workdir: Workdir,
        graph: Graph,
        *,
        verify: bool = False,
        whole: Collection[Task] = (),
        second_cache: str = "",
        keys: Keys | None = None,
    ) -> None:
        """Prepare a walk.

        Args:
            settings, workdir, graph: Of the study.
            verify: Hash every file that is taken from the cache.
            whole: Tasks of which all files are wanted, also those that were dropped to save disk.
            second_cache: The URL of a second cache, which is looked into for what the first has not; empty for none.
            keys: Makes the keys of this configuration; None: its own, which have hashed nothing yet.
        """
        self.settings = settings
        self.workdir = workdir
        self.verify = verify
        self.whole = frozenset(whole)
        self.second_cache = second_cache
        self.keys = keys or Keys(settings, workdir)
        self.nodes = {task: Node.of(task, needs) for task, needs in graph.items()}
        self.pictures_only = False
        self.quiet = False
        self.patience_s = lock_patience_s()
        self.claims = Claims(workdir)

    @property
    def items(self) -> list[Item]:
        """The rows of all tasks, in the order in which people read them."""
        return [node.item for node in self.nodes.values()]

    def plan(self, forced: Iterable[Task] = ()) -> list[Item]:
        """Return what would happen, without running, writing or locking anything."""
        forced = set(forced)
        with _no_collection():
            for node in self.nodes.values():
                self._foresee(node, force=node.task in forced)
        for node in reversed(self.nodes.values()):
            if node.item.state is State.WOULD_RUN:
                for source in self._lacking(node):
                    source.item.state, source.item.why = State.WOULD_RUN, [source.fault]
                    self._note_before(source)
        return self.items

    def run(
        self,
        executor: Executor,
        *,
        forced: Iterable[Task] = (),
        pictures_only: bool = False,
        provenance: Callable[[], Mapping[str, Any]] = dict,
        report: Callable[[Item], None] = lambda item: None,
        tell: Callable[[str], None] | None = None,
    ) -> list[Item]:
        """Bring the tasks up to date; a failure blocks only what stands on it. Return every item.

        Args:
            executor: Where jobs run.
            forced: Tasks that run even if they are up to date.
            pictures_only: Draw what can be drawn of the numbers that are up to date; compute none.
            provenance: What is kept with every result of where it comes from.
            report: Is told of every change of an item.
            tell: Is told of what else a person should know, such as a lock that is waited for.
        """
        forced = set(forced)
        self.pictures_only = pictures_only
        self.quiet = tell is None
        frontier = Frontier({task: node.needs for task, node in self.nodes.items()})
        running: dict[futures.Future, Node] = {}
        ended = Ended()
        self.claims.open()
        self.workdir.cache.sweep()
        asked = False
        try:
            while frontier or running:
                frontier.resume()
                while not ended and (task := frontier.take()) is not None:
                    node = self.nodes[task]
                    if pictures_only and not task.draws:
                        self._foresee(node)
                        frontier.settle(task)
                        continue
                    self._prepare(node, force=task in forced)
                    if not node.settled and (again := self._again(node, running.values())):
                        frontier.wait_again(*(one.task for one in again))
                        continue
                    if node.settled:
                        frontier.settle(task)
                        report(node.item)
                        continue
                    if not asked and tell is not None and (flaw := self.workdir.cache.flaw_of_locks()):
                        tell(f"note: {flaw}")
                    asked = True
                    node.item.state = State.RUNNING
                    # Before it is submitted: in this process it runs at once, and a person wants to know what.
                    report(node.item)
                    future = executor.submit(execute, self._job(node, task in forced, provenance()))
                    running[future] = node
                    ended.watch(future)
                for future in ended.take() if running else ():
                    node = running.pop(future)
                    self._finish(node, outcome(future, str(node.task)))
                    frontier.settle(node.task)
                    report(node.item)
                # An interrupt that a stage made wait: its result is kept and pointed at now.
                interrupts.deliver()
        finally:
            self.keys.memo.save()
            self.claims.close()
        if self.claims.flaw and tell is not None and any(item.state.done for item in self.items):
            tell(f"note: {self.claims.flaw}")
        return self.items

    def _foresee(self, node: Node, *, force: bool = False) -> None:
        """Decide what would happen to a task, and settle it so."""
        self._prepare(node, force=force, dry=True)
        if not node.settled:
            node.item.state = State.WOULD_RUN

    def _sources(self, node: Node) -> list[tuple[Node, Need]]:
        """Return what a task reads of: all that it stands on, without what it can do without and that is not there."""
        sources, only = [(self.nodes[task], need) for task, need in node.needs.items()], self.pictures_only
        return [(one, need) for one, need in sources if need.required or not one.absent(self.workdir, only)]

    def _prepare(self, node: Node, *, force: bool, dry: bool = False) -> None:
        """Decide a task whose upstream is settled; it stays waiting where it must run."""
        self._decide(node, force=force, dry=dry)
        if node.item.state is not State.HIT:
            self._note_before(node)

    def _note_before(self, node: Node) -> None:
        # Of a hit nobody asks: to read its pointer is a fifth of what a status of thousands of tasks takes.
        node.item.before = bool(self.workdir.pointer(node.task.name, node.task.unit))

    def _decide(self, node: Node, *, force: bool, dry: bool) -> None:
        item, sources = node.item, self._sources(node)
        bad = [source.task for source, _ in sources if source.item.state in (State.FAILED, State.BLOCKED)]
        coming = [source.task for source, _ in sources if source.item.state is State.WOULD_RUN]
        if bad:
            item.state, item.why = State.BLOCKED, [f"inputs: {task} failed" for task in bad]
            return
        if coming or (node.needs and not sources):
            item.state, item.why = State.WOULD_RUN, [f"inputs: {task} would run" for task in coming or node.needs]
            return
        try:
            if node.task.unit == GROUP and not node.task.draws:
                nodes = self.nodes
                absent.refuse(node.task, lambda task: nodes[task].needs, lambda task: nodes[task].item.summary)
            node.parts = self.keys.parts(node.task, self._records(node))
            item.key = self.keys.key(node.parts)
            if not dry:
                # Before it is looked for: what is seen after that, no other study's gc drops.
                self.claims.claim((node.task.name, node.task.unit, item.key))
            record = None if force else self._lookup(node, dry=dry)
            if record is not None:
                item.state = State.HIT
                self._accept(node, record, dry=dry)
                return
        except HrcError as error:
            item.fail(error)
            return
        if node.fault:
            item.why = [node.fault]
        elif not item.why:
            last = self.workdir.last(node.task.name, node.task.unit)
            causes = why.causes(last, node.parts, prefix="" if node.task.draws else f"{node.task.name}.")
            item.why = ["forced"] if force else causes or ["entry gone from the cache"]

    def _lookup(self, node: Node, *, dry: bool) -> Record | None:
        cache, place = self.workdir.cache, (node.task.name, node.task.unit, node.item.key)
        slim = not node.fault and node.task not in self.whole
        record, node.dropped = cache.look(*place, verify=self.verify, slim=slim)
        if record is None and node.dropped:
            node.item.why = [node.without()]
        if record is None and (flaw := cache.diagnose(*place, verify=self.verify)):
            node.item.why = [f"corrupt: {flaw}"]
            if not dry:
                cache.quarantine(*place)
        return record

    def _again(self, node: Node, running: Iterable[Node]) -> list[Node]:
        """Return what must wait anew, as a file that the task is about to read is no longer what was written.

        Its size was right, or its entry would be no hit; a content that changed must not go into what stands on it. The
        entry is done again, but not taken away from a task that reads another of its files just now.
        """
        try:
            altered = self._altered(node)
            if any(source.task in other.needs for other in running for source in altered):
                return [node]
            for source in altered:
                if not source.dropped:
                    self.workdir.cache.quarantine(source.task.name, source.task.unit, source.item.key)
        except HrcError as error:
            node.item.fail(error)
            return []
        for source in altered:
            source.item = Item(source.task.name, source.task.unit, source.task.draws)
        return [node, *altered] if altered else []

    def _lacking(self, node: Node) -> list[Node]:
        """Return what a task reads a file of that was dropped to save disk: it is made again."""
        lacking = []
        for source, need in self._sources(node):
            hit = source.record if source.item.state is State.HIT else None
            if hit is not None and source.dropped.intersection(self.keys.matching(hit, need)):
                source.fault = source.without()
                lacking.append(source)
        return lacking

    def _altered(self, node: Node) -> list[Node]:
        altered = self._lacking(node)
        for source, need in self._sources(node):
            record = source.record
            if record is None or source.item.state is not State.HIT or source in altered:
                continue
            for name in self.keys.matching(record, need):
                if self.keys.content(self._folder(record) / name) != record.outputs[name]["sha256"]:
                    source.fault = f"corrupt: the content of {name} has changed"
                    altered.append(source)
                    break
        return altered

    def _records(self, node: Node) -> list[tuple[Record, Need]]:
        return [(source.record, need) for source, need in self._sources(node) if source.record is not None]

    def _job(self, node: Node, force: bool, provenance: Mapping[str, Any]) -> Job:
        files: dict[str, dict[str, dict[str, Path]]] = {}
        for record, need in self._records(node):
            folder = self._folder(record)
            names = self.keys.matching(record, need)
            files.setdefault(record.stage, {})[record.unit] = {name: folder / name for name in names}
        return Job(
            task=node.task,
            key=node.item.key,
            parts=node.parts or {},
            config=self.keys.config(node.task),
            inputs=Inputs(node.task.unit, files),
            root=self.workdir.cache.root,
            provenance={**provenance, "study": self.claims.id},
            force=force,
            quiet=self.quiet,
            patience_s=self.patience_s,
            second_cache=self.second_cache,
        )

    def _folder(self, record: Record) -> Path:
        return self.workdir.cache.folder(record.stage, record.unit, record.key)

    def _finish(self, node: Node, outcome: Outcome) -> None:
        item = node.item
        item.state, item.seconds, item.pulled = outcome.state, round(outcome.seconds, 3), outcome.pulled
        item.error, item.trace, item.lost = outcome.error, outcome.trace, outcome.lost
        node.dropped = frozenset()
        if outcome.record is not None:
            try:
                self._accept(node, outcome.record)
            except HrcError as error:
                item.fail(error)

    def _accept(self, node: Node, record: Record, *, dry: bool = False) -> None:
        root = self.workdir.cache.root
        node.record, folder = record, f"{root}/{record.stage}/{record.unit}/{record.key}"
        node.item.summary = record.summary
        node.item.artifacts = {name: f"{folder}/{name}" for name in record.outputs if name not in node.dropped}
        if not dry:
            self.workdir.point(record)


@contextlib.contextmanager
def _no_collection() -> Iterator[None]:
    """Do not look for garbage: all that a plan makes of thousands of tasks stays, and would be looked through again."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
