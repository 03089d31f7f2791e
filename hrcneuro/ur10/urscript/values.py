"""URScript's values as translated code computes with them: arithmetic, lists, poses, and what a condition may be."""

from __future__ import annotations

from collections.abc import Callable
from operator import add, sub, truediv
from typing import Any

from hrcneuro.ur10.urscript.lexer import ScriptError


class Pose(list):
    """A pose: to a program another type than a list of six joint angles."""


class Values:
    """What translated code calls of ``rt`` to compute."""

    def __init__(self, *, lists_compute: bool) -> None:
        """Fix whether lists of numbers can be added and scaled, as from software 3.14 on."""
        self._lists_compute = lists_compute
        self.budget = 0  # turns that the thread that runs has left in this cycle

    @staticmethod
    def boolean(value: Any) -> bool:
        """Return an operand of ``and``, ``or``, ``xor`` and ``not``.

        Raises:
            ScriptError: It is no boolean.
        """
        if value is True or value is False:
            return value
        raise ScriptError(f"runtime error: type error: expected True or False, got {_shown(value)}")

    @staticmethod
    def condition(value: Any) -> bool:
        """Return whether a condition holds.

        The script manual (socket_read_line) tests a string; UR's own external control program tests a float.

        Raises:
            ScriptError: It is an integer, a list or a pose.
        """
        if value is True or value is False:
            return value
        if isinstance(value, (str, float)):
            return bool(value)
        raise ScriptError(f"runtime error: type error: a condition is True or False, not {_shown(value)}")

    @staticmethod
    def ordered(value: Any) -> Any:
        """Return an operand of ``<``, ``>``, ``<=`` and ``>=``.

        Raises:
            ScriptError: It is no number.
        """
        if type(value) is int or type(value) is float:
            return value
        raise ScriptError(f"runtime error: type error: only numbers are less or greater, not {_shown(value)}")

    @staticmethod
    def copy(value: Any) -> Any:
        """Return a list's copy, anything else as it is: lists are values in URScript."""
        return type(value)(value) if isinstance(value, list) else value

    @staticmethod
    def items(values: list[Any]) -> list[Any]:
        """Return a list of numbers, texts, or lists of such: nothing deeper."""
        for value in values:
            if isinstance(value, list):
                _flat(value)
        return values

    @staticmethod
    def at(values: Any, index: Any) -> Any:
        """Return an element of a list or a pose."""
        return values[_index(values, index)]

    @staticmethod
    def put(values: Any, indices: list[Any], value: Any) -> None:
        """Set an element of a list, a pose, or a list of lists; a list is copied."""
        *path, last = indices
        for index in path:
            values = values[_index(values, index)]
        values[_index(values, last)] = type(value)(_flat(value)) if isinstance(value, list) else value

    def plus(self, a: Any, b: Any) -> Any:
        """Return a + b: numbers, or lists of one length."""
        return self._each(add, a, b) if _listed(a) and _listed(b) else _number(_operand(a) + _operand(b))

    def minus(self, a: Any, b: Any) -> Any:
        """Return a - b: numbers, or lists of one length."""
        return self._each(sub, a, b) if _listed(a) and _listed(b) else _number(_operand(a) - _operand(b))

    def times(self, a: Any, b: Any) -> Any:
        """Return a · b: numbers, or a number and a list."""
        if _listed(a) or _listed(b):
            values, factor = (a, b) if _listed(a) else (b, a)
            return self._scaled(values, lambda v: v * _operand(factor))
        return _number(_operand(a) * _operand(b))

    def over(self, a: Any, b: Any) -> Any:
        """Return a / b: numbers, or a list and a number."""
        if _listed(a):
            return self._scaled(a, lambda v: truediv(v, _operand(b)))
        return _operand(a) / _operand(b)

    def negated(self, a: Any) -> Any:
        """Return -a."""
        return self._scaled(a, lambda v: -v) if _listed(a) else _number(-_operand(a))

    @staticmethod
    def modulo(a: Any, b: Any) -> Any:
        """Return the remainder of a / b."""
        return _operand(a) % _operand(b)

    @staticmethod
    def pose(*values: float) -> Pose:
        """Return p[x, y, z, rx, ry, rz]."""
        if len(values) != 6:
            raise ScriptError(f"runtime error: a pose has six numbers, not {len(values)}")
        return Pose(values)

    def _each(self, compute: Callable[[Any, Any], Any], a: list[Any], b: list[Any]) -> list[Any]:
        self._allow_lists(a)
        if len(a) != len(b):
            raise ScriptError(f"runtime error: lists of {len(a)} and {len(b)} elements")
        return [_number(compute(_operand(x), _operand(y))) for x, y in zip(a, b, strict=True)]

    def _scaled(self, values: list[Any], compute: Callable[[Any], Any]) -> list[Any]:
        self._allow_lists(values)
        return [_number(compute(_operand(value))) for value in values]

    def _allow_lists(self, values: list[Any]) -> None:
        self.budget -= len(values) // 10
        if not self._lists_compute:
            raise ScriptError("runtime error: no arithmetic with a list before software 3.14")


def index(value: Any, size: int) -> int:
    """Return the number of a channel, a register or a flag.

    Raises:
        ScriptError: It is no integer, or there are fewer.
    """
    if not is_integer(value):
        raise ScriptError(f"runtime error: a channel is an integer, not {_shown(value)}")
    if not 0 <= value < size:
        raise ScriptError(f"runtime error: no channel {value}; 0 … {size - 1} exist")
    return int(value)


def whole(value: float) -> float:
    """Return an integer of 32 bits, where ``value`` is one, else ``value`` as a float."""
    return int(value) if value.is_integer() and -(2**31) <= value < 2**31 else value


def is_integer(value: Any) -> bool:
    """Return whether a value is an integer; 2.0 is one, as what a division gives."""
    return type(value) is int or (type(value) is float and value.is_integer())


def _listed(value: Any) -> bool:
    return type(value) is list


def _index(values: Any, index: Any) -> int:
    if not isinstance(values, list):
        raise ScriptError(f"runtime error: no elements in {_shown(values)}")
    if not is_integer(index):
        raise ScriptError(f"runtime error: an index is an integer, not {_shown(index)}")
    if not 0 <= index < len(values):
        raise ScriptError(f"runtime error: index out of range: {int(index)}, of {len(values)} elements")
    return int(index)


def _flat(values: list[Any]) -> list[Any]:
    if any(isinstance(value, list) for value in values):
        raise ScriptError("runtime error: a list in a list in a list")
    return values


def _operand(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return value
    raise ScriptError(f"runtime error: type error: no arithmetic with {_shown(value)}")


def _number(value: Any) -> Any:
    # Integers have 32 bits; Python's would grow until nothing else runs.
    return value if isinstance(value, float) or -(2**31) <= value < 2**31 else float(value)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "a pose" if isinstance(value, Pose) else "a list"
    return repr(value)[:40]
