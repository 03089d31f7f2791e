"""What a study's entries can do without: signals that are made again when something reads them."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hrcneuro import stages
from hrcneuro.cache.disk import flush, guarded, share
from hrcneuro.cache.record import SLIM, Entry, dropped
from hrcneuro.config.settings import Settings
from hrcneuro.contract import Sessions
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.claims import claimed_by_others
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import Workdir

SUFFIX = ".fif"
"""Signals. Tables are small, and the report reads them."""


@dataclass(frozen=True)
class Slimmed:
    """What was dropped of an entry, or would be.

    Attributes:
        entry: Stage, unit and key.
        size: In bytes.
        kept: Why nothing was; empty where it was.
    """

    entry: Entry
    size: int
    kept: str = ""


def check(settings: Settings, names: Iterable[str]) -> None:
    """Refuse stages whose entries nobody can make again at will.

    Raises:
        ConfigError: There is one.
    """
    for name in names:
        if stages.load(name).sessions(settings.sections[name]) is not Sessions.SIDE_BY_SIDE:
            raise ConfigError(
                f"{name} moves an arm in real time, so what it has recorded cannot be made again; nothing was dropped",
                cure="name other stages, such as: hrcneuro cache slim acquire preprocess",
            )


def slim(workdir: Workdir, items: Iterable[Item], names: Sequence[str], *, dry: bool = False) -> list[Slimmed]:
    """Drop the signals of entries that are up to date, so that they can be made again as they are; keep their records.

    Args:
        workdir: The study's.
        items: How it stands; what is not up to date is none of ours.
        names: The stages.
        dry: Only say what would be dropped.

    Raises:
        DataError: What other studies point at is not known.
        HrcError: A file cannot be removed.
    """
    used, done = claimed_by_others(workdir), []
    for item in items:
        entry = (item.stage, item.unit, item.key)
        if item.stage not in names or item.state is not State.HIT:
            continue
        files = [Path(path) for name, path in item.artifacts.items() if name.endswith(SUFFIX)]
        size = sum(path.stat().st_size for path in files)
        if not files:
            continue
        if entry in used:
            done.append(Slimmed(entry, size, "another study or a run points at it"))
            continue
        if not dry and not drop(workdir, entry, files):
            done.append(Slimmed(entry, size, "a run points at it"))
            continue
        done.append(Slimmed(entry, size))
    return done


def drop(workdir: Workdir, entry: Entry, files: Iterable[Path]) -> bool:
    """Drop files of an entry, and keep its record; return False, and drop nothing, where another study points at it.

    Raises:
        DataError: What other studies point at is not known.
        HrcError: A file cannot be removed.
    """
    folder = workdir.cache.folder(*entry)
    with workdir.cache.lock(*entry), guarded(folder):
        return _drop(workdir, folder, entry, list(files))


def _drop(workdir: Workdir, folder: Path, entry: Entry, files: Iterable[Path]) -> bool:
    """Note which files are dropped, ask once more who points at them, and remove them; False where somebody does."""
    place, part = folder / SLIM, folder / f"{SLIM}.{secrets.token_hex(4)}"
    names = {path.relative_to(folder).as_posix() for path in files}
    part.write_text(json.dumps(sorted(names | dropped(folder))))
    share(part, workdir.cache.root)
    flush(part)
    os.replace(part, place)
    flush(folder)
    if entry in claimed_by_others(workdir):
        place.unlink()
        return False
    for path in files:
        path.unlink()
    return True
