"""What a person or a program sees of a run: progress, talk and errors on stderr; plans and results on stdout."""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from hrcneuro.cli import plan
from hrcneuro.cli.progress import Progress, shown
from hrcneuro.errors import HrcError
from hrcneuro.pipeline.disk_forecast import DiskForecast
from hrcneuro.pipeline.item import Item, State, Word

_MARKS = {Word.RAN: "+", Word.FAILED: "x", Word.FRESH: "="}


class Console:
    """Prints what one command does: progress, notes, errors and results."""

    def __init__(
        self, *, as_json: bool = False, verbose: bool = False, quiet: bool = False, debug: bool = False
    ) -> None:
        self.as_json = as_json
        self.verbose = verbose
        self.quiet = quiet
        self.debug = debug
        self._progress: Progress | None = None
        self._refresh: Any = None
        self._screen: Any = None

    @property
    def shows_progress(self) -> bool:
        """Whether there is somebody to show it to."""
        return not self.quiet and sys.stderr.isatty()

    @contextlib.contextmanager
    def progress(self, progress: Progress) -> Iterator[None]:
        """Show how far a run is, on a terminal only."""
        if not self.shows_progress or progress.total < 2:
            yield
            return
        from rich.console import Console as RichConsole

        self._screen = RichConsole(stderr=True)
        with shown(progress, self._screen) as self._refresh:
            self._progress = progress
            try:
                yield
            finally:
                self._progress = None

    def report(self, item: Item) -> None:
        """Say what became of one task, as soon as it is known."""
        self._say_what_became(item)
        if self._progress is not None:
            self._progress.report(item)
            self._refresh()

    def _say_what_became(self, item: Item) -> None:
        notes = item.summary.get("warnings", []) if item.state is State.RAN else []
        # Pictures follow their numbers without a word.
        told = item.state is State.FAILED or (item.state is State.RAN and not item.draws)
        if not (told or notes or (self.verbose and item.state.done)):
            return
        text = f"{_MARKS[item.word]} {f'{item.stage} {item.unit}':<18} {item.word}"
        if item.state is State.RAN:
            text += f"  {item.seconds:.1f} s"
        if item.why and self.verbose:
            text += f"  ({'; '.join(item.why)})"
        self.say(text, style=plan.STYLES[item.word])
        for warning in notes:
            self.say(f"  note: {warning}", style="yellow")

    def say(self, text: str, *, style: str = "") -> None:
        """Print a line on stderr, above the bar where there is one."""
        if self.quiet:
            return
        if self._progress is not None:
            from rich.text import Text

            self._screen.print(Text(text, style=style), highlight=False)
        else:
            print(_coloured(text, style, sys.stderr), file=sys.stderr)

    def error(self, error: HrcError, trace: str = "", *, of: str = "") -> None:
        """Print an error and its cure; the traceback only for those who debug."""
        head = f"error: {of}: " if of else "error: "
        print(_coloured(head, "bold red", sys.stderr) + error.problem, file=sys.stderr)
        if error.cure:
            print(f"  cure: {error.cure}", file=sys.stderr)
        if self.debug and trace:
            print(trace, file=sys.stderr)

    def fail(self, command: str, error: HrcError) -> None:
        """Say that a command could not even start."""
        if self.as_json:
            print(json.dumps({"command": command, "ok": False, "error": _error(error), "items": []}, indent=1))
        self.error(error)

    def planned(self, items: Iterable[Item]) -> None:
        """Print what would run and why."""
        if not self.quiet:
            self._tell(plan.lines(items, verbose=self.verbose))

    def status(self, items: Sequence[Item]) -> None:
        """Print a table of units and stages, then why what is not fresh is not."""
        width = os.get_terminal_size(sys.stdout.fileno()).columns if sys.stdout.isatty() else 0
        words = "|".join(map(re.escape, (Word.FRESH, Word.STALE, Word.NEVER_RUN, Word.FAILED)))
        for line in plan.table(items, width=width):
            print(re.sub(rf"\b({words})\b", lambda m: _coloured(m[0], plan.STYLES[m[0]], sys.stdout), line))
        self._tell(plan.merged(items, verbose=self.verbose))

    def results(self, lines: Iterable[str]) -> None:
        """Print what came out, for a person."""
        if not self.quiet and not self.as_json:
            for line in lines:
                print(self._wrapped(line))
            # What is said on standard error comes after it, also where both lead to one file.
            sys.stdout.flush()

    def finish(
        self,
        command: str,
        items: Iterable[Item],
        *,
        also: HrcError | None = None,
        planned: bool = False,
        disk: DiskForecast | None = None,
    ) -> int:
        """Print failures (``also`` is of no item) and the closing line, or the JSON document; return the exit code.

        What is ``planned`` only closes on standard output, as it is what was asked for; ``disk`` is what it needs.
        """
        items = list(items)
        if self.as_json:
            printed = {**document(command, items), **({} if disk is None else {"disk": disk.document()})}
            print(json.dumps(printed if also is None else {**printed, "ok": False, "error": _error(also)}, indent=1))
        if not planned and (again := plan.sent_again(items)):
            self.say(f"note: {again}", style="yellow")
        code = self.failures(item for item in items if item.state is State.FAILED)
        if also is not None:
            self.error(also)
        closing = f"{command}: {plan.counted(items)}"
        if planned and not self.as_json:
            self.results([closing, *([str(disk)] if disk is not None and disk.tasks else [])])
        else:
            self.say(closing)
        return code if also is None else also.exit_code if code in (0, also.exit_code) else 1

    def failures(self, failed: Iterable[Item]) -> int:
        """Print what failed, each cause once; return the exit code."""
        alike: dict[tuple[str, str], list[Item]] = {}
        for item in (failed := list(failed)):
            alike.setdefault((item.stage, _of_each(item)), []).append(item)
        for (stage, _), group in alike.items():
            if (error := group[0].error) is not None:
                units = [item.unit for item in group]
                # Their messages differ in the unit's name alone: one stands for all.
                differ = len({str(item.error) for item in group}) > 1
                of = f"{stage} of {plan.span(units)}{f' (this is of {units[0]})' if differ else ''}"
                self.error(error, group[0].trace, of=of)
        codes = {item.error.exit_code for item in failed if item.error is not None}
        return 0 if not codes else codes.pop() if len(codes) == 1 else 1

    def _wrapped(self, line: str) -> str:
        """Return a line that a terminal is too narrow for as several, those behind the first further in."""
        if not sys.stdout.isatty():
            return line
        inner = " " * (len(line) - len(line.lstrip()) + 4)
        width = max(40, os.get_terminal_size(sys.stdout.fileno()).columns)
        # A number stays with its unit.
        tied = re.sub(r"(?<=\d) (?=(?:%|µV|ms|mm|Hz|min|s)(?!\w))", "\N{NO-BREAK SPACE}", line)
        filled = textwrap.fill(tied, width, subsequent_indent=inner, break_long_words=False, break_on_hyphens=False)
        return filled.replace("\N{NO-BREAK SPACE}", " ")

    def _tell(self, lines: Iterable[plan.Line]) -> None:
        """Print lines where results go; beside a JSON document, where talk goes."""
        stream = sys.stderr if self.as_json else sys.stdout
        for text, style in lines:
            text = text if self.as_json else self._wrapped(text)
            print(_coloured(text, style, stream), file=stream)


def _of_each(item: Item) -> str:
    """Return what an item failed of, without the unit's own name: twelve subjects may fail of one cause.

    A cure may name subjects, too, but as examples.
    """
    problem = item.error.problem if item.error else ""
    return re.sub(rf"(?<![^\W_]){re.escape(item.unit)}(?![^\W_])", "…", problem)


def document(command: str, items: Iterable[Item]) -> dict[str, Any]:
    """Return what ``--json`` prints."""
    rows = [
        {
            "stage": item.stage,
            "unit": item.unit,
            "kind": "pictures" if item.draws else "numbers",
            "key": item.key,
            "state": item.state,
            "why": item.why,
            "seconds": item.seconds,
            "artifacts": item.artifacts,
            "summary": item.summary,
            **({"lost": item.lost} if item.lost else {}),
            **({"error": _error(item.error)} if item.error else {}),
        }
        for item in items
    ]
    return {"command": command, "ok": not any(r["state"] in (State.FAILED, State.BLOCKED) for r in rows), "items": rows}


def _error(error: HrcError) -> dict[str, str]:
    return {"problem": error.problem, "cure": error.cure}


def _coloured(text: str, style: str, stream: Any) -> str:
    codes = {"bold red": "1;31", "green": "32", "yellow": "33", "cyan": "36", "dim": "2"}
    if style not in codes or os.environ.get("NO_COLOR") or not stream.isatty():
        return text
    return f"\033[{codes[style]}m{text}\033[0m"
