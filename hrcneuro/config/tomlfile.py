"""A TOML file as its editor left it: with a byte order mark or without; any other encoding is named with its line."""

from __future__ import annotations

import codecs
import tomllib
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError

_CURE = "save the file as UTF-8 (in the editor's Save as)"
_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def parse_toml(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises:
        ConfigError: It is no TOML, or not in UTF-8, the encoding that TOML prescribes.
        OSError: It cannot be read.
    """
    data = path.read_bytes()
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
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path} is not valid TOML: {error}", cure="correct the line named") from error
