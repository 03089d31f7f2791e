"""The sweep that was asked for last, where the configuration itself names none."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from hrcneuro import stages
from hrcneuro.config.reader import Reader
from hrcneuro.config.settings import Settings
from hrcneuro.contract import SWEEP, is_piece
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.workdir import Workdir


def remembered(settings: Settings, workdir: Workdir) -> Settings:
    """Return the configuration with the last sweep of each stage that is asked for none.

    A sweep is named on the command line, for once. ``status`` and the report, which are not told of it, find it by what
    its pointer says.
    """
    sections = dict(settings.sections)
    for name in stages.NAMES:
        sweep = stages.load(name).sweep
        if not sweep or sweep.asked(sections[name]):
            continue
        params = (workdir.last(name, SWEEP) or {}).get("params")
        if isinstance(params, dict):
            reader = Reader("pointer", Path())
            known = {option: params[option] for option in sweep.options if option in params}
            found, _ = reader.record(sections[name], known, name)
            # What another version has swept may be no sweep of this one.
            if not reader.mistakes:
                sections[name] = found
    return dataclasses.replace(settings, sections=sections)


def told(settings: Settings, items: list[Item]) -> list[Item]:
    """Return the items without those of a sweep that the configuration does not ask for and that is not up to date."""
    fresh = {item.stage for item in items if item.unit == SWEEP and not item.draws and item.state.done}
    kept = []
    for item in items:
        name = item.stage.partition(".")[0]
        sweep = stages.load(name).sweep if name in stages.NAMES else None
        asked = sweep is None or sweep.asked(settings.sections[name])
        if asked or name in fresh or not _swept(item):
            kept.append(item)
    return kept


def _swept(item: Item) -> bool:
    return item.unit == SWEEP or is_piece(item.unit)
