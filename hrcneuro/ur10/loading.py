"""The folder of programs that the dashboard can load: scripts are read, all else is known by why it is none."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from hrcneuro.errors import ConfigError
from hrcneuro.ur10.urscript.lexer import Splitter

_GZIP = b"\x1f\x8b"
_TEXT = frozenset(b"\t\n\r\f") | frozenset(range(32, 256))


@dataclass
class Loadable:
    """What can be loaded: scripts by file name, and for files that are none the reason."""

    scripts: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)


def read_programs(folder: Path) -> Loadable:
    """Return what lies in ``folder``.

    Raises:
        ConfigError: There is no such folder, or it cannot be read.
    """
    try:
        paths = sorted(folder.iterdir())
    except OSError as error:
        raise ConfigError(
            f"--programs {str(folder)!r}: {error.strerror or error}", cure="give a folder of URScript files"
        ) from None
    found = Loadable()
    for path in paths:
        try:
            found.scripts[path.name] = _script(path)
        except _NoScriptError as reason:
            found.refused[path.name] = str(reason)
        except OSError as error:
            found.refused[path.name] = f"it cannot be read: {error.strerror or error}"
    return found


class _NoScriptError(Exception):
    """Why a file is no script."""


def _script(path: Path) -> str:
    if path.is_dir():
        raise _NoScriptError("it is a folder")
    if path.is_symlink() and not path.exists():
        raise _NoScriptError("it is a link to nothing")
    if not path.is_file():
        raise _NoScriptError("it is no file")
    if path.stat().st_size > Splitter.LIMIT:
        raise _NoScriptError(f"it is larger than {Splitter.LIMIT} bytes")
    data = path.read_bytes()
    if data.startswith(_GZIP):
        raise _NoScriptError("it is compressed, as PolyScope's programs and installations are; only URScript runs here")
    if not _TEXT.issuperset(data):
        raise _NoScriptError("it is no text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Editors of old: every byte is a character.
        return data.decode("latin-1")
