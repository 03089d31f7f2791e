"""What the shell offers after TAB: cheap, silent and never wrong enough to get in the way."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer

# Name, field and value.
_Option = tuple[str, Any, Any]
FILES = "\t"
"""Behind the word, among offers: the shell adds the files it finds. Where nothing is offered it does so anyway."""


def configurations(incomplete: str) -> list[str]:
    """Return the configurations that come with the program and begin so, and files."""
    from hrcneuro.config import shipped

    # Of what is offered, only what begins with the word goes through.
    return [*shipped.names(shipped.CONFIGURATIONS), incomplete + FILES]


def pipelines(incomplete: str) -> list[str]:
    """Return the pipelines that come with the program and begin so, and files."""
    from hrcneuro.config import shipped

    return [*shipped.names(shipped.PIPELINES), incomplete + FILES]


def multiverses(incomplete: str) -> list[str]:
    """Return the files of choices that come with the program and begin so, and files."""
    from hrcneuro.config import shipped

    return [*shipped.names(shipped.MULTIVERSES), incomplete + FILES]


def subjects(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the subjects of the configuration that begin so and are not named yet."""
    given = ctx.params.get("subjects") or ()
    return [s for s in _configured(ctx) if s.startswith(incomplete) and s not in given]


def units(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the subjects of the configuration, and ``group``."""
    from hrcneuro.contract import GROUP

    return [s for s in (*_configured(ctx), GROUP) if s.startswith(incomplete)]


def stages(incomplete: str) -> list[str]:
    """Return the stages that begin so."""
    from hrcneuro.stages import NAMES

    return [name for name in NAMES if name.startswith(incomplete)]


def sections(incomplete: str) -> list[str]:
    """Return the sections of a configuration that begin so."""
    return [
        name for name in ("study", "conditions", "contrasts", "problems", *stages("")) if name.startswith(incomplete)
    ]


def backends(incomplete: str) -> list[str]:
    """Return the arms that begin so."""
    return [name for name in _choices("robot", "backend") if name.startswith(incomplete)]


def arms(incomplete: str) -> list[str]:
    """Return the arms of an experiment that begin so; without one, the tool is drawn."""
    return [name for name in ("none", *_choices("robot", "backend")) if name.startswith(incomplete)]


def humans(incomplete: str) -> list[str]:
    """Return who can press the keys of an experiment."""
    return [name for name in _choices("experiment", "human") if name.startswith(incomplete)]


def paces(incomplete: str) -> list[str]:
    """Return the clocks of an experiment."""
    return [name for name in _choices("experiment", "pace") if name.startswith(incomplete)]


def modes(incomplete: str) -> list[str]:
    """Return the modes of the closed loop."""
    return [name for name in _choices("online", "mode") if name.startswith(incomplete)]


def executors(incomplete: str) -> list[str]:
    """Return the executors that begin so."""
    from hrcneuro.pipeline.executors import NAMES

    return [name for name in NAMES if name.startswith(incomplete)]


def assignments(ctx: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Return what ``--set`` may be followed by, with what it means: a section, then a key of it, then its values."""
    name, equals, _ = incomplete.partition("=")
    section, point, _ = name.partition(".")
    known = sections("")
    if not point:
        offered = [(f"{one}.", "") for one in known]
    elif section not in known:
        return []
    elif section in stages("") or section == "study":
        options = _options(section, _table(ctx, section))
        offered = _values(name, options) if equals else _keys(options)
    else:
        offered = _entries(section, _table(ctx, section), values=bool(equals))
    return [(text, help) for text, help in offered if text.startswith(incomplete)]


def axes(incomplete: str) -> list[tuple[str, str]]:
    """Return the axes that a design sweep may have, each with its limits, and the sweep of all."""
    from hrcneuro.config.reader import allowed_range
    from hrcneuro.learning.grid import LIMITS

    offered = [(f"{axis}=", allowed_range(axis, limits._asdict())) for axis, limits in LIMITS.items()]
    return [(text, help) for text, help in [*offered, ("wide", "all axes")] if text.startswith(incomplete)]


def _keys(options: list[_Option]) -> list[tuple[str, str]]:
    return [(f"{name}=", field.metadata["help"]) for name, field, _ in options]


def _values(name: str, options: list[_Option]) -> list[tuple[str, str]]:
    """Return an option's choices, or the one value that it has."""
    for known, field, value in options:
        if known == name:
            choices = field.metadata["choices"]
            if isinstance(value, bool):
                texts = ["true", "false"]
            elif isinstance(value, list | tuple):
                texts = [_text(choices or value)]
            else:
                texts = list(choices) or [_text(value)]
            return [(f"{name}={text}", "") for text in texts if text]
    return []


def _entries(section: str, table: Mapping[str, Any], *, values: bool) -> list[tuple[str, str]]:
    """Return the names in a table, each with what it stands for; with ``values``, both as an assignment."""
    from hrcneuro.config.text import toml_key

    named = [(f"{section}.{toml_key(name)}=", _text(value)) for name, value in table.items()]
    return [(f"{name}{value}", "") for name, value in named] if values else named


def _text(value: Any) -> str:
    """Return a value as it is typed behind ``--set``: text as it is, all else as TOML."""
    from hrcneuro.config.text import toml_value
    from hrcneuro.contract import plain

    return value if isinstance(value, str) else toml_value(plain(value))


def _choices(section: str, key: str) -> tuple[str, ...]:
    return next(field.metadata["choices"] for name, field, _ in _options(section, {}) if name == f"{section}.{key}")


def _options(section: str, given: Mapping[str, Any]) -> list[_Option]:
    """Return name, field and value of every option of a section: as ``given``, else as without configuration."""
    import dataclasses

    from hrcneuro import stages as stages_
    from hrcneuro.config.sections import SECTIONS
    from hrcneuro.config.settings import StudyOptions

    def walk(config: Any, given: Any, prefix: str) -> list[_Option]:
        found: list[_Option] = []
        for field in dataclasses.fields(config):
            value = getattr(config, field.name)
            theirs = given.get(field.name) if isinstance(given, Mapping) else None
            if dataclasses.is_dataclass(value):
                found += walk(value, theirs, f"{prefix}.{field.name}")
            elif not field.metadata.get("shared"):
                found.append((f"{prefix}.{field.name}", field, value if theirs is None else theirs))
        return found

    if section in SECTIONS:
        return walk(SECTIONS[section].options(), given, section)
    return walk(StudyOptions() if section == "study" else stages_.load(section).config(), given, section)


def _configured(ctx: typer.Context) -> tuple[str, ...]:
    from hrcneuro.config.settings import StudyOptions

    names = _table(ctx, "study").get("subjects")
    return tuple(str(name) for name in names) if isinstance(names, list) else StudyOptions().subjects


def _table(ctx: typer.Context, section: str) -> Mapping[str, Any]:
    """Return a section as the configuration has it; one of the shared tables that it lacks, as it is without any."""
    # Only the one table is read: a mistake elsewhere in the file must not keep TAB from working.
    from hrcneuro.config import shipped
    from hrcneuro.config.settings import Shared
    from hrcneuro.config.tomlfile import parse_toml
    from hrcneuro.errors import HrcError

    given: Any = ctx.params.get("config")
    try:
        path = shipped.find(Path(given), shipped.CONFIGURATIONS) if given else Path("hrcneuro.toml")
        found = parse_toml(path).get(section)
    except (HrcError, OSError, ValueError):
        found = None
    return found if isinstance(found, Mapping) else getattr(Shared(), section, {})
