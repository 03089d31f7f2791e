"""The folder of programs that the dashboard can load: scripts are read, all else is known by why it is none."""

from __future__ import annotations

import codecs
import errno
import stat
from dataclasses import dataclass, field
from pathlib import Path

from hrcneuro.errors import ConfigError
from hrcneuro.ur10.urscript.lexer import Splitter

_GZIP = b"\x1f\x8b"
_TEXT = frozenset(b"\t\n\r\f") | frozenset(range(32, 256))


_CURE = "give a folder of URScript files; . is the one you are in"
_OTHERS = {
    ".installation": "it is an installation; 'load installation' loads it",
    ".variables": "it holds the variables of an installation",
}
"""Files that PolyScope keeps beside its programs, by their endings."""


@dataclass
class Loadable:
    """What can be loaded: scripts by file name, and for files that are none the reason."""

    scripts: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)


def read_programs(folder: str) -> Loadable:
    """Return what lies in ``folder``.

    Raises:
        ConfigError: There is no such folder, its name is empty, or it cannot be read.
    """
    if not folder:
        raise ConfigError(f"--programs {folder!r}: an empty name is no folder", cure=_CURE)
    try:
        paths = sorted(Path(folder).iterdir())
    except OSError as error:
        raise ConfigError(f"--programs {folder!r}: {error.strerror or error}", cure=_CURE) from None
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
    size = _size(path)
    if path.suffix.lower() in _OTHERS:
        raise _NoScriptError(_OTHERS[path.suffix.lower()])
    if size > Splitter.LIMIT:
        raise _NoScriptError(f"it is larger than {Splitter.LIMIT} bytes")
    data = path.read_bytes()
    if data.startswith(_GZIP):
        raise _NoScriptError("it is compressed, as PolyScope's programs and installations are; only URScript runs here")
    if not _TEXT.issuperset(data):
        raise _NoScriptError("it is no text")
    if data.removeprefix(codecs.BOM_UTF8).lstrip().startswith(b"<"):
        raise _NoScriptError("it is XML, as PolyScope's unpacked programs are; only URScript runs here")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Editors of old: every byte is a character.
        return data.decode("latin-1")


def _size(path: Path) -> int:
    """Return how many bytes a file has; what is none, or a link that leads to none, is told apart."""
    try:
        found = path.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise _NoScriptError("it is a link that leads back to itself") from None
        if error.errno == errno.ENOENT and path.is_symlink():
            raise _NoScriptError("it is a link to nothing") from None
        raise
    if stat.S_ISDIR(found.st_mode):
        raise _NoScriptError("it is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise _NoScriptError("it is no file")
    return found.st_size
