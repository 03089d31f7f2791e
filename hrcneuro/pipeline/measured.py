"""What tasks of earlier runs took: time, memory and disk, of the records that a study's results point at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hrcneuro.cache.record import Record
from hrcneuro.errors import DataError
from hrcneuro.pipeline.workdir import Workdir

Place = tuple[str, str]
"""A task's name and unit."""


@dataclass(frozen=True)
class Measured:
    """What a task took when it last ran.

    Attributes:
        seconds: How long it ran; 0 where its record does not tell.
        peak_mb: Memory of the process at its peak, in MiB; 0 where its record does not tell.
        size: Of all files that it wrote, in bytes.
    """

    seconds: float = 0.0
    peak_mb: float = 0.0
    size: int = 0

    @classmethod
    def of(cls, record: Record) -> Measured:
        """Return what a record tells."""
        told = record.provenance
        return cls(_number(told, "seconds"), _number(told, "peak_rss_mb"), record.size)


def measured(workdir: Workdir, places: Iterable[Place]) -> dict[Place, Measured]:
    """Return what each task took when it last ran here, of those that have."""
    found = {}
    for place in places:
        try:
            found[place] = Measured.of(workdir.record(*place))
        except DataError:
            continue
    return found


def _number(told: Mapping[str, Any], name: str) -> float:
    value = told.get(name)
    return float(value) if isinstance(value, int | float) else 0.0
