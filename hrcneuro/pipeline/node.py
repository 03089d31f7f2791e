"""A task in the walk over the graph: what is known of it so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hrcneuro.cache.record import Record
from hrcneuro.pipeline.graph import Needs, Task
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import Workdir


@dataclass
class Node:
    """A task in the walk.

    Attributes:
        task: The task.
        needs: What it may read of others.
        item: Its row.
        parts: Of its key, once what it stands on is settled.
        record: Of its entry, once there is one.
        fault: Why its entry, which looked sound, is done again.
        dropped: Names of its entry's files that were dropped to save disk.
    """

    task: Task
    needs: Needs
    item: Item
    parts: Mapping[str, Any] | None = None
    record: Record | None = None
    fault: str = ""
    dropped: frozenset[str] = frozenset()

    @classmethod
    def of(cls, task: Task, needs: Needs) -> Node:
        """Return the node of a task that nothing is known of yet."""
        return cls(task, needs, Item(task.name, task.unit, task.draws))

    @property
    def settled(self) -> bool:
        """Whether nothing more will happen to the task."""
        return self.item.state.settled

    def absent(self, workdir: Workdir, pictures_only: bool) -> bool:
        """Return whether there is nothing to be had of a task: it failed, or never ran and will not run now.

        What has run and is stale is no such thing: a picture without it would show less than there is.
        """
        if self.item.state in (State.FAILED, State.BLOCKED):
            return True
        coming_never = pictures_only and self.item.state is State.WOULD_RUN
        return coming_never and not workdir.pointer(self.task.name, self.task.unit)

    def without(self) -> str:
        """Return why an entry does not do: which of its files were dropped."""
        return f"dropped to save disk: {', '.join(sorted(self.dropped))}"
