"""Texts that outlive a run, without what tells of the machine and who works there: paths, users, hosts, addresses."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from hrcneuro import stages
from hrcneuro.config.sections import SECTIONS
from hrcneuro.config.settings import Settings

_ABSOLUTE = re.compile(r"(?<![\w.~/])~?/(?:[^\s/'\"]+/)+")
# Of documentation on the web the whole address is kept: it tells of nobody.
_URL = re.compile(r"\b(?!https?:)([A-Za-z][\w+.-]*)://[^\s'\"]+")
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
        begins = r"(?<![\w.-])" if place[0].isalnum() else ""
        text = re.sub(rf"{begins}{re.escape(place)}(?![\w.-])", "…", text)
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
            if f.metadata.get("private"):
                texts = value.values() if isinstance(value, Mapping) else [value]
                found += [text for text in map(str, texts) if len(text) >= _SHORTEST_NAME]
            elif f.metadata.get("path") and isinstance(value, str):
                found += [str(parent) for parent in Path(value).parents if parent.is_absolute()]
    return found


def command_line() -> str:
    """Return how this process was called; of a path only its last part, of a URL its scheme, and no address."""
    words, given = [], sys.argv[1:]
    for before, word in zip(["", *given], given, strict=False):
        words.append("…" if before == "--host" else _argument(word))
    return " ".join(["hrcneuro", *words])


@functools.cache
def _private() -> frozenset[str]:
    """Return the options that are private, as a command line names them."""
    configs = {name: stages.load(name).config for name in stages.NAMES}
    configs |= {name: section.options for name, section in SECTIONS.items()}
    fields = [(name, f) for name, config in configs.items() for f in dataclasses.fields(config)]
    named = [f"{name}.{f.name}" for name, f in fields if f.metadata.get("private")]
    return frozenset({"--host", *named})


def _argument(argument: str) -> str:
    scheme, is_url, _ = argument.partition("://")
    name, equals, value = argument.partition("=")
    if equals and "://" not in name:
        private = value and {name, ".".join(name.split(".")[:2])} & _private()
        return f"{name}=…" if private else f"{name}={_argument(value)}"
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
