"""The programs of a controller: the main one, those that wait to be started or to run beside it, and watchdogs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from hrcneuro.ur10.modes import PAUSED, PLAYING, STOPPED, Notice
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled, Program

_MOST_WAITING = 1000
_MOST_SECONDARIES = 10  # in a cycle; the others wait
_LISTS_COMPUTE = (3, 14)  # the first software whose programs add lists and scale them


@dataclass
class Watchdog:
    """rtde_set_watchdog: what happens when an input is not written for ``period`` seconds."""

    name: str
    period: float
    action: str
    written_at: float  # s since the controller's start


def exception(error: ScriptError) -> Notice:
    """Return the notice that a program went wrong, or cannot be run."""
    return Notice("exception", str(error), error.line, error.column, code=error.code)


class Programs:
    """What is run, and in which order, cycle by cycle."""

    def __init__(
        self,
        *,
        version: tuple[int, int, int, int],
        say: Callable[[Notice], None],
        ended: Callable[[], None],
    ) -> None:
        """Begin with none; ``say`` tells what happens to them, ``ended`` is called when the main one is over."""
        self._lists_compute = version[:2] >= _LISTS_COMPUTE
        self._say, self._ended = say, ended
        self.functions: dict[str, Callable[..., object]] = {}
        self.main: Program | None = None
        self.running: Program | None = None  # whose turn it is, main or secondary
        self.watchdogs: dict[str, Watchdog] = {}
        self.paused = False
        self._waiting: deque[Compiled] = deque()

    @property
    def state(self) -> int:
        """The main program's state as RTDE gives it."""
        if self.main is None:
            return STOPPED
        return PAUSED if self.paused else PLAYING

    def add(self, script: Compiled) -> None:
        """Start a program with the next cycle, in place of the main one, or beside it where it is secondary."""
        if len(self._waiting) < _MOST_WAITING:
            self._waiting.append(script)

    def stop(self) -> None:
        """End the main program, and those that wait."""
        self._waiting.clear()
        if self.main is not None:
            self.main.stop()
        self._forget()

    def watch(self, now: float) -> None:
        """Do what watchdogs ask for whose inputs were not written in time."""
        for watchdog in list(self.watchdogs.values()):
            if now - watchdog.written_at > watchdog.period:
                if watchdog.action == "stop":
                    self._say(Notice("error", f"RTDE watchdog: {watchdog.name} was not written in time"))
                    self.stop()
                elif watchdog.action == "pause":
                    self.paused = self.main is not None

    def cycle(self, *, ready: bool) -> None:
        """Start what waits, main programs only where the robot is ``ready``, and run the main one for a cycle."""
        secondaries = 0
        while self._waiting and secondaries < _MOST_SECONDARIES:
            script = self._waiting.popleft()
            program = Program(script, self.functions, lists_compute=self._lists_compute)
            if script.secondary:
                # It has this cycle: what waits, sleeps or moves goes wrong.
                self._advance(program)
                secondaries += 1
            elif not ready:
                self._say(Notice("error", "The robot is not running: the program was not started"))
            else:
                self._start(program)
                if self._waiting:
                    self._advance(program)
        if self.main is not None and not self.paused:
            self._advance(self.main)

    def _start(self, program: Program) -> None:
        if self.main is not None:
            self.main.stop()
        self._forget()
        self.main = program
        self._say(Notice("started", program.name))

    def _advance(self, program: Program) -> None:
        self.running = program
        try:
            program.cycle()
        except ScriptError as error:
            self._say(exception(error))
        if program is self.main and not program.running:
            self._forget()

    def _forget(self) -> None:
        name = self.main.name if self.main is not None else None
        self.main, self.paused = None, False
        self.watchdogs.clear()
        self._ended()
        if name is not None:
            self._say(Notice("stopped", name))
