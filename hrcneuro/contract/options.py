"""How a stage declares its options, and which of them decide its result."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from types import SimpleNamespace
from typing import Any


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    open_low: bool = False,
    choices: tuple[str, ...] = (),
    share: bool = False,
    keys: Mapping[str, Mapping[str, Any]] | None = None,
    path: bool = False,
    keyed: bool = True,
    recordings: bool = False,
    drawing: bool = False,
    private: bool = False,
    keyed_as: Callable[[Any], Any] | None = None,
    shared: str = "",
) -> Any:
    """Return a dataclass field with its limits.

    Args:
        default: The value without configuration. Lists are given as tuples, tables as dicts.
        help: One line for ``config show`` and the documentation.
        unit: Unit of a number, for people. Where it is %, a value of at most 1 is taken for a slip: a share was meant.
        low, high: Inclusive limits of a number, or of each number in a tuple.
        open_low: ``low`` itself is not allowed.
        choices: The allowed strings.
        share: A number of which 1 is the whole; what is given in percent is asked about.
        keys: Of a table of lists of numbers: key -> ``low``, ``high``, ``unit``, ``whole`` of its values. Other keys
            are mistakes, and so are a list without values and a value given twice.
        path: A file or folder; a relative one is taken from the folder of the file that names it.
        keyed: Whether it decides results. What only says where or how, as an address does, stays out of the cache key.
        recordings: Where that is written which nobody can make again: it may not lie in the cache.
        drawing: Only drawings read it: it is part of their keys and of no stage's.
        private: What tells of a lab, as an address does: neither it nor a hash, which could be guessed, is in a key, a
            record or a report.
        keyed_as: Of what is private: returns what stands for it in the key, of which nobody can be found out.
        shared: Name of a top-level table of the configuration from which this field is filled.
    """
    meta = dict(
        help=help, unit=unit, low=low, high=high, open_low=open_low, choices=choices, share=share, keys=keys, path=path,
        keyed=keyed, recordings=recordings, drawing=drawing, private=private, keyed_as=keyed_as, shared=shared,
    )  # fmt: skip
    if isinstance(default, dict):
        return field(default_factory=lambda: dict(default), metadata=meta)
    return field(default=default, metadata=meta)


def params(config: Any) -> dict[str, Any]:
    """Return the fields of a frozen Config that decide numbers, as JSON-able values."""
    return {f.name: _in_key(config, f) for f in dataclasses.fields(config) if _decides_numbers(f)}


def _in_key(config: Any, f: dataclasses.Field[Any]) -> Any:
    stands_for = f.metadata.get("keyed_as") or plain
    return stands_for(getattr(config, f.name))


def _decides_numbers(f: dataclasses.Field[Any]) -> bool:
    hidden = f.metadata.get("private") and not f.metadata.get("keyed_as")
    return bool(f.metadata.get("keyed", True)) and not f.metadata.get("drawing") and not hidden


def plain(value: Any) -> Any:
    """Return ``value`` as JSON-able types: dataclasses and mappings become dicts, tuples become lists."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return params(value)
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return str(value) if isinstance(value, Path) else value


def chosen(sections: Mapping[str, Any], names: tuple[str, ...]) -> SimpleNamespace:
    """Return the named options, ``"erp.channel"`` as ``.erp.channel``; any other one is not there to be read."""
    options: dict[str, dict[str, Any]] = {}
    for name in names:
        section, _, key = name.partition(".")
        options.setdefault(section, {})[key] = getattr(sections[section], key)
    return SimpleNamespace(**{section: SimpleNamespace(**values) for section, values in options.items()})
