"""What a stage is: options with their limits, and the input files that the pipeline hands to it.

A stage module (``hrcneuro/stages/NAME.py``) has these parts, in this order:

``LIBS``            names of the libraries whose major.minor version decides the result
``INPUTS``          upstream stage -> file patterns that the unit of one subject reads
``GROUP_INPUTS``    the same for the unit ``group`` (absent where the stage has none)
``Config``          a frozen dataclass of :func:`option` fields: the TOML section of the stage's name
``check(config)``   sentences that say which values contradict each other
``run(config, inputs, out)``        writes the subject's artifacts into ``out``, returns the JSON summary
``run_group(config, inputs, out)``  the same for the group

A group whose work is long may be cut: ``parts(config)`` names further units, ``run_part`` computes one of them without
inputs, and ``run_group`` finds their files under its own stage's name.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.errors import DataError

Patterns = Mapping[str, tuple[str, ...]]


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    open_low: bool = False,
    choices: tuple[str, ...] = (),
    location: bool = False,
    shared: str = "",
) -> Any:
    """Return a dataclass field with its limits.

    Args:
        default: The value without configuration. Lists are given as tuples, tables as dicts.
        help: One line for ``config show`` and the documentation.
        unit: Unit of a number, for people.
        low, high: Inclusive limits of a number, or of each number in a tuple.
        open_low: ``low`` itself is not allowed.
        choices: The allowed strings.
        location: A path, say: it says where, not what, so it stays out of the cache key.
        shared: Name of a top-level table of the configuration from which this field is filled.
    """
    meta = dict(
        help=help, unit=unit, low=low, high=high, open_low=open_low, choices=choices, location=location, shared=shared
    )
    if isinstance(default, dict):
        return field(default_factory=lambda: dict(default), metadata=meta)
    return field(default=default, metadata=meta)


def params(config: Any) -> dict[str, Any]:
    """Return the fields of a frozen Config that decide results, as JSON-able values (locations left out)."""
    return {
        f.name: plain(getattr(config, f.name)) for f in dataclasses.fields(config) if not f.metadata.get("location")
    }


def plain(value: Any) -> Any:
    """Return ``value`` as JSON-able types: dataclasses and mappings become dicts, tuples become lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return params(value)
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return str(value) if isinstance(value, Path) else value


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
        """Return the upstream units, in the order of their names."""
        return tuple(sorted(self.files.get(stage, {})))
