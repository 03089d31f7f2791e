"""A running program: its threads, each a generator that runs until it waits, in turn, once a cycle."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from functools import lru_cache
from types import CodeType
from typing import Any

from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.translate import Translator

Routine = Generator[None, None, Any]

_BUDGET = 2000  # turns of loops, calls and statements that a program's threads share in a cycle
_MOST_THREADS = 50


class Pose(list):
    """A pose: to a program another type than a list of six joint angles."""


class Compiled:
    """A translated program, which can be started any number of times."""

    def __init__(self, code: CodeType, *, name: str, secondary: bool) -> None:
        self.code = code
        self.name = name
        self.secondary = secondary


@lru_cache(maxsize=64)
def compiled(script: str, plain: frozenset[str], blocking: frozenset[str]) -> Compiled:
    """Return a script's translation; ``plain`` and ``blocking`` name the built-in functions.

    Raises:
        ScriptError: The script is wrong; the message says where.
    """
    translator = Translator(script, plain=plain, blocking=blocking)
    try:
        code = compile(translator.source(), "<urscript>", "exec", dont_inherit=True)
    except (SyntaxError, RecursionError, ValueError, MemoryError, OverflowError) as error:
        raise ScriptError(f"the program is too deeply nested or not URScript ({type(error).__name__})") from None
    return Compiled(code, name=translator.name, secondary=translator.secondary)


class Thread:
    """One thread of a program."""

    def __init__(self, number: int, routine: Routine) -> None:
        self.number = number
        self.routine = routine
        self.alive = True
        self.critical = 0


class Program:
    """A program in its cycles; what its code calls ``rt``."""

    def __init__(self, script: Compiled, functions: Mapping[str, Callable[..., Any]]) -> None:
        """Prepare a translated script; ``functions`` are the built-in ones, by name."""
        self.name = script.name
        self.secondary = script.secondary
        self.budget = 0
        self.error = ""
        self._holder: Thread | None = None
        self._ended = False
        space: dict[str, Any] = {"__builtins__": _BUILTINS, "rt": self}
        space.update((f"b_{name}", function) for name, function in functions.items())
        exec(script.code, space)
        self._threads: dict[int, Thread] = {}
        self._count = 0
        self._main = self._add(space["program"]())
        self.current = self._main

    @property
    def running(self) -> bool:
        """Whether the program's main thread lives: the others end with it."""
        return self._main.alive and not self._ended

    def cycle(self) -> None:
        """Run every thread until it waits.

        Raises:
            ScriptError: The program went wrong; it has ended.
        """
        share = _BUDGET // max(1, len(self._threads))
        for thread in list(self._threads.values()):
            if not thread.alive or (self._holder is not None and self._holder is not thread):
                continue
            self.current, self.budget = thread, share
            try:
                next(thread.routine)
            except StopIteration:
                self._end(thread)
            except ScriptError:
                self.stop()
                raise
            except Exception as error:
                # Whatever Python makes of a wrong program: an unset variable, an index, a type, a division.
                self.stop()
                raise ScriptError(f"runtime error: {_explained(error)}") from None
            if not self.running:
                break

    def stop(self) -> None:
        """End all threads."""
        self._ended = True
        for thread in self._threads.values():
            thread.alive = False

    # --- what translated code calls -----------------------------------------------------------------------------

    def run(self, routine: Routine) -> int:
        """Start a thread; return its number, which is not 0."""
        if len(self._threads) >= _MOST_THREADS:
            raise ScriptError(f"runtime error: more than {_MOST_THREADS} threads")
        return self._add(routine).number

    def kill(self, number: Any) -> bool:
        """End a thread, if it lives; return whether it is the caller's own."""
        thread = self._threads.get(number) if isinstance(number, int) else None
        if thread is None:
            return False
        self._end(thread)
        return thread is self.current

    def join(self, number: Any) -> Routine:
        """Wait until a thread has ended."""
        while number in self._threads:
            yield

    def halt(self) -> Routine:
        """End the program."""
        self.stop()
        yield

    def enter_critical(self) -> None:
        """Let no other thread run until :meth:`exit_critical`."""
        self._holder = self.current
        self.current.critical += 1

    def exit_critical(self) -> None:
        """Let the others run again."""
        self.current.critical = max(0, self.current.critical - 1)
        if not self.current.critical:
            self._holder = None

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
    def element(value: Any) -> Any:
        """Return what becomes an element of a list: a list's copy."""
        return type(value)(_flat(value)) if isinstance(value, list) else value

    @staticmethod
    def plus(a: Any, b: Any) -> Any:
        """Return a + b."""
        return _number(_operand(a) + _operand(b))

    @staticmethod
    def minus(a: Any, b: Any) -> Any:
        """Return a - b."""
        return _number(_operand(a) - _operand(b))

    @staticmethod
    def times(a: Any, b: Any) -> Any:
        """Return a · b."""
        return _number(_operand(a) * _operand(b))

    @staticmethod
    def over(a: Any, b: Any) -> Any:
        """Return a / b."""
        return _operand(a) / _operand(b)

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

    def _add(self, routine: Routine) -> Thread:
        self._count += 1
        thread = self._threads[self._count] = Thread(self._count, routine)
        return thread

    def _end(self, thread: Thread) -> None:
        thread.alive = False
        self._threads.pop(thread.number, None)
        if self._holder is thread:
            self._holder = None


def _flat(values: list[Any]) -> list[Any]:
    if any(isinstance(value, list) for value in values):
        raise ScriptError("runtime error: a list in a list in a list")
    return values


def _operand(value: Any) -> Any:
    if isinstance(value, (int, float)):
        return value
    raise ScriptError(f"runtime error: no arithmetic with {'a list' if isinstance(value, list) else repr(value)[:40]}")


def _number(value: Any) -> Any:
    # Integers have 32 bits; Python's would grow until nothing else runs.
    return value if isinstance(value, float) or -(2**31) <= value < 2**31 else float(value)


_BUILTINS = {"bool": bool, "int": int}


def _explained(error: Exception) -> str:
    if isinstance(error, (NameError, UnboundLocalError)):
        return "a variable is used before it has a value"
    text = str(error)
    for prefix in ("b_", "v_", "g_", "f_"):
        text = text.replace(prefix, "")
    return f"{type(error).__name__}: {text}"[:200]
