"""How much disk a run will want, by what the tasks of earlier runs have written."""

from __future__ import annotations

import shutil
import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

from hrcneuro.cache.record import entry_of, read_record
from hrcneuro.contract import GROUP
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.measured import measured
from hrcneuro.pipeline.workdir import Workdir

# So many earlier results of a kind are looked at: among 400 subjects, more would tell nothing new.
_LOOKED_AT = 20


@dataclass(frozen=True)
class DiskForecast:
    """What tasks that would run will write.

    Attributes:
        tasks: How many would run.
        size: What those will write of whose kind something has run, in bytes.
        unknown: Stages of which nothing has run.
        free: What is free where the cache lies, in bytes.
    """

    tasks: int
    size: int
    unknown: tuple[str, ...]
    free: int

    @property
    def enough(self) -> bool:
        """Whether what is known fits."""
        return self.size <= self.free

    def __str__(self) -> str:
        free = f"{_large(self.free)} are free"
        if not self.size:
            return f"disk: {free}; how much will be written is not known before something has run"
        of = f"; nothing has run yet of {', '.join(self.unknown)}" if self.unknown else ""
        short = "" if self.enough else "; that is not enough: 'hrcneuro cache gc' and 'hrcneuro cache slim' make room"
        return f"disk: about {_large(self.size)} will be written, by what earlier runs wrote; {free}{short}{of}"


def expected(workdir: Workdir, items: Iterable[Item]) -> DiskForecast:
    """Return how much disk those of these tasks want that would run."""
    coming = [item for item in items if item.state is State.WOULD_RUN]
    last = measured(workdir, [(item.stage, item.unit) for item in coming])
    alike: dict[tuple[str, bool], list[int]] = {}
    total, unknown = 0, []
    for item in coming:
        kind = (item.stage, item.unit == GROUP)
        if kind not in alike:
            alike[kind] = _sizes(workdir, *kind)
        own = last.get((item.stage, item.unit))
        known = None if own is None else own.size
        if known is None and alike[kind]:
            known = round(statistics.median(alike[kind]))
        if known is None and not item.draws:
            unknown.append(item.stage)
        total += known or 0
    return DiskForecast(len(coming), total, tuple(dict.fromkeys(unknown)), _free(workdir))


def _sizes(workdir: Workdir, stage: str, group: bool) -> list[int]:
    """Return what tasks of a kind have written, whichever study asked for it."""
    folders = workdir.cache.root.glob(f"{stage}/*/*")
    ours = (folder for folder in folders if (entry_of(folder)[1] == GROUP) == group)
    records = (read_record(folder) for folder in islice(ours, _LOOKED_AT))
    return [record.size for record in records if record is not None]


def _free(workdir: Workdir) -> int:
    place = workdir.cache.root
    while not place.exists() and place != place.parent:
        place = place.parent
    return shutil.disk_usage(place).free


def _large(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"
