"""What a built-in function's argument may be: kinds of arguments, and functions that refuse all else.

A robot's controller takes types and ranges from its script manual; what is no number, or not finite, is none here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from math import inf
from typing import Any, Protocol

from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.library import text
from hrcneuro.ur10.urscript.values import is_integer

_LONGEST = 80  # characters of a value in a message


class Kind(Protocol):
    """What an argument may be."""

    def fits(self, value: Any) -> bool:
        """Return whether a value is of this kind."""

    def __str__(self) -> str:
        """Say what is allowed."""


@dataclass(frozen=True)
class Number:
    """A finite number from ``low`` to ``high``, or above ``above``; booleans are none."""

    low: float = -inf
    high: float = inf
    above: float = -inf

    def fits(self, value: Any) -> bool:
        """Return whether it is a number in the range."""
        return type(value) in (int, float) and self.low <= value <= self.high and self.above < value < inf

    def __str__(self) -> str:
        least = f"above {self.above:g}" if self.above > -inf else f"of {self.low:g} or more"
        if self.high < inf:
            least = f"{least} and at most {self.high:g}" if self.above > -inf else f"from {self.low:g} to {self.high:g}"
        return "a number" if self == Number() else f"a number {least}"


@dataclass(frozen=True)
class Integer:
    """An integer from ``low`` to ``high``; 2.0 is one, as results of a division are."""

    low: int = -(2**31)
    high: int = 2**31 - 1

    def fits(self, value: Any) -> bool:
        """Return whether it is an integer in the range."""
        return is_integer(value) and self.low <= value <= self.high

    def __str__(self) -> str:
        return f"an integer from {self.low} to {self.high}"


@dataclass(frozen=True)
class Numbers:
    """A list, or a pose, of ``size`` values of one kind; of any size where that is 0."""

    size: int = 0
    each: Kind = Number()

    def fits(self, value: Any) -> bool:
        """Return whether it is such a list."""
        return (
            isinstance(value, list) and (not self.size or len(value) == self.size) and all(map(self.each.fits, value))
        )

    def __str__(self) -> str:
        size = f"{self.size} " if self.size else ""
        return f"a list of {size}numbers" if self.each == Number() else f"a list of {size}values, each {self.each}"


@dataclass(frozen=True)
class OneOf:
    """One of a few values."""

    values: Collection[Any]

    def fits(self, value: Any) -> bool:
        """Return whether it is one of them, of their type."""
        return any(value == one and isinstance(value, bool) is isinstance(one, bool) for one in self.values)

    def __str__(self) -> str:
        *others, last = map(repr, self.values)
        return f"{', '.join(others)} or {last}"


@dataclass(frozen=True)
class Text:
    """A string of at most ``most`` characters, not an empty one where it must say something."""

    least: int = 0
    most: int = 1 << 16

    def fits(self, value: Any) -> bool:
        """Return whether it is a string of such a length."""
        return isinstance(value, str) and self.least <= len(value) <= self.most

    def __str__(self) -> str:
        return "a string" if self == Text() else f"a string of {self.least} … {self.most} characters"


@dataclass(frozen=True)
class Either:
    """Of one kind or another."""

    kinds: Collection[Kind]

    def fits(self, value: Any) -> bool:
        """Return whether it is of any of the kinds."""
        return any(kind.fits(value) for kind in self.kinds)

    def __str__(self) -> str:
        return " or ".join(map(str, self.kinds))


def require(function: str, parameter: str, kind: Kind, value: Any) -> None:
    """Refuse what is not of a kind.

    Raises:
        ScriptError: It is not; the message has the function, its parameter, what is allowed and what was given.
    """
    if not kind.fits(value):
        got = text(value) if isinstance(value, list) else repr(value)
        got = got if len(got) <= _LONGEST else got[:_LONGEST] + " …"
        raise ScriptError(f"runtime error: {function}: {parameter} is {kind}, not {got}")


def checked(name: str, function: Callable[..., Any], kinds: Mapping[str, Kind]) -> Callable[..., Any]:
    """Return a function that is ``function``, but refuses arguments that are not of their ``kinds``."""
    order = [(parameter, kinds.get(parameter)) for parameter in signature(function).parameters]

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        for (parameter, kind), value in zip(order, given, strict=False):
            if kind is not None and not kind.fits(value):
                require(name, parameter, kind, value)
        for parameter, value in named.items():
            kind = kinds.get(parameter)
            if kind is not None and not kind.fits(value):
                require(name, parameter, kind, value)
        return function(*given, **named)

    return call
