"""Pipeline files: which configuration, which stages, which subjects."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from hrcneuro import stages
from hrcneuro.config import shipped
from hrcneuro.config.reader import Reader
from hrcneuro.config.tomlfile import parse_toml, unreadable
from hrcneuro.contract import option
from hrcneuro.errors import ConfigError


@dataclass(frozen=True)
class _File:
    config: str = option("", "configuration, from the folder of the pipeline file")
    stages: tuple[str, ...] = option((), "what to run; none named: the study's stages", choices=stages.NAMES)
    subjects: tuple[str, ...] = option((), "whom; none means everyone and the group")
    report: bool = option(True, "write results/report.html in the end")


@dataclass(frozen=True)
class Pipeline:
    """A configuration, the stages (none: the study's) and subjects that are run with it, and whether it is reported."""

    config: Path | None = None
    stages: tuple[str, ...] = ()
    subjects: tuple[str, ...] = ()
    report: bool = True


def read_pipeline(path: Path) -> Pipeline:
    """Return what a pipeline file, or one that comes with the program by its bare name, asks for.

    Raises:
        ConfigError: The file is missing, no TOML, or asks for something unknown.
        DataError: The disk fails.
    """
    path = shipped.find(path, shipped.PIPELINES)
    try:
        values: dict[str, Any] = parse_toml(path)
    except FileNotFoundError as error:
        raise ConfigError(
            f"the pipeline file {path} does not exist",
            cure="name an existing one, or one that comes with the program, such as smoke",
        ) from error
    except OSError as error:
        raise unreadable(path, error) from error
    reader = Reader(str(path), path.parent)
    file, _ = reader.record(_File(), values, "pipeline")
    if reader.mistakes:
        allowed = ", ".join(f.name for f in fields(_File))
        raise ConfigError("\n".join(reader.mistakes), cure=f"a pipeline file has the keys: {allowed}")
    values = {f.name: getattr(file, f.name) for f in fields(_File)}
    return replace(Pipeline(**values), config=path.parent / file.config if file.config else None)
