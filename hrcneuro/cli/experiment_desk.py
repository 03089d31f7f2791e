"""The experimenter's place: a table of the session on the terminal, and keys that pause it, let it go on, and note."""

from __future__ import annotations

import contextlib
import os
import sys
import termios
import time
import tty
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any

from hrcneuro.answers.words import counted
from hrcneuro.cli.console import Console
from hrcneuro.cli.experiment_writing import Writer
from hrcneuro.experiment.ports import Order, Seen

if TYPE_CHECKING:
    from rich.console import RenderableType

    from hrcneuro.experiment.turns import Turn

_EVERY_S = 0.25
_TWICE_S = 2.0
_HELP = "space: go on   p: pause   n: remark   q twice: end"


class Desk:
    """A table drawn four times a second; without a terminal, a line for each thing that changes, and no keys."""

    def __init__(self, talk: Console, n_blocks: int) -> None:
        """Sit down; ``n_blocks`` is how many the session has."""
        self._talk, self._n_blocks = talk, n_blocks
        self._writer: Writer | None = None
        self._table_shown = talk.shows_progress
        self._before: list[Any] | None = None
        self._drawn = self._quit = float("-inf")
        self._remark: str | None = None
        self._told = ""

    def __enter__(self) -> Desk:
        self._writer = Writer(pictures=self._table_shown, quiet=self._talk.quiet)
        if self._table_shown and sys.stdin.isatty():
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()
        if self._before is not None:
            with contextlib.suppress(termios.error, OSError):
                # At once: what a terminal that is held up has not shown yet is not waited for.
                termios.tcsetattr(sys.stdin, termios.TCSANOW, self._before)
            self._before = None

    @property
    def attended(self) -> bool:
        """Whether keys are taken here."""
        return self._before is not None and self._writer is not None and not self._writer.gone

    def waits_for(self) -> Sequence[Any]:
        """Return the keyboard, where there is one."""
        return [sys.stdin.fileno()] if self.attended else []

    def asked(self) -> list[Order | str]:
        """Return what was asked for, and remarks."""
        from select import select

        found: list[Order | str] = []
        while self.attended and select([sys.stdin.fileno()], [], [], 0)[0]:
            pressed = ""
            with contextlib.suppress(OSError):
                pressed = os.read(sys.stdin.fileno(), 64).decode(errors="ignore")
            if not pressed:
                # The terminal has gone.
                self._before = None
            for key in pressed:
                found += self._take(key)
        return found

    def _take(self, key: str) -> list[Order | str]:
        if self._remark is not None:
            return self._write(key)
        if key == "n":
            self._remark = ""
        elif key in " \n\r":
            return [Order.GO_ON]
        elif key == "p":
            return [Order.PAUSE]
        elif key == "q":
            twice = time.monotonic() - self._quit < _TWICE_S
            self._quit = time.monotonic()
            return [Order.END] if twice else []
        return []

    def _write(self, key: str) -> list[Order | str]:
        assert self._remark is not None
        if key in "\n\r":
            text, self._remark = self._remark.strip(), None
            return [text] if text else []
        if key == "\x1b":
            self._remark = None
        elif key in "\x7f\b":
            self._remark = self._remark[:-1]
        elif key.isprintable():
            self._remark += key
        return []

    def say(self, text: str) -> None:
        """Say something; never waits until it is written."""
        if self._writer is not None:
            self._writer.say(text)
        else:
            self._talk.say(text)

    def show(self, seen: Seen, now: float) -> None:
        """Draw the table where the time has come; say what is wrong when it becomes so; never waits for it."""
        wrong = "; ".join(filter(None, (seen.trouble, seen.cure)))
        if wrong != self._told:
            self._told = wrong
            if wrong:
                self.say(f"\a{wrong}" if self._table_shown else wrong)
        if self._writer is None or not self._table_shown or now - self._drawn < _EVERY_S:
            return
        self._drawn = now
        # Made here, of the state as it is now: only the drawing is left to the thread.
        self._writer.draw(self._table(seen))

    def _table(self, seen: Seen) -> RenderableType:
        from rich.console import Group
        from rich.table import Table
        from rich.text import Text

        grid = Table.grid(padding=(0, 2))
        ignored = ", ".join(f"{why} {n}" for why, n in seen.ignored.items())
        grid.add_row("keys", f"{seen.keys['']} counted" + (f"; ignored: {ignored}" if ignored else ""))
        grid.add_row("markers", f"{seen.markers} sent")
        if seen.loop:
            acts = "the robot acts by the owners" if seen.loop == "shadow" else "the robot acts by what was learned"
            grid.add_row("closed loop", f"{seen.loop}: {acts}")
        if seen.recorded:
            grid.add_row("recorded", Text(seen.recorded, style="" if seen.recorded == "yes" else "red"))
        if seen.health is not None:
            arm = seen.health
            late = f", {counted(arm.late_packets, 'packet')} borne late" if arm.late_packets else ""
            text = (
                f"packets {1e3 * arm.packet_age:.0f} ms old at most, {1e3 * arm.path_error:.1f} mm off its path{late}"
            )
            grid.add_row("arm", text)
        if seen.stops:
            grid.add_row("stops", Text(f"the arm was stopped {counted(seen.stops, 'time')}", style="red"))
        for turn in seen.moves:
            grid.add_row(f"move {turn.go.index + 1}", _move(turn))
        if seen.trouble:
            grid.add_row(Text("wrong", style="bold red"), Text(seen.trouble, style="bold red"))
        if seen.trouble and seen.cure:
            grid.add_row(Text("cure", style="bold"), seen.cure)
        head = Text.assemble((_where(seen, self._n_blocks), "bold"), ": ", seen.phase)
        if seen.asked:
            head.append(f"; {seen.asked}", style="yellow")
        return Group(head, grid, self._foot())

    def _foot(self) -> RenderableType:
        from rich.text import Text

        if self._remark is not None:
            return Text(f"remark (Enter keeps it, Esc drops it): {self._remark}_", style="bold")
        if not self.attended:
            return Text("no keys are taken here: this terminal is not the keyboard's", style="dim")
        if time.monotonic() - self._quit < _TWICE_S:
            return Text("q once more ends the session", style="bold yellow")
        return Text(_HELP, style="dim")


def _where(seen: Seen, n_blocks: int) -> str:
    if seen.block is None:
        return "before the first block"
    block = seen.block.block
    kind = "practice block" if block.practice else "block"
    of = "" if block.practice else f" of {n_blocks}"
    return f"{kind} {block.number}{of} ({block.scenario}), episode {seen.episode} of {block.episodes}"


def _move(turn: Turn) -> Any:
    from rich.text import Text

    move = turn.move
    text = f"{move.actor:<6}{move.intended}"
    if move.error:
        text += f", an error made it {move.executed or 'a stay at the edge'}"
    elif move.executed is None:
        text += ", at the edge: stays"
    if move.key_wrong:
        text += ", a wrong key"
    if turn.again:
        text += ", made again"
    return Text(text, style="yellow" if move.error or move.key_wrong else "")
