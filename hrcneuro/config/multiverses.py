"""Files of reasonable choices: which options could have been other ones, and which of them are crossed."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro import stages
from hrcneuro.config import shipped
from hrcneuro.config.settings import Shared
from hrcneuro.config.text import toml_key, toml_value
from hrcneuro.config.tomlfile import parse_toml, unreadable
from hrcneuro.errors import ConfigError, did_you_mean

CROSS, ALONE = "cross", "one_at_a_time"
_KEYS = ("config", "stages", "curves", CROSS, ALONE)
_TABLES = tuple(f.name for f in dataclasses.fields(Shared))
_MOST = 4096  # universes; more are a slip
_EXAMPLE = 'write [cross] preprocess.reference = { average = "average", recorded = "none" }'


@dataclass(frozen=True)
class Value:
    """One way to choose.

    Attributes:
        name: A short name.
        options: Dotted option -> what it is then, as TOML has it; none: all as the configuration has it.
    """

    name: str
    options: Mapping[str, Any]

    @property
    def assignments(self) -> tuple[str, ...]:
        """The options as ``--set`` takes them."""
        return tuple(f"{name}={toml_value(value)}" for name, value in self.options.items())


@dataclass(frozen=True)
class Choice:
    """Something that could reasonably have been chosen otherwise.

    Attributes:
        name: A short name, or the option's.
        values: The ways to choose, at least two.
        crossed: Whether it is crossed with the other crossed ones; else one value at a time differs from the study.
    """

    name: str
    values: tuple[Value, ...]
    crossed: bool


@dataclass(frozen=True)
class Multiverse:
    """What a file of choices asks for.

    Attributes:
        name: Of its results' folder.
        config: The configuration of the study; None: that of the command.
        stages: What each universe consists of; none named: the study's stages.
        curves: Findings that have a specification curve; none named: the command's own.
        choices: In the order of the file, the crossed ones first.
    """

    name: str
    config: Path | None
    stages: tuple[str, ...]
    curves: tuple[str, ...]
    choices: tuple[Choice, ...]


def read_multiverse(path: Path) -> Multiverse:
    """Return what a file of choices, or one that comes with the program by its bare name, asks for.

    Raises:
        ConfigError: The file is missing, no TOML, or has mistakes; all of them at once.
        DataError: The disk fails.
    """
    path = shipped.find(path, shipped.MULTIVERSES)
    try:
        values = parse_toml(path)
    except FileNotFoundError as error:
        raise ConfigError(
            f"the multiverse file {path} does not exist",
            cure="name an existing one, or one that comes with the program, such as paper",
        ) from error
    except OSError as error:
        raise unreadable(path, error) from error
    return _Reader(path).read(values)


class _Reader:
    """Reads a file and keeps what is wrong with it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.mistakes: list[str] = []

    def read(self, values: Mapping[str, Any]) -> Multiverse:
        for key in values:
            if key not in _KEYS:
                hint = did_you_mean(key, _KEYS) or f"; allowed: {', '.join(_KEYS)}"
                self.mistakes.append(f"unknown key {key}{hint}")
        config = values.get("config", "")
        if not isinstance(config, str):
            self.mistakes.append(f"config = {config!r} is no path")
        choices = [*self._section(values, CROSS), *self._section(values, ALONE)]
        named = self._words(values, "stages")
        self.mistakes += [f"stages names {s!r}{did_you_mean(s, stages.NAMES)}" for s in named if s not in stages.NAMES]
        self._compare(choices)
        curves = self._words(values, "curves")
        if self.mistakes:
            found = "\n".join(f"  - {one}" for one in self.mistakes)
            many = f"{len(self.mistakes)} mistake{'s' * (len(self.mistakes) > 1)}"
            raise ConfigError(f"{self.path} has {many}:\n{found}", cure=f"correct them; {_EXAMPLE}")
        place = self.path.parent / config if config else None
        return Multiverse(self.path.stem, place, named, curves, tuple(choices))

    def _words(self, values: Mapping[str, Any], key: str) -> tuple[str, ...]:
        given = values.get(key, [])
        if isinstance(given, list) and all(isinstance(one, str) for one in given):
            return tuple(given)
        self.mistakes.append(f"{key} = {given!r} is no list of names")
        return ()

    def _section(self, values: Mapping[str, Any], section: str) -> Iterator[Choice]:
        table = values.get(section, {})
        if not isinstance(table, Mapping):
            self.mistakes.append(f"{section} = {table!r} is no table; write [{section}]")
            return
        for key, given in table.items():
            where = f"[{section}] {toml_key(key)}"
            if "." in key or key in stages.NAMES or key in _TABLES:
                for option, value in _options({key: given}):
                    yield Choice(option, self._of_option(option, value, f"[{section}] {option}"), section == CROSS)
            else:
                yield Choice(key, self._named(given, where), section == CROSS)

    def _of_option(self, option: str, given: Any, where: str) -> tuple[Value, ...]:
        """Return the values of an option: a list of them, or a table of names and values."""
        if isinstance(given, list):
            return tuple(Value(_name(one), {option: one}) for one in given)
        if isinstance(given, Mapping):
            return tuple(Value(name, {option: one}) for name, one in given.items())
        self.mistakes.append(f"{where} = {given!r}; allowed: a list of values, or a table of names and values")
        return ()

    def _named(self, given: Any, where: str) -> tuple[Value, ...]:
        """Return the values of a choice that has a name: a table of names and what each sets."""
        if not isinstance(given, Mapping):
            self.mistakes.append(f"{where} is neither an option (STAGE.KEY) nor a table of names and what each sets")
            return ()
        found = []
        for name, table in given.items():
            if isinstance(table, Mapping):
                found.append(Value(name, dict(_options(table))))
            else:
                self.mistakes.append(
                    f"{where}.{name} = {table!r} is no table of options; allowed: {{ stage.key = value }}"
                )
        return tuple(found)

    def _compare(self, choices: list[Choice]) -> None:
        """Note choices of fewer than two values, names given twice, and options that two choices set."""
        if not choices:
            self.mistakes.append(f"names no choice under [{CROSS}] or [{ALONE}]")
        names = [one.name for one in choices]
        self.mistakes += [
            f"{name} is chosen twice; allowed: once" for name in dict.fromkeys(names) if names.count(name) > 1
        ]
        by_option: dict[str, str] = {}
        universes = 1
        for choice in choices:
            words = [value.name for value in choice.values]
            if len(words) < 2:
                some = f"{len(words)} value{'s' * (len(words) != 1)}"
                self.mistakes.append(f"{choice.name} has {some}; allowed: at least two")
            twice = sorted({word for word in words if words.count(word) > 1})
            self.mistakes += [f"{choice.name} names {word!r} twice; allowed: each value once" for word in twice]
            universes *= len(words) if choice.crossed and words else 1
            for option in dict.fromkeys(option for value in choice.values for option in value.options):
                self.mistakes += _unknown(option)
                other = by_option.setdefault(option, choice.name)
                if other != choice.name:
                    self.mistakes.append(f"{option} is set by {other} and by {choice.name}; allowed: by one choice")
        if universes > _MOST:
            self.mistakes.append(f"[{CROSS}] makes {universes} universes; allowed: {_MOST}; move choices to [{ALONE}]")


def _options(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (dotted option, value) of nested tables; what is below an option is its value."""
    for key, value in table.items():
        name = f"{before}.{key}" if before else key
        if isinstance(value, Mapping) and not _is_option(name):
            yield from _options(value, name)
        else:
            yield name, value


def _is_option(name: str) -> bool:
    """Return whether a dotted name leads to an option, or to nothing that is known: then whoever reads it says so."""
    stage, *keys = name.split(".")
    if stage in _TABLES:
        return bool(keys)
    if stage not in stages.NAMES:
        return bool(keys)
    part: Any = stages.load(stage).config()
    for key in keys:
        part = getattr(part, key, None)
    return bool(keys) and not dataclasses.is_dataclass(part)


def _unknown(option: str) -> list[str]:
    """Return the mistake of an option that its stage does not have."""
    stage, key, *_ = [*option.split("."), ""]
    if stage not in stages.NAMES:
        return []
    keys = [f.name for f in dataclasses.fields(stages.load(stage).config)]
    return [] if key in keys else [f"unknown option {option}{did_you_mean(key, keys)}"]


def _name(value: Any) -> str:
    """Return a value's own name, where it was given none."""
    if isinstance(value, list):
        return ", ".join(map(_name, value))
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
