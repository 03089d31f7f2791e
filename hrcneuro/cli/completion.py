"""What the shell offers after TAB: cheap, silent and never wrong enough to get in the way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer


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


def executors(incomplete: str) -> list[str]:
    """Return the executors that begin so."""
    from hrcneuro.pipeline.executors import NAMES

    return [name for name in NAMES if name.startswith(incomplete)]


def assignments(incomplete: str) -> list[tuple[str, str]]:
    """Return what ``--set`` may be followed by, with what it means: a section, then a key of it, then its values."""
    name, equals, _ = incomplete.partition("=")
    section, point, _ = name.partition(".")
    if not point:
        offered = [(f"{one}.", "") for one in sections("")]
    elif section not in stages(""):
        return []
    elif not equals:
        offered = _keys(section)
    else:
        offered = _values(name, section)
    return [(text, help) for text, help in offered if text.startswith(incomplete)]


def _keys(section: str) -> list[tuple[str, str]]:
    return [(f"{name}=", field.metadata["help"]) for name, field, _ in _options(section)]


def _values(name: str, section: str) -> list[tuple[str, str]]:
    """Return an option's choices, or the one value that it has without configuration."""
    from hrcneuro.config.text import toml_value
    from hrcneuro.contract import plain

    for known, field, value in _options(section):
        if known == name:
            if isinstance(value, bool):
                return [(f"{name}=true", ""), (f"{name}=false", "")]
            texts = field.metadata["choices"] or ([value] if isinstance(value, str) else [toml_value(plain(value))])
            return [(f"{name}={text}", "") for text in texts if text]
    return []


def _choices(section: str, key: str) -> tuple[str, ...]:
    return next(field.metadata["choices"] for name, field, _ in _options(section) if name == f"{section}.{key}")


def _options(section: str) -> list[tuple[str, Any, Any]]:
    """Return name, field and default of every option of a stage that may be set in its section."""
    import dataclasses

    from hrcneuro import stages as stages_

    def walk(config: Any, prefix: str) -> list[tuple[str, Any, Any]]:
        found = []
        for field in dataclasses.fields(config):
            value = getattr(config, field.name)
            if dataclasses.is_dataclass(value):
                found += walk(value, f"{prefix}.{field.name}")
            elif not field.metadata.get("shared"):
                found.append((f"{prefix}.{field.name}", field, value))
        return found

    return walk(stages_.load(section).config(), section)


def _configured(ctx: typer.Context) -> tuple[str, ...]:
    # Only the one table is read: a mistake elsewhere in the file must not keep TAB from working.
    from hrcneuro.config.settings import StudyOptions
    from hrcneuro.config.tomlfile import parse_toml
    from hrcneuro.errors import HrcError

    given: Any = ctx.params.get("config")
    path = Path(given) if given else Path("hrcneuro.toml")
    try:
        names = parse_toml(path)["study"]["subjects"]
        return tuple(str(name) for name in names)
    except (HrcError, OSError, ValueError, KeyError, TypeError):
        return StudyOptions().subjects
