"""TOML values -> the typed fields of a frozen dataclass; every mistake is collected, none stops the reading."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.errors import did_you_mean, is_utf8


class Added(dict[str, Any]):
    """Entries given one by one, as ``--set table.key=value`` does: they come to those that are there.

    A table given as a whole, ``table={}`` or in a file, takes the place of what is there.
    """


@dataclass
class Reader:
    """Reads one source of values and keeps the mistakes found on the way.

    Attributes:
        source: A file, or ``--set``.
        folder: From which relative paths are taken.
        from_text: Whether the values were typed, so that a number may stand for a string.
        options: Key -> the option of the command line that stands for it, and is named in its place.
        mistakes: What was found.
    """

    source: str
    folder: Path
    from_text: bool = False
    options: Mapping[str, str] = field(default_factory=dict)
    mistakes: list[str] = field(default_factory=list)

    def said_by(self, name: str) -> str:
        """Return where a key was given: the source, or the option that stands for it."""
        for key, option in self.options.items():
            if name == key or name.startswith((f"{key}.", f"{key}[")) or key.startswith(f"{name}."):
                return option
        return self.source

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
            accepted = self.value(self._with_base(value, current), hints[key], name, fields[key].metadata)
            if len(self.mistakes) == before:
                changes[key], origins[name] = accepted, self.said_by(name)
                if isinstance(value, Added) and isinstance(current, Mapping):
                    changes[key] = {**current, **accepted}
        return dataclasses.replace(base, **changes), origins

    def _with_base(self, value: Any, current: Any) -> Any:
        """Return added entries; one that is a record itself, of which only some values are given, with its others."""
        if not isinstance(value, Added) or not isinstance(current, Mapping):
            return value
        return {
            key: {**_values(current[key]), **one} if isinstance(one, Added) and key in current else one
            for key, one in value.items()
        }

    def unknown(self, name: str, key: str, own: set[str], shared: Any) -> None:
        """Note a key that the section does not have."""
        if shared is not None and shared.metadata.get("shared"):
            table = shared.metadata["shared"]
            self.mistakes.append(f"{self.said_by(name)}: {name} comes from the top-level {table!r}: set it there")
        else:
            hint = did_you_mean(key, own) or f"; allowed: {', '.join(sorted(own))}"
            self.mistakes.append(f"{self.said_by(name)}: unknown key {name}{hint}")

    def value(self, value: Any, hint: Any, name: str, meta: Mapping[str, Any]) -> Any:
        """Return ``value`` as the type of ``hint``; a mistake is noted and gives None."""
        if hint is Any:
            plain = isinstance(value, str | int | float | list | Mapping)
            return value if plain else self.wrong(value, "text, a number, true or false, a list or a table", name)
        origin = typing.get_origin(hint)
        args = typing.get_args(hint)
        if origin in (typing.Union, types.UnionType):
            if value is None or (value == "none" and str not in args):
                return None
            return self.value(value, next(a for a in args if a is not type(None)), name, meta)
        if origin is tuple:
            if not isinstance(value, list | tuple):
                return self.wrong(value, f"a list of {_name(args[0])}", name)
            meta = {**meta, "beside": _largest(value)}
            return tuple(self.value(v, args[0], f"{name}[{i}]", meta) for i, v in enumerate(value))
        if origin is dict or origin is Mapping:
            if not isinstance(value, Mapping):
                return self.wrong(value, f"a table of {_name(args[1])}", name)
            if not all(is_utf8(str(k)) for k in value):
                return self.wrong(value, "names in UTF-8", name)
            if meta.get("keys"):
                return {str(k): self.axis(v, args[1], f"{name}.{k}", str(k), meta["keys"]) for k, v in value.items()}
            return {str(k): self.value(v, args[1], f"{name}.{k}", meta) for k, v in value.items()}
        if dataclasses.is_dataclass(hint):
            if not isinstance(value, Mapping):
                return self.wrong(value, "a table", name)
            return self.record(typing.cast(type, hint)(), value, name)[0]
        return self.scalar(value, hint, name, meta)

    def axis(self, value: Any, hint: Any, name: str, key: str, keys: Mapping[str, Mapping[str, Any]]) -> Any:
        """Return a list of numbers within the limits of its key: at least one, each once."""
        if key not in keys:
            self.mistakes.append(
                f"{self.said_by(name)}: unknown key {name}{did_you_mean(key, keys)}; allowed: {', '.join(keys)}"
            )
            return None
        before = len(self.mistakes)
        values = self.value(value, hint, name, keys[key])
        if len(self.mistakes) > before:
            return None
        twice = sorted({v for v in values if values.count(v) > 1})
        if twice or not values:
            flaw = f"names {twice[0]:g} twice" if twice else "names no value"
            given = f"{self.said_by(name)}: {name} = {list(values)}"
            self.mistakes.append(f"{given} {flaw}; allowed: at least one, each once")
        return values

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
        if hint in (int, float) and (flaw := _flaw(value, meta)):
            limited = not (meta.get("low") is None and meta.get("high") is None)
            key = name.rpartition(".")[2].partition("[")[0]
            allowed = allowed_range(key, meta) if limited else "any finite number"
            self.mistakes.append(f"{self.said_by(name)}: {name} = {value!r} {flaw}; allowed: {allowed}")
        return value

    def text(self, value: str, name: str, meta: Mapping[str, Any]) -> str:
        """Return a string that is one of the choices; a relative path is taken from the folder of its source."""
        choices = meta.get("choices") or ()
        if choices and value not in choices:
            hint = did_you_mean(value, choices)
            self.mistakes.append(f"{self.said_by(name)}: {name} = {value!r}{hint}; allowed: {', '.join(choices)}")
        if "\0" in value or not (meta.get("path") or is_utf8(value)):
            flaw = "holds a byte that is not in UTF-8" if "\0" not in value else "holds a zero byte"
            self.mistakes.append(f"{self.said_by(name)}: {name} = {value!r} {flaw}; allowed: text in UTF-8")
        if meta.get("path") and value:
            return str((self.folder / value).absolute())
        return value

    def wrong(self, value: Any, wanted: str, name: str) -> None:
        """Note a value of the wrong type."""
        self.mistakes.append(f"{self.said_by(name)}: {name} = {value!r} is {_name(type(value))}; allowed: {wanted}")


def _values(record: Any) -> dict[str, Any]:
    """Return a record's values by name; none where it is none."""
    if not dataclasses.is_dataclass(record):
        return {}
    return {f.name: getattr(record, f.name) for f in dataclasses.fields(record)}


def allowed_range(key: str, meta: Mapping[str, Any]) -> str:
    """Return the range of a number as a person writes it: ``0 < l_freq <= 100 Hz``."""
    low, high, unit = meta.get("low"), meta.get("high"), meta.get("unit", "")
    left = "" if low is None else f"{low:g} {'<' if meta.get('open_low') else '<='} "
    right = "" if high is None else f" <= {high:g}"
    whole = ", whole numbers" if meta.get("whole") else ""
    return f"{left}{key}{right}{f' {unit}' if unit else ''}{whole}"


def _flaw(value: float, meta: Mapping[str, Any]) -> str:
    """Return what is wrong with a number, and what was perhaps meant; an empty string where nothing is."""
    # Also where a range has no upper end: no option means anything by infinity, and 1e999 is read as one.
    if not math.isfinite(value):
        return "is no finite number"
    # 1 alone may be the whole, or 1 %; beside larger numbers it can only be the latter.
    if meta.get("unit") == "%" and (0 < value < 1 or (value == 1 and meta.get("beside", 0) <= 1)):
        return f"looks like a share, and percent are meant here (did you mean {value * 100:g}?)"
    if meta.get("share") and 1 < value <= 100 and _within(value / 100, meta):
        return f"looks like percent, and a share of 1 is meant here (did you mean {value / 100:g}?)"
    if not _within(value, meta):
        return "is outside its range"
    return "is no whole number" if meta.get("whole") and value != int(value) else ""


def _largest(values: Any) -> float:
    """Return the largest number in a list, however deep; 0 where there is none."""
    if isinstance(values, list | tuple):
        return max(map(_largest, values), default=0)
    return values if isinstance(values, int | float) and values == values else 0


def _within(value: float, meta: Mapping[str, Any]) -> bool:
    low, high = meta.get("low"), meta.get("high")
    above = low is None or (value > low if meta.get("open_low") else value >= low)
    return above and (high is None or value <= high)


def _name(hint: Any) -> str:
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "a string", dict: "a table"}
    return {**names, list: "a list"}.get(hint, getattr(hint, "__name__", str(hint)))
