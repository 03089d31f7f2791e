"""What a drawing is: pictures of artifacts, each with its caption."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.contract.inputs import GROUP, Inputs, Reads
from hrcneuro.contract.stages import Summary


@dataclass(frozen=True)
class Caption:
    """What is said of a picture.

    Attributes:
        text: What it shows.
        title: How a table of contents names it; empty for one that no table of contents names.
    """

    text: str
    title: str = ""


@dataclass(frozen=True)
class Drawing:
    """Pictures of a unit.

    Attributes:
        captions: File -> caption, in the order in which people see them; one that has no data is not written.
        reads: The files that it is handed: of its own entry, and of others where it joins stages.
        options: Names of the options that it may read, ``"erp.channel"``; they are its key's parameters.
        draw: ``draw(config, files, out)`` writes PNG and PDF into ``out``; ``config.erp.channel`` is an option. It may
            return ``{"warnings": [...]}``: what a person should know of the pictures.
    """

    captions: Mapping[str, Caption]
    reads: Reads
    options: tuple[str, ...]
    draw: Callable[[Any, Inputs, Path], Summary | None]


@dataclass(frozen=True)
class Drawings:
    """The drawings of a stage, or of several that a picture joins.

    Attributes:
        name: The stage's; a name of its own where it joins several.
        libraries: Distributions whose major.minor version decides the pictures.
        subject, group: What is drawn for a subject, and for the group.
        sides: Unit -> what is drawn for a result on the side, such as a sweep.
        chapter: The stage in whose chapter of the report they stand; their own where nothing is said.
    """

    name: str
    libraries: tuple[str, ...]
    subject: Drawing | None = None
    group: Drawing | None = None
    sides: Mapping[str, Drawing] = field(default_factory=dict)
    chapter: str = ""

    def of(self, unit: str) -> Drawing | None:
        """Return what is drawn for a unit."""
        return {GROUP: self.group, **self.sides}.get(unit, self.subject)
