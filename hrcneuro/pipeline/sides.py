"""Results on the side, such as a sweep, that were asked for last, where the configuration itself asks for none."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from hrcneuro import stages
from hrcneuro.config.reader import Reader
from hrcneuro.config.settings import Settings
from hrcneuro.contract import OF_ALL, SideResult, is_piece
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.workdir import Workdir


def remembered(settings: Settings, workdir: Workdir) -> Settings:
    """Return the configuration with what was last asked for of every result on the side that it does not ask for.

    Such a result is named on the command line, for once. ``status`` and the report, which are not told of it, find it
    by what its pointer says.
    """
    sections = dict(settings.sections)
    for name in stages.NAMES:
        for side in stages.load(name).sides:
            if not side.asked(sections[name]):
                sections[name] = _with_last(sections[name], side, name, workdir)
    return dataclasses.replace(settings, sections=sections)


def _with_last(section: Any, side: SideResult, stage: str, workdir: Workdir) -> Any:
    parts = workdir.last(stage, side.unit) or {}
    given = {**_table(parts.get("params")), **workdir.places(stage, side.unit)}
    known = {option: given[option] for option in side.options if option in given}
    reader = Reader("pointer", Path())
    found, _ = reader.record(section, known, stage)
    # What another version was asked for may be nothing that this one can do.
    return section if reader.mistakes else found


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def told(settings: Settings, items: list[Item]) -> list[Item]:
    """Return the items without those on the side that the configuration does not ask for, unless they are fresh."""
    fresh = {(i.stage, i.unit) for i in items if i.unit in OF_ALL and not i.draws and i.state.done}
    return [item for item in items if _is_told(settings, item, fresh)]


def _is_told(settings: Settings, item: Item, fresh: set[tuple[str, str]]) -> bool:
    name = item.stage.partition(".")[0]
    if name not in stages.NAMES or not (item.unit in OF_ALL or is_piece(item.unit)):
        return True
    side = stages.load(name).side_of(item.unit)
    return side is None or side.asked(settings.sections[name]) or (name, side.unit) in fresh
