"""Units, and the files of other entries that one may read."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hrcneuro.errors import DataError

GROUP = "group"
SWEEP = "sweep"
EVIDENCE = "evidence"
OF_ALL = (GROUP, SWEEP, EVIDENCE)
"""Units that are no subject: what is computed once, for all."""
ASKED_BY = {GROUP: "", SWEEP: " --sweep AXIS=VALUES", EVIDENCE: " --evidence FOLDER"}
"""What follows a stage's name on the command line that computes such a unit."""


def is_piece(unit: str) -> bool:
    """Return whether a unit is a piece of a sweep, by its name, whatever the configuration asks for."""
    return unit.startswith(f"{SWEEP}-")


class Of(enum.Enum):
    """Whose entries a unit reads."""

    OWN = "own"  # the unit's own
    GROUP = "group"
    INCLUDED = "included"  # every subject's that enters the analyses
    EVERYONE = "everyone"  # excluded subjects', too


@dataclass(frozen=True)
class Read:
    """Files that a stage or a drawing reads of other entries.

    Attributes:
        stage: Who wrote them.
        files: Patterns of their names.
        of: Whose they are.
        required: Whether there is nothing to do where they are missing; else what is there is read.
    """

    stage: str
    files: tuple[str, ...]
    of: Of = Of.OWN
    required: bool = True


Reads = tuple[Read, ...]


@dataclass(frozen=True)
class Inputs:
    """The files that one unit of work may read."""

    unit: str
    files: Mapping[str, Mapping[str, Mapping[str, Path]]]  # stage -> unit -> file name -> path

    @classmethod
    def of(cls, unit: str, **folders: Path | Mapping[str, Path]) -> Inputs:
        """Return the inputs found in folders: ``Inputs.of("s01", epoch=DIR)`` or ``of("group", erp={"s01": DIR})``."""
        by_stage = {stage: where if isinstance(where, Mapping) else {unit: where} for stage, where in folders.items()}
        return cls(
            unit,
            {
                stage: {one: {p.name: p for p in sorted(folder.iterdir())} for one, folder in units.items()}
                for stage, units in by_stage.items()
            },
        )

    def path(self, stage: str, name: str, *, unit: str | None = None) -> Path:
        """Return the path of an upstream file; ``{unit}`` in ``name`` stands for the unit.

        Raises:
            DataError: The upstream entry holds no such file.
        """
        unit = unit or self.unit
        name = name.format(unit=unit)
        have = self.files.get(stage, {}).get(unit, {})
        if name not in have:
            raise DataError(
                f"{stage} of {unit} has no file {name!r}; it has {', '.join(sorted(have)) or 'none'}",
                cure=f"rerun it: hrcneuro {stage} {unit} --force",
            )
        return have[name]

    def has(self, stage: str, name: str, *, unit: str | None = None) -> bool:
        """Return whether the upstream entry holds the file."""
        unit = unit or self.unit
        return name.format(unit=unit) in self.files.get(stage, {}).get(unit, {})

    def units(self, stage: str) -> tuple[str, ...]:
        """Return the subjects of a stage whose files are here, in the order of their names."""
        return tuple(sorted(unit for unit in self.files.get(stage, {}) if unit not in OF_ALL))
