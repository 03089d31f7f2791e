"""A running program: its threads, each a generator that runs until it waits, in turn, once a cycle."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from functools import lru_cache
from types import CodeType
from typing import Any

from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.signatures import Signatures
from hrcneuro.ur10.urscript.translate import Translator
from hrcneuro.ur10.urscript.values import Pose, Values

__all__ = ["Compiled", "Pose", "Program", "Routine", "Thread", "compiled"]

Routine = Generator[Any, None, Any]
"""What a thread runs: it yields None when it is done for this cycle, True when others may have a turn before it."""

_BUDGET = 2000  # turns of loops, calls and statements that a program's threads share in a cycle
_MOST_THREADS = 50
_MOST_OVERRUNS = 125  # cycles, one second: longer than any robot was seen to bear
_SOURCE = "<urscript>"


class Compiled:
    """A translated program, which can be started any number of times."""

    def __init__(self, code: CodeType, *, name: str, secondary: bool, origin: list[int]) -> None:
        """Keep the code; ``origin`` has the script's line of each line of Python."""
        self.code = code
        self.name = name
        self.secondary = secondary
        self.origin = origin


@lru_cache(maxsize=64)
def compiled(
    script: str, plain: frozenset[str], blocking: frozenset[str], signatures: Signatures | None = None
) -> Compiled:
    """Return a script's translation; ``plain`` and ``blocking`` name the built-in functions.

    Raises:
        ScriptError: The script is wrong; the message says where.
    """
    translator = Translator(script, plain=plain, blocking=blocking, signatures=signatures)
    try:
        code = compile(translator.source(), _SOURCE, "exec", dont_inherit=True)
    except (SyntaxError, RecursionError, ValueError, MemoryError, OverflowError) as error:
        raise ScriptError(f"the program is too deeply nested or not URScript ({type(error).__name__})") from None
    return Compiled(code, name=translator.name, secondary=translator.secondary, origin=translator.origin)


class Thread:
    """One thread of a program."""

    def __init__(self, number: int, routine: Routine) -> None:
        self.number = number
        self.routine = routine
        self.alive = True
        self.critical = 0
        self.budget = 0
        self.kept_out = False  # of its turn, by another thread's critical section
        self.overran = False  # in this turn it waits because its share of the cycle is used up
        self.overruns = 0  # cycles in a row that ended so


class Program(Values):
    """A program in its cycles; what its code calls ``rt``."""

    def __init__(
        self, script: Compiled, functions: Mapping[str, Callable[..., Any]], *, lists_compute: bool = True
    ) -> None:
        """Prepare a translated script; ``functions`` are the built-in ones, by name."""
        super().__init__(lists_compute=lists_compute)
        self.name = script.name
        self.secondary = script.secondary
        self._origin = script.origin
        self._holder: Thread | None = None  # in a critical section
        self._ended = False
        space: dict[str, Any] = {"__builtins__": {}, "rt": self}
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
            ScriptError: The program went wrong, or is a secondary one that takes longer than this cycle; it has ended.
        """
        waiting = list(self._threads.values())
        for thread in waiting:
            thread.budget = _BUDGET // max(1, len(waiting))
        ran = True
        while waiting and ran:
            waiting, ran = self._round(waiting)
        if self.secondary and self.running:
            self.stop()
            raise ScriptError(
                "runtime error: Runtime is too much behind: a secondary program may not wait, sleep or move, and has "
                "one cycle"
            )

    def _round(self, threads: list[Thread]) -> tuple[list[Thread], bool]:
        """Give each thread a turn; return those that want another in this cycle, and whether any had one."""
        again: list[Thread] = []
        ran = False
        for thread in threads:
            if not thread.alive:
                continue
            if self._holder is not None and self._holder is not thread:
                thread.kept_out = True
                again.append(thread)
                continue
            ran, thread.kept_out = True, False
            if self._step(thread):
                again.append(thread)
            if not self.running:
                return [], ran
        return again, ran

    def _step(self, thread: Thread) -> bool:
        """Run a thread until it waits; return whether it does so for others only."""
        self.current, self.budget, thread.overran = thread, thread.budget, False
        try:
            return bool(next(thread.routine))
        except StopIteration:
            self._end(thread)
        except ScriptError as error:
            self.stop()
            raise self._placed(error, error) from None
        except Exception as error:
            # Whatever Python makes of a wrong program: an unset variable, an index, a type, a division.
            self.stop()
            raise self._placed(ScriptError(f"runtime error: {_explained(error)}"), error) from None
        finally:
            thread.budget = self.budget
            thread.overruns = thread.overruns + 1 if thread.overran else 0
        return False

    def _placed(self, error: ScriptError, raised: BaseException) -> ScriptError:
        """Return the error with the script's line in which it was raised."""
        at, trace = 0, raised.__traceback__
        while trace is not None:
            if trace.tb_frame.f_code.co_filename == _SOURCE:
                at = trace.tb_lineno
            trace = trace.tb_next
        line = self._origin[at - 1] if 0 < at <= len(self._origin) else 0
        if not line or error.line:
            return error
        return ScriptError(f"{error} (line {line})", line=line, column=1, code=error.code)

    def stop(self) -> None:
        """End all threads."""
        self._ended = True
        for thread in self._threads.values():
            thread.alive = False

    # --- what translated code and built-in functions call -------------------------------------------------------

    def run(self, routine: Routine) -> int:
        """Start a thread; return its number, which is not 0."""
        if self.secondary:
            raise ScriptError("runtime error: a secondary program has no threads")
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
        yield from self.wait_until(lambda: number not in self._threads)

    def halt(self) -> Routine:
        """End the program."""
        self.stop()
        yield

    def overrun(self) -> None:
        """Note that the thread's share of the cycle is used up: it computes, and neither waits nor moves the arm.

        Raises:
            ScriptError: It has done nothing else for a second.
        """
        self.current.overran = True
        if self.current.overruns >= _MOST_OVERRUNS:
            raise ScriptError(
                "runtime error: a thread used too much time without telling the robot what to do: it computed for a "
                "second; sync() or sleep() in its loop gives the others time"
            )

    def wait_until(self, ready: Callable[[], bool]) -> Routine:
        """Wait for something outside; meanwhile the others run, even where the caller is in a critical section."""
        while not ready():
            yield from self.give_way()

    def give_way(self) -> Routine:
        """Wait for the next cycle; meanwhile the others run, even where the caller is in a critical section."""
        thread = self.current
        if self._holder is thread:
            self._holder = None
        yield
        if thread.critical:
            self._holder = thread

    def enter_critical(self) -> None:
        """Let no other thread run until :meth:`exit_critical`."""
        self._holder = self.current
        self.current.critical += 1

    def exit_critical(self) -> bool:
        """Let the others run again; return whether one has waited for that."""
        self.current.critical = max(0, self.current.critical - 1)
        if self.current.critical:
            return False
        self._holder = None
        return any(thread.kept_out for thread in self._threads.values())

    def _add(self, routine: Routine) -> Thread:
        self._count += 1
        thread = self._threads[self._count] = Thread(self._count, routine)
        return thread

    def _end(self, thread: Thread) -> None:
        thread.alive = False
        self._threads.pop(thread.number, None)
        if self._holder is thread:
            self._holder = None


_PLAINLY: dict[type[Exception], str] = {
    NameError: "a variable is used before it has a value",
    ZeroDivisionError: "division by zero",
    RecursionError: "too many calls within calls",
    OverflowError: "a number is too large",
}


def _explained(error: Exception) -> str:
    for kind, plainly in _PLAINLY.items():
        if isinstance(error, kind):
            return plainly
    text = str(error)
    for prefix in ("b_", "v_", "g_", "f_"):
        text = text.replace(prefix, "")
    return f"{'type error' if isinstance(error, TypeError) else type(error).__name__}: {text}"[:200]
