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


def _configured(ctx: typer.Context) -> tuple[str, ...]:
    # Only the one table is read: a mistake elsewhere in the file must not keep TAB from working.
    import tomllib

    from hrcneuro.config.settings import StudyOptions

    given: Any = ctx.params.get("config")
    path = Path(given) if given else Path("hrcneuro.toml")
    try:
        names = tomllib.loads(path.read_text(encoding="utf-8"))["study"]["subjects"]
        return tuple(str(name) for name in names)
    except (OSError, ValueError, KeyError, TypeError):
        return StudyOptions().subjects
