"""Results on the side, such as a sweep, that were asked for last, where the configuration itself asks for none."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcneuro import stages
from hrcneuro.config.reader import Reader
from hrcneuro.config.settings import Settings
from hrcneuro.contract import OF_ALL, SideResult, is_piece
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.workdir import Workdir

_AS_LAST = "as last time"


def remembered(settings: Settings, workdir: Workdir) -> Settings:
    """Return the configuration with what was last asked for of every result on the side that it does not ask for.

    Such a result is named on the command line, for once. ``status`` and the report, which are not told of it, find it
    by what its pointer says; where the files that it was made from lie, nothing that is kept says, and their content
    as it was then stands for them.
    """
    sections, sources = dict(settings.sections), dict(settings.last_sources)
    for name in stages.NAMES:
        for side in stages.load(name).sides:
            if not side.asked(sections[name]):
                last = workdir.last(name, side.unit) or {}
                sections[name] = _with_last(sections[name], side, name, last)
                if side.place and side.asked(sections[name]):
                    sources[name, side.unit] = _table(last.get("sources"))
    return dataclasses.replace(settings, sections=sections, last_sources=sources)


def _with_last(section: Any, side: SideResult, stage: str, last: Mapping[str, Any]) -> Any:
    given = _table(last.get("params"))
    if side.place:
        # What is named for once is the place; the other options are the configuration's.
        known = {side.place: _AS_LAST} if _table(last.get("sources")) else {}
    else:
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
