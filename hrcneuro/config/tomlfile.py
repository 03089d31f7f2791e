"""A TOML file as its editor left it: with a byte order mark or without; any other encoding is named with its line."""

from __future__ import annotations

import codecs
import tomllib
from pathlib import Path
from typing import Any

from hrcneuro.errors import REFUSED, ConfigError, DataError

_CURE = "save the file as UTF-8 (in the editor's Save as)"
_MOST = 16 << 20
_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def unreadable(path: Path, error: OSError) -> ConfigError | DataError:
    """Return what a person can do where the system refuses a TOML file."""
    if path.is_dir():
        inside = sorted(p.name for p in path.glob("*.toml"))
        example = path / (inside[0] if inside else "NAME.toml")
        return ConfigError(f"{path} is a folder, not a TOML file", cure=f"name the file, such as {example}")
    kind = ConfigError if error.errno in REFUSED else DataError
    return kind(f"{path} cannot be read: {error.strerror}", cure="check the path and its rights")


def parse_toml(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises:
        ConfigError: It is no TOML, or not in UTF-8, the encoding that TOML prescribes.
        OSError: It cannot be read.
    """
    with path.open("rb") as file:
        # Not to the end: of a device such as /dev/zero there is none.
        data = file.read(_MOST + 1)
    if len(data) > _MOST:
        raise ConfigError(f"{path} has more than {_MOST >> 20} MB: it is no configuration", cure="name a TOML file")
    if data.startswith(_WIDE):
        raise ConfigError(f"{path} is in UTF-16; TOML is UTF-8", cure=_CURE)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        words = data.splitlines()[line - 1].decode("latin-1").strip()
        raise ConfigError(
            f"{path} is not in UTF-8: line {line}, {words!r}, seems to be in latin-1 or cp1252",
            cure=_CURE,
        ) from error
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}", cure="correct the line named") from error
