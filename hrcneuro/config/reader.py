"""TOML values -> the typed fields of a frozen dataclass; every mistake is collected, none stops the reading."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.errors import did_you_mean


@dataclass
class Reader:
    """Reads one source of values (a file, or ``--set``) and keeps the mistakes found on the way."""

    source: str
    folder: Path
    from_text: bool = False
    mistakes: list[str] = field(default_factory=list)

    def record(
        self, base: Any, values: Mapping[str, Any], where: str, *, only: tuple[str, ...] = ()
    ) -> tuple[Any, dict[str, str]]:
        """Return ``base`` (a frozen dataclass) with ``values`` put in, and the origin of each key that was set.

        ``only`` names the options that are allowed; none means all.
        """
        hints = typing.get_type_hints(type(base))
        fields = {f.name: f for f in dataclasses.fields(base)}
        own = {name for name, f in fields.items() if not f.metadata.get("shared") and (not only or name in only)}
        changes: dict[str, Any] = {}
        origins: dict[str, str] = {}
        for key, value in values.items():
            name = f"{where}.{key}"
            if key not in own:
                self.unknown(name, key, own, fields.get(key))
                continue
            current = getattr(base, key)
            if dataclasses.is_dataclass(hints[key]) and isinstance(value, Mapping):
                changes[key], inner = self.record(current, value, name)
                origins |= inner
                continue
            before = len(self.mistakes)
            accepted = self.value(value, hints[key], name, fields[key].metadata)
            if len(self.mistakes) == before:
                changes[key], origins[name] = accepted, self.source
        return dataclasses.replace(base, **changes), origins

    def unknown(self, name: str, key: str, own: set[str], shared: Any) -> None:
        """Note a key that the section does not have."""
        if shared is not None and shared.metadata.get("shared"):
            table = shared.metadata["shared"]
            self.mistakes.append(f"{self.source}: {name} comes from the top-level {table!r}: set it there")
        else:
            hint = did_you_mean(key, own) or f"; allowed: {', '.join(sorted(own))}"
            self.mistakes.append(f"{self.source}: unknown key {name}{hint}")

    def value(self, value: Any, hint: Any, name: str, meta: Mapping[str, Any]) -> Any:
        """Return ``value`` as the type of ``hint``; a mistake is noted and gives None."""
        origin = typing.get_origin(hint)
        args = typing.get_args(hint)
        if origin in (typing.Union, types.UnionType):
            if value is None or (value == "none" and str not in args):
                return None
            return self.value(value, next(a for a in args if a is not type(None)), name, meta)
        if origin is tuple:
            if not isinstance(value, list | tuple):
                return self.wrong(value, f"a list of {_name(args[0])}", name)
            return tuple(self.value(v, args[0], f"{name}[{i}]", meta) for i, v in enumerate(value))
        if origin is dict or origin is Mapping:
            if not isinstance(value, Mapping):
                return self.wrong(value, f"a table of {_name(args[1])}", name)
            return {str(k): self.value(v, args[1], f"{name}.{k}", meta) for k, v in value.items()}
        if dataclasses.is_dataclass(hint):
            if not isinstance(value, Mapping):
                return self.wrong(value, "a table", name)
            return self.record(typing.cast(type, hint)(), value, name)[0]
        return self.scalar(value, hint, name, meta)

    def scalar(self, value: Any, hint: Any, name: str, meta: Mapping[str, Any]) -> Any:
        """Return a bool, int, float or string within its limits."""
        if hint is str and self.from_text and not isinstance(value, str):
            value = str(value).lower() if isinstance(value, bool) else str(value)
        if hint is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if hint is int and isinstance(value, float) and value.is_integer():
            value = int(value)
        if type(value) is not hint:
            return self.wrong(value, _name(hint), name)
        if hint is str:
            return self.text(value, name, meta)
        if hint in (int, float) and not _within(value, meta):
            allowed = allowed_range(name.rpartition(".")[2].partition("[")[0], meta)
            self.mistakes.append(f"{self.source}: {name} = {value!r} is outside its range; allowed: {allowed}")
        return value

    def text(self, value: str, name: str, meta: Mapping[str, Any]) -> str:
        """Return a string that is one of the choices; a relative path is taken from the folder of its source."""
        choices = meta.get("choices") or ()
        if choices and value not in choices:
            hint = did_you_mean(value, choices)
            self.mistakes.append(f"{self.source}: {name} = {value!r}{hint}; allowed: {', '.join(choices)}")
        if meta.get("path") and value:
            return str((self.folder / value).absolute())
        return value

    def wrong(self, value: Any, wanted: str, name: str) -> None:
        """Note a value of the wrong type."""
        self.mistakes.append(f"{self.source}: {name} = {value!r} is {_name(type(value))}; allowed: {wanted}")


def allowed_range(key: str, meta: Mapping[str, Any]) -> str:
    """Return the range of a number as a person writes it: ``0 < l_freq <= 100 Hz``."""
    low, high, unit = meta.get("low"), meta.get("high"), meta.get("unit", "")
    left = "" if low is None else f"{low:g} {'<' if meta.get('open_low') else '<='} "
    right = "" if high is None else f" <= {high:g}"
    return f"{left}{key}{right}{f' {unit}' if unit else ''}"


def _within(value: float, meta: Mapping[str, Any]) -> bool:
    low, high = meta.get("low"), meta.get("high")
    if value != value:
        return False
    above = low is None or (value > low if meta.get("open_low") else value >= low)
    return above and (high is None or value <= high)


def _name(hint: Any) -> str:
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "a string", dict: "a table"}
    return {**names, list: "a list"}.get(hint, getattr(hint, "__name__", str(hint)))
