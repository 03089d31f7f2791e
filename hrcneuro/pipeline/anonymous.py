"""Texts that outlive a run, without what tells of the machine and who works there: paths, users, hosts, addresses."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from hrcneuro.config.settings import Settings

_ABSOLUTE = re.compile(r"(?<![\w.~/])~?/(?:[^\s/'\"]+/)+")
_URL = re.compile(r"\b(file|memory|s3|sftp|ssh)://[^\s'\"]+")
# As the message of a file that may not be written tells it.
_OWNER = re.compile(r", of \S+, group \S+?\)")
# Shorter names, and that of every administrator, are words: they tell nothing.
_SHORTEST_NAME = 4


def anonymous(text: str, hidden: Iterable[str] = ()) -> str:
    """Return a text with paths cut to their last part, and neither user nor host in it.

    Args:
        text: What is to be kept.
        hidden: What else must not be in it, such as folders (a pattern cannot know where one with blanks begins).
    """
    places = {place.rstrip("/") for place in (*hidden, *_places(_here())) if len(place.rstrip("/")) > 1}
    for place in sorted(places, key=len, reverse=True):
        text = re.sub(rf"{re.escape(place)}(?![\w.-])", "…", text)
    text = _OWNER.sub(", of …, group …)", _URL.sub(r"\1://…", text))
    for name in _names():
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "…", text)
    return re.sub("…+/", "…/", _ABSOLUTE.sub("…/", text))


def hidden(settings: Settings, *folders: Path) -> list[str]:
    """Return what texts of a study must not have in them: its folders, and those and the addresses that it names."""
    found = [str(folder) for folder in folders]
    for section in (*settings.sections.values(), *settings.live.values()):
        for f in dataclasses.fields(section):
            value = getattr(section, f.name)
            if not value or not isinstance(value, str):
                continue
            if f.metadata.get("private"):
                found.append(value)
            elif f.metadata.get("path"):
                found += [str(parent) for parent in Path(value).parents if parent.is_absolute()]
    return found


def command_line() -> str:
    """Return how this process was called; of a path only its last part, of a URL its scheme, and no address."""
    words, given = [], sys.argv[1:]
    for before, word in zip(["", *given], given, strict=False):
        words.append("…" if before == "--host" else _argument(word))
    return " ".join(["hrcneuro", *words])


def _argument(argument: str) -> str:
    scheme, is_url, _ = argument.partition("://")
    name, equals, value = argument.partition("=")
    if equals and "://" not in name:
        return f"{name}=…" if re.search(r"(^--|\.)host$", name) and value else f"{name}={_argument(value)}"
    if is_url:
        return f"{scheme}://…"
    return Path(argument).name if "/" in argument else argument


@functools.cache
def _places(folder: str) -> tuple[str, ...]:
    places = [os.path.expanduser("~"), folder]
    return tuple({*places, *map(os.path.realpath, places)})


def _here() -> str:
    try:
        return os.getcwd()
    except FileNotFoundError:
        return ""  # somebody removed it


@functools.cache
def _names() -> tuple[str, ...]:
    import getpass
    import socket

    names = {socket.gethostname()}
    with contextlib.suppress(OSError, KeyError, ImportError):
        names.add(getpass.getuser())
    return tuple(name for name in names if len(name) >= _SHORTEST_NAME and name != "root")
