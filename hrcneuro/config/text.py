"""The effective configuration as text: TOML whose comments give each value's range, meaning and origin."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from typing import Any

from hrcneuro.config.reader import allowed_range
from hrcneuro.config.settings import Settings
from hrcneuro.contract import plain
from hrcneuro.errors import ConfigError, did_you_mean


def render(settings: Settings, section: str = "", *, as_json: bool = False, origins: bool = True) -> str:
    """Return the configuration, or one section of it, with or without the origin of each value.

    Raises:
        ConfigError: There is no such section.
    """
    parts: dict[str, Any] = {"study": settings.study}
    parts |= {f.name: getattr(settings.shared, f.name) for f in dataclasses.fields(settings.shared)}
    parts |= {**settings.sections, **settings.live}
    if section and section not in parts:
        hint = did_you_mean(section, parts)
        raise ConfigError(f"there is no section {section!r}{hint}", cure=f"sections: {', '.join(parts)}")
    chosen = {section: parts[section]} if section else parts
    if as_json:
        full = {k: _full(v) | _own(settings, k) for k, v in chosen.items()}
        return json.dumps({"config": full, "origins": settings.origins}, indent=1)
    shown = settings.origins if origins else None
    lines: list[str] = []
    for name, part in chosen.items():
        lines += _table(name, part, shown)
        for subject, values in _own(settings, name).get("subjects", {}).items():
            lines.append(f"\n[{name}.subjects.{toml_key(subject)}]")
            lines += [f"{toml_key(key)} = {toml_value(value)}" for key, value in values.items()]
    return "\n".join(lines).strip()


def _own(settings: Settings, stage: str) -> dict[str, Any]:
    """Return ``subjects``: subject -> the options of its own that the configuration gives it; empty without any."""
    tables: dict[str, Any] = {}
    for subject, section in settings.own.get(stage, {}).items():
        start = f"{stage}.subjects.{subject}."
        given = [key.removeprefix(start) for key in settings.origins if key.startswith(start)]
        tables[subject] = {key: plain(getattr(section, key)) for key in given}
    return {"subjects": tables} if tables else {}


def toml_value(value: Any) -> str:
    """Return a plain value as TOML."""
    if value is None:
        return '"none"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }" if value else "{}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(v) for v in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def option_line(f: dataclasses.Field[Any], value: Any, *, origin: str = "") -> str:
    """Return a line of TOML; its comment gives the meaning, the range and, where known, the value's origin."""
    limits = ", ".join(f.metadata.get("choices") or ())
    if not limits and (f.metadata.get("low") is not None or f.metadata.get("high") is not None):
        limits = allowed_range(f.name, f.metadata)
    notes = "; ".join(note for note in (f.metadata.get("help", ""), limits, origin) if note)
    return f"{f.name} = {toml_value(_full(value))}  # {notes}"


def _table(name: str, part: Any, origins: Mapping[str, str] | None) -> Iterator[str]:
    yield f"\n[{name}]"
    if not dataclasses.is_dataclass(part):
        if origins is not None:
            yield f"# {origins.get(name, 'default')}"
        yield from (f"{toml_key(k)} = {toml_value(plain(v))}" for k, v in part.items())
        return
    nested = []
    for f in dataclasses.fields(part):
        value = getattr(part, f.name)
        if f.metadata.get("shared"):
            continue
        if dataclasses.is_dataclass(value):
            nested.append((f"{name}.{f.name}", value))
            continue
        origin = origins.get(f"{name}.{f.name}", "default") if origins is not None else ""
        # A published configuration says what, not where: each user's own places are left for them to fill in.
        where = "# " if origins is None and not f.metadata.get("keyed", True) else ""
        yield where + option_line(f, value, origin=origin)
    for inner, value in nested:
        yield from _table(inner, value, origins)


def _full(value: Any) -> Any:
    # Unlike contract.params this keeps what is not part of a key: a person wants to see them.
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _full(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(k): _full(v) for k, v in value.items()}
    return plain(value)


def toml_key(name: str) -> str:
    """Return a name as TOML has it: in quotes where it is no bare word."""
    return name if name.replace("-", "").replace("_", "").isalnum() and name.isascii() else json.dumps(name)
