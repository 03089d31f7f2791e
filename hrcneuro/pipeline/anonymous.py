"""Texts that outlive a run, without what tells of the machine and who works there: paths, users, hosts, addresses."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import ipaddress
import os
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from hrcneuro import stages
from hrcneuro.config.sections import SECTIONS
from hrcneuro.config.settings import Settings

_ABSOLUTE = re.compile(r"(?<![\w.~/])~?/(?:[^\s/'\"]+/)+")
# Of documentation on the web the whole address is kept: it tells of nobody. With a login, a port or no domain it is a
# machine's.
_PAGE = r"https?://(?![^\s'\"]*@)(?!localhost\b)(?:[A-Za-z0-9-]+\.)+[A-Za-z]{2,}(?![\w.:-])"
_URL = re.compile(rf"\b(?!{_PAGE})([A-Za-z][\w+.-]*)://[^\s'\"]+")
_IPV4 = re.compile(r"(?<![\w.-])\d{1,3}(?:\.\d{1,3}){3}(?::\d+)?(?!\w|[.-]\w)")
_IPV6 = re.compile(r"(?<![\w:.])\[?([0-9A-Fa-f]*:[0-9A-Fa-f:]*:[0-9A-Fa-f.:]*(?:%\w+)?)\]?(?::\d+)?(?!\w)")
# An option, or one of the configuration, with its value.
_ASSIGNMENT = re.compile(r"([\w.\-'\" ]+)=(.*)", re.DOTALL)
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
    text = _OWNER.sub(", of …, group …)", _without_addresses(_URL.sub(r"\1://…", text)))
    for name in _names():
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "…", text)
    return re.sub("…+/", "…/", _ABSOLUTE.sub("…/", text))


def _without_addresses(text: str) -> str:
    return _IPV6.sub(lambda match: "…" if _is_ipv6(match[1]) else match[0], _IPV4.sub("…", text))


def _is_ipv6(text: str) -> bool:
    try:
        ipaddress.IPv6Address(text.rstrip(".:") if not text.endswith("::") else text)
    except ValueError:
        return False
    return text.strip(":") != ""


def hidden(settings: Settings, *folders: Path) -> list[str]:
    """Return what texts of a study must not have in them: its folders, and those and the addresses that it names."""
    found = [str(folder) for folder in folders]
    own = (section for subjects in settings.own.values() for section in subjects.values())
    for section in (*settings.sections.values(), *settings.live.values(), *own):
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
    return frozenset(named)


def _argument(argument: str) -> str:
    scheme, is_url, _ = argument.partition("://")
    if named := _ASSIGNMENT.fullmatch(argument):
        name, value = named.groups()
        return f"{name}=…" if value and _is_private(name, value) else f"{name}={_argument(value)}"
    if is_url:
        return f"{scheme}://…"
    if "/" in argument:
        # Of several paths nobody knows here where each ends.
        return "…" if argument.lstrip()[:1] in ("[", "{") else Path(argument).name
    return _without_addresses(argument)


def _is_private(name: str, value: str) -> bool:
    """Return whether an option is private, or its value a table in which a private one may be."""
    # TOML takes blanks and quotes around the parts of a name.
    section, *rest = (part.strip().strip("'\"") for part in name.split("."))
    private = {one.partition(".")[2] for one in _private() if one.partition(".")[0] == section}
    in_table = bool(private) and value.lstrip().startswith("{")
    return name == "--host" or in_table or bool(private.intersection(rest))


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
