"""What a person or a program sees of a run: progress and errors on stderr, results on stdout."""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from hrcneuro.contract import GROUP
from hrcneuro.errors import HrcError
from hrcneuro.pipeline.item import Item, State

_MARKS = {
    State.HIT: "=",
    State.RAN: "+",
    State.FAILED: "x",
    State.BLOCKED: "-",
    State.WOULD_RUN: "?",
    State.RUNNING: ">",
}
_STYLES = {
    State.RAN: "green",
    State.FAILED: "bold red",
    State.BLOCKED: "yellow",
    State.WOULD_RUN: "cyan",
    State.HIT: "dim",
}


class Console:
    """Prints what one command does: progress, notes, errors and results."""

    def __init__(
        self, *, as_json: bool = False, verbose: bool = False, quiet: bool = False, debug: bool = False
    ) -> None:
        self.as_json = as_json
        self.verbose = verbose
        self.quiet = quiet
        self.debug = debug
        self._progress: Any = None
        self._bar: Any = None

    @contextlib.contextmanager
    def progress(self, total: int) -> Iterator[None]:
        """Show a bar with the time left, on a terminal only."""
        if self.quiet or not sys.stderr.isatty() or total < 2:
            yield
            return
        from rich.console import Console as RichConsole
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=RichConsole(stderr=True), transient=True) as self._progress:
            self._bar = self._progress.add_task("", total=total)
            yield
        self._progress = None

    def report(self, item: Item) -> None:
        """Say what became of one task, as soon as it is known."""
        name = f"{item.stage} {item.unit}"
        if self._progress is not None:
            self._progress.update(self._bar, advance=item.state.settled, description=name)
        # Pictures follow their numbers without a word.
        silent = (State.HIT, State.RUNNING, State.BLOCKED, *((State.RAN, State.WOULD_RUN) if item.draws else ()))
        notes = item.summary.get("warnings", []) if item.state is State.RAN else []
        if self.quiet or (item.state in silent and not self.verbose and not notes):
            return
        text = f"{_MARKS[item.state]} {name:<18} {item.state}"
        if item.state is State.RAN:
            text += f"  {item.seconds:.1f} s"
        if item.why and (self.verbose or item.state is State.WOULD_RUN):
            text += f"  ({'; '.join(item.why)})"
        self.say(text, style=_STYLES.get(item.state, ""))
        for warning in notes:
            self.say(f"  note: {warning}", style="yellow")

    def say(self, text: str, *, style: str = "") -> None:
        """Print a line on stderr, above the bar where there is one."""
        if self.quiet:
            return
        if self._progress is not None:
            from rich.text import Text

            self._progress.console.print(Text(text, style=style), highlight=False)
        else:
            print(_coloured(text, style), file=sys.stderr)

    def error(self, error: HrcError, trace: str = "", *, of: str = "") -> None:
        """Print an error and its cure; the traceback only for those who debug."""
        head = f"error: {of}: " if of else "error: "
        print(_coloured(head, "bold red") + error.problem, file=sys.stderr)
        if error.cure:
            print(f"  cure: {error.cure}", file=sys.stderr)
        if self.debug and trace:
            print(trace, file=sys.stderr)

    def fail(self, command: str, error: HrcError) -> None:
        """Say that a command could not even start."""
        if self.as_json:
            print(json.dumps({"command": command, "ok": False, "error": _error(error), "items": []}, indent=1))
        self.error(error)

    def status(self, items: Iterable[Item]) -> None:
        """Print a table of units and stages, then each distinct reason for being stale."""
        from rich.console import Console as RichConsole
        from rich.table import Table

        items = list(items)
        names = list(dict.fromkeys(item.stage for item in items if not item.draws))
        cells = {(item.unit, item.stage): item for item in items}
        table = Table("unit", *names, box=None, pad_edge=False)
        for unit in sorted({item.unit for item in items if not item.draws}, key=lambda u: (u == GROUP, u)):
            table.add_row(unit, *(_freshness(cells, unit, name) for name in names))
        rich = RichConsole(highlight=False)
        rich.print(table)
        reasons: dict[str, dict[str, None]] = {}
        for item in items:
            for reason in item.why if item.state is not State.HIT else ():
                # One line for all units: which of them stand on which is plain from the table.
                reason = re.sub(r"^(inputs: \w+) of \S+ (would run|failed)$", r"\1 \2", reason)
                reasons.setdefault(f"{item.stage}: {reason}", {})[item.unit] = None
        for reason, units in reasons.items():
            # Whole, for those who search in it.
            rich.print(f"{reason}  ({_span(list(units))})", markup=False, soft_wrap=True)

    def finish(self, command: str, items: Iterable[Item], *, also: HrcError | None = None) -> int:
        """Print failures (``also`` is of no item) and the closing line, or the JSON document; return the exit code."""
        items = list(items)
        failed = [item for item in items if item.state is State.FAILED]
        if self.as_json:
            printed = document(command, items)
            print(json.dumps(printed if also is None else {**printed, "ok": False, "error": _error(also)}, indent=1))
        code = self.failures(failed)
        if also is not None:
            self.error(also)
        text = _counted(item for item in items if not item.draws)
        pictures = _counted(item for item in items if item.draws)
        self.say(f"{command}: {text or 'nothing to do'}" + (f"; pictures: {pictures}" if pictures else ""))
        return code if also is None else also.exit_code if code in (0, also.exit_code) else 1

    def failures(self, failed: Iterable[Item]) -> int:
        """Print what failed, each cause once; return the exit code."""
        alike: dict[tuple[str, str], list[Item]] = {}
        for item in (failed := list(failed)):
            alike.setdefault((item.stage, str(item.error)), []).append(item)
        for (stage, _), group in alike.items():
            if (error := group[0].error) is not None:
                self.error(error, group[0].trace, of=f"{stage} of {_span([item.unit for item in group])}")
        codes = {item.error.exit_code for item in failed if item.error is not None}
        return 0 if not codes else codes.pop() if len(codes) == 1 else 1


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
            **({"error": _error(item.error)} if item.error else {}),
        }
        for item in items
    ]
    return {"command": command, "ok": not any(r["state"] in (State.FAILED, State.BLOCKED) for r in rows), "items": rows}


def _counted(items: Iterable[Item]) -> str:
    counts = Counter(item.state for item in items)
    return ", ".join(f"{n} {state}" for state, n in sorted(counts.items()))


def _freshness(cells: Mapping[tuple[str, str], Item], unit: str, stage: str) -> str:
    """Return what the table says of a unit of a stage and its pictures."""
    item, pictures = cells.get((unit, stage)), cells.get((unit, f"{stage}.figures"))
    words = {State.WOULD_RUN: "[yellow]stale[/]", State.FAILED: "[red]fails[/]"}
    if item is None:
        return ""
    if item.state is State.HIT:
        return "[green]fresh[/]" if pictures is None or pictures.state is State.HIT else "[cyan]redraw[/]"
    return words.get(item.state, f"[dim]{item.state}[/]")


def _error(error: HrcError) -> dict[str, str]:
    return {"problem": error.problem, "cure": error.cure}


def _span(units: list[str]) -> str:
    return ", ".join(units) if len(units) <= 3 else f"{units[0]} … {units[-1]}, {len(units)} units"


def _coloured(text: str, style: str) -> str:
    codes = {"bold red": "1;31", "green": "32", "yellow": "33", "cyan": "36", "dim": "2"}
    if style not in codes or os.environ.get("NO_COLOR") or not sys.stderr.isatty():
        return text
    return f"\033[{codes[style]}m{text}\033[0m"
