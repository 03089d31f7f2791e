"""What tasks of earlier runs took: time, memory and disk, of the records that a study's results point at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

from hrcneuro.cache.record import Record, entry_of, read_record
from hrcneuro.contract import GROUP
from hrcneuro.errors import DataError
from hrcneuro.pipeline.workdir import Workdir

Place = tuple[str, str]
"""A task's name and unit."""

# So many earlier results of a kind are looked at: among 400 subjects, more would tell nothing new.
_LOOKED_AT = 20
# Beyond that a record tells no truth: 30 days, 4 TiB.
_MOST_S, _MOST_MB = 30 * 86400.0, 4 * 2.0**20


@dataclass(frozen=True)
class Measured:
    """What a task took when it last ran.

    Attributes:
        seconds: How long it ran; 0 where its record does not tell.
        peak_mb: Memory of the process at its peak, in MiB; 0 where its record does not tell.
        size: Of all files that it wrote, in bytes.
        cpu_seconds: Processor time of its process; 0 where its record does not tell, as of versions that kept none.
    """

    seconds: float = 0.0
    peak_mb: float = 0.0
    size: int = 0
    cpu_seconds: float = 0.0

    @classmethod
    def of(cls, record: Record) -> Measured:
        """Return what a record tells."""
        return cls.read(record.provenance, record.size)

    @classmethod
    def read(cls, provenance: Mapping[str, Any], size: int = 0) -> Measured:
        """Return what the provenance of a record tells; 0 for what can be no such number."""
        return cls(
            seconds=_number(provenance, "seconds", _MOST_S),
            peak_mb=_number(provenance, "peak_rss_mb", _MOST_MB),
            size=size,
            cpu_seconds=_number(provenance, "cpu_seconds", _MOST_S),
        )


def measured(workdir: Workdir, places: Iterable[Place]) -> dict[Place, Measured]:
    """Return what each task took when it last ran here, of those that have."""
    found = {}
    for place in places:
        try:
            found[place] = Measured.of(workdir.record(*place))
        except DataError:
            continue
    return found


def of_kind(workdir: Workdir, stage: str, *, group: bool) -> list[Record]:
    """Return records of tasks of a kind, a few, whichever study asked for them."""
    folders = workdir.cache.root.glob(f"{stage}/*/*")
    ours = (folder for folder in folders if (entry_of(folder)[1] == GROUP) == group)
    records = (read_record(folder) for folder in islice(ours, _LOOKED_AT))
    return [record for record in records if record is not None]


def _number(provenance: Mapping[str, Any], name: str, most: float) -> float:
    """Return a number of a record; 0 for what can be none: who shares a cache may write into it what they like."""
    value = provenance.get(name)
    # Compared before it becomes a float: an integer of JSON may have more digits than one takes.
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= most:
        return 0.0
    return float(value)
