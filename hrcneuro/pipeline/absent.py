"""What the configuration names and no subject has: a slip of the pen, most likely, that a group must not pass over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hrcneuro.config.recordings import NOWHERE_CURE, nowhere
from hrcneuro.contract import GROUP
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.graph import Needs, Task


def refuse(task: Task, needs: Callable[[Task], Needs], summary: Callable[[Task], Mapping[str, Any]]) -> None:
    """Refuse a group's numbers where no subject, of those that it stands on, has what the configuration names.

    A subject's summary says in ``absent`` what it does not have: pairs of the option's name, and of words for people.

    Args:
        task: The group's.
        needs: What a task stands on.
        summary: What a task said of its result; empty where it has none.

    Raises:
        ConfigError: With all that no subject has.
    """
    said: dict[str, dict[str, dict[str, str]]] = {}
    seen: set[Task] = set()
    todo = [one for one in needs(task) if one.unit != GROUP]
    while todo:
        one = todo.pop()
        if one not in seen:
            seen.add(one)
            todo += [other for other in needs(one) if other.unit != GROUP]
            said.setdefault(one.name, {})[one.unit] = dict(summary(one).get("absent", ()))
    found = [text for _, of_subjects in sorted(said.items()) for text in nowhere(dict(sorted(of_subjects.items())))]
    if found:
        raise ConfigError(f"no subject has {' or '.join(dict.fromkeys(found))}", cure=NOWHERE_CURE)
