"""What functions are given: calls with the wrong number of arguments, or with names that do not exist, are refused."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import Parameter, Signature, signature
from typing import Any

from hrcneuro.ur10.urscript.lexer import Token, wrong


@dataclass(frozen=True)
class Call:
    """A call in a script: the function's name as a token, and for each argument its parameter's name, or none."""

    function: Token
    given: list[str]


class Signatures:
    """The parameters of functions, by the functions' names."""

    def __init__(self, functions: Mapping[str, Callable[..., Any]]) -> None:
        """Take functions written in Python; those that Python knows no parameters of are not checked."""
        self._known: dict[str, Signature | None] = {}
        for name, function in functions.items():
            try:
                self._known[name] = signature(function)
            except ValueError:
                continue

    def define(self, name: str, parameters: list[tuple[str, bool]]) -> None:
        """Add a script's own function: its parameters in order, and whether each has a default."""
        kind, default = Parameter.POSITIONAL_OR_KEYWORD, {True: None, False: Parameter.empty}
        twice = name in self._known
        try:
            self._known[name] = Signature([Parameter(p, kind, default=default[has]) for p, has in parameters])
        except ValueError:  # a name that Python keeps for itself, or a default before none
            self._known[name] = None
        if twice:  # which of the two a call means is known when it runs
            self._known[name] = None

    def check(self, call: Call) -> None:
        """Refuse a call that does not fit.

        Raises:
            ScriptError: Too many or too few arguments, or one that has no such name; the message names the line.
        """
        known = self._known.get(call.function.text)
        if known is None:
            return
        positional = [key for key in call.given if not key]
        try:
            known.bind(*positional, **{key: 0 for key in call.given if key})
        except TypeError as error:
            raise wrong(call.function, f"{call.function.text}(): {error}; it takes {_shown(known)}") from None


def _shown(known: Signature) -> str:
    names = [p.name if p.default is Parameter.empty else f"[{p.name}]" for p in known.parameters.values()]
    return ", ".join(names) or "none"
