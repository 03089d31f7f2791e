"""The walk over the stage graph: what must run and why, and the order in which it runs."""

from __future__ import annotations

import concurrent.futures as futures
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from hrcneuro import stages
from hrcneuro.cache import fingerprint, why
from hrcneuro.cache.store import Record
from hrcneuro.config.settings import Settings
from hrcneuro.contract import Inputs, params
from hrcneuro.errors import DataError, HrcError
from hrcneuro.pipeline.executors import Executor, outcome
from hrcneuro.pipeline.graph import Task, closure
from hrcneuro.pipeline.job import Job, Outcome, execute
from hrcneuro.pipeline.workdir import Workdir

PACKAGE = Path(__file__).parents[1]


@dataclass
class Item:
    """What became of a task: the row that commands print."""

    stage: str
    unit: str
    key: str = ""
    state: str = ""
    why: list[str] = field(default_factory=list)
    seconds: float = 0.0
    artifacts: dict[str, str] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    error: HrcError | None = None
    trace: str = ""


class Run:
    """One walk over the graph: plan each task when its inputs are known, then run it or take it from the cache."""

    def __init__(self, settings: Settings, workdir: Workdir, *, verify: bool = False) -> None:
        self.settings = settings
        self.workdir = workdir
        self.verify = verify
        self.memo = fingerprint.Memo(workdir.cache.root / ".memo.json")
        self.items: dict[Task, Item] = {}
        self.records: dict[Task, Record] = {}
        self.parts: dict[Task, dict[str, Any]] = {}
        self._static: dict[str, dict[str, Any]] = {}
        self._faults: dict[Task, str] = {}  # of entries that are redone since they were found altered

    def plan(self, wanted: Iterable[Task], *, force: bool = False) -> list[Item]:
        """Return what would happen, without running, writing or locking anything."""
        wanted = list(wanted)
        for task, upstream in closure(self.settings, wanted).items():
            item = self._prepare(task, upstream, force=force and task in wanted, dry=True)
            if not item.state:
                item.state = "would-run"
        return list(self.items.values())

    def run(
        self,
        wanted: Iterable[Task],
        executor: Executor,
        *,
        force: bool = False,
        provenance: Callable[[], Mapping[str, Any]] = dict,
        report: Callable[[Task, Item], None] = lambda task, item: None,
    ) -> list[Item]:
        """Bring the wanted tasks up to date; a failure blocks only what stands on it. Return every item."""
        wanted = list(wanted)
        graph = closure(self.settings, wanted)
        waiting = dict(graph)
        running: dict[futures.Future, Task] = {}
        self.workdir.cache.sweep()
        try:
            while waiting or running:
                for task in [t for t, upstream in waiting.items() if all(self._settled(u) for u in upstream)]:
                    if not all(self._settled(u) for u in graph[task]):
                        continue  # one of them has just been found altered
                    item = self._prepare(task, waiting.pop(task), force=force and task in wanted)
                    if not item.state and (again := self._again(task, graph, running.values())):
                        waiting |= {one: graph[one] for one in again}
                        continue
                    item.state = item.state or "running"
                    report(task, item)
                    if item.state == "running":
                        job = self._job(task, graph[task], force and task in wanted, provenance())
                        running[executor.submit(execute, job)] = task
                        if any(future.done() for future in running):
                            break
                for future in futures.wait(running, return_when=futures.FIRST_COMPLETED).done if running else ():
                    task = running.pop(future)
                    self._finish(task, outcome(future, f"{task.stage} of {task.unit}"))
                    report(task, self.items[task])
        finally:
            self.memo.save()
        return [self.items[task] for task in graph]

    def _settled(self, task: Task) -> bool:
        return task in self.items and self.items[task].state not in ("", "running")

    def _prepare(self, task: Task, upstream: Mapping[Task, tuple[str, ...]], *, force: bool, dry: bool = False) -> Item:
        """Decide a task whose upstream is settled; the state stays empty where it must run."""
        item = self.items[task] = Item(task.stage, task.unit)
        bad = [u for u in upstream if self.items[u].state in ("failed", "blocked")]
        if bad:
            item.state, item.why = "blocked", [f"inputs: {u.stage} of {u.unit} failed" for u in bad]
            return item
        coming = [u for u in upstream if self.items[u].state == "would-run"]
        if coming:
            item.why = [f"inputs: {u.stage} of {u.unit} would run" for u in coming]
            return item
        try:
            parts = self.parts[task] = self._parts(task, upstream)
            item.key = fingerprint.key(parts)
            record = None if force else self._lookup(task, item, dry=dry)
        except HrcError as error:
            item.state, item.error, item.why = "failed", error, [error.problem]
            return item
        if record is not None:
            item.state = "hit"
            self._accept(task, record, dry=dry)
        elif task in self._faults:
            item.why = [self._faults[task]]
        elif not item.why:
            last = self.workdir.last(task.stage, task.unit)
            item.why = ["forced"] if force else why.causes(task.stage, last, parts) or ["entry gone from the cache"]
        return item

    def _lookup(self, task: Task, item: Item, *, dry: bool) -> Record | None:
        cache = self.workdir.cache
        record = cache.lookup(task.stage, task.unit, item.key, verify=self.verify)
        if record is None and (flaw := cache.diagnose(task.stage, task.unit, item.key, verify=self.verify)):
            item.why = [f"corrupt: {flaw}"]
            if not dry:
                cache.quarantine(task.stage, task.unit, item.key)
        return record

    def _again(
        self, task: Task, graph: Mapping[Task, Mapping[Task, tuple[str, ...]]], running: Iterable[Task]
    ) -> list[Task]:
        """Return what must wait anew, as a file that the task is about to read is no longer what was written.

        Its size was right, or its entry would be no hit; a content that changed must not go into what stands on it. The
        entry is done again, but not taken away from a task that reads another of its files just now.
        """
        item = self.items[task]
        try:
            altered = self._altered(graph[task])
            if any(source in graph[other] for other in running for source in altered):
                return [task]
            for source in altered:
                self.workdir.cache.quarantine(source.stage, source.unit, self.items[source].key)
        except HrcError as error:
            item.state, item.error, item.why = "failed", error, [error.problem]
            return []
        for source in altered:
            del self.items[source]
        self._faults |= altered
        return [task, *altered] if altered else []

    def _altered(self, upstream: Mapping[Task, tuple[str, ...]]) -> dict[Task, str]:
        altered = {}
        for source, files in self._files(upstream).items():
            outputs = self.records[source].outputs
            for name, path in files.items() if self.items[source].state == "hit" else ():
                if self._content(path) != outputs[name]["sha256"]:
                    altered[source] = f"corrupt: the content of {name} has changed"
        return altered

    def _parts(self, task: Task, upstream: Mapping[Task, tuple[str, ...]]) -> dict[str, Any]:
        """Return the named parts of a task's key."""
        inputs = {
            f"{source.stage}/{source.unit}/{name}": self.records[source].outputs[name]["sha256"]
            for source, files in self._files(upstream).items()
            for name in files
        }
        parts = {"stage": task.stage, "unit": task.unit, "inputs": inputs, **self._stage_parts(task.stage)}
        stage = stages.load(task.stage)
        if hasattr(stage, "sources"):
            files = stage.sources(self.settings.sections[task.stage], task.unit)
            parts["sources"] = {label: self._content(path) for label, path in sorted(files.items())}
        return parts

    def _content(self, path: Path) -> str:
        try:
            return self.memo.get("bytes", path, fingerprint.file_digest)
        except OSError as error:
            raise DataError(f"{path} cannot be read: {error.strerror}", cure="check the file and its rights") from error

    def _stage_parts(self, name: str) -> dict[str, Any]:
        if name not in self._static:
            stage = stages.load(name)
            self._static[name] = {
                "params": params(self.settings.sections[name]),
                "code": fingerprint.code(f"hrcneuro.stages.{name}", PACKAGE, self.memo),
                "libs": fingerprint.libraries(stage.LIBS),
            }
        return self._static[name]

    def _job(
        self, task: Task, upstream: Mapping[Task, tuple[str, ...]], force: bool, provenance: Mapping[str, Any]
    ) -> Job:
        files: dict[str, dict[str, dict[str, Path]]] = {}
        for source, found in self._files(upstream).items():
            files.setdefault(source.stage, {})[source.unit] = found
        return Job(
            stage=task.stage,
            unit=task.unit,
            key=self.items[task].key,
            parts=self.parts[task],
            config=self.settings.sections[task.stage],
            inputs=Inputs(task.unit, files),
            root=self.workdir.cache.root,
            provenance=provenance,
            force=force,
        )

    def _files(self, upstream: Mapping[Task, tuple[str, ...]]) -> dict[Task, dict[str, Path]]:
        """Return the files, by name, that a task reads of each that it stands on."""
        found = {}
        for source, patterns in upstream.items():
            folder = self.workdir.cache.folder(source.stage, source.unit, self.items[source].key)
            names = self.records[source].outputs
            found[source] = {n: folder / n for n in names if any(fnmatch(n, pattern) for pattern in patterns)}
        return found

    def _finish(self, task: Task, outcome: Outcome) -> None:
        item = self.items[task]
        item.state, item.seconds = outcome.state, round(outcome.seconds, 3)
        item.error, item.trace = outcome.error, outcome.trace
        if outcome.record is not None:
            self._accept(task, outcome.record)

    def _accept(self, task: Task, record: Record, *, dry: bool = False) -> None:
        item = self.items[task]
        folder = self.workdir.cache.folder(record.stage, record.unit, record.key)
        self.records[task] = record
        item.summary = record.summary
        item.artifacts = {name: str(folder / name) for name in record.outputs}
        try:
            if not dry:
                self.workdir.point(record)
        except HrcError as error:
            item.state, item.error = "failed", error
