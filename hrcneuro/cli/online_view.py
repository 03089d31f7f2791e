"""What is seen of the closed loop while it goes: policy, last decisions, deadlines, latencies, the signal."""

from __future__ import annotations

import time
from collections import deque
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.cli.console import Console
from hrcneuro.cli.picture import Picture
from hrcneuro.eeg import health

if TYPE_CHECKING:
    from rich.table import Table

    from hrcneuro.live.online import Online
    from hrcneuro.live.parameters import OnlineOptions, RecordOptions

_EVERY_S = 0.5
_BAR = 30
_DECISIONS = 6


class View:
    """A picture on the terminal, drawn twice a second; without a terminal, lines for what stands out."""

    def __init__(self, talk: Console, record: RecordOptions, options: OnlineOptions, log: Path) -> None:
        self._talk, self._record, self._options, self._path = talk, record, options, log
        self._picture = Picture(talk)
        self._drawn = 0.0
        self._events: deque[str] = deque(maxlen=4)

    def __enter__(self) -> View:
        self._talk.say(f"deciding, mode {self._options.mode}, into {self._path}; Ctrl-C ends it")
        self._picture.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._picture.__exit__(kind, error, at)

    def tell(self, text: str) -> None:
        """Say at once what stands out."""
        line = f"{time.strftime('%H:%M:%S')} {text}"
        self._events.append(line)
        self._picture.say(line)

    def show(self, loop: Online) -> None:
        """Draw, where there is a terminal, the time has come, and no decision is due at this moment."""
        now = time.monotonic()
        if not self._picture.shown or now - self._drawn < _EVERY_S or 0 <= loop.deciding.due_s() < 0.1:
            return
        self._drawn = now
        self._picture.draw(lambda: self.table(loop), what="the picture", then="the loop")

    def table(self, loop: Online) -> Table:
        """Return the picture of a loop."""
        from rich.table import Table
        from rich.text import Text

        grid = Table.grid(padding=(0, 2))
        heard = "" if loop.hearing.there else "; no markers yet"
        grid.add_row(Text(f"{self._options.mode}, learner {self._options.learner}{heard}"))
        for subtask, human in loop.deciding.learner.policy().items():
            grid.add_row(Text(bar(subtask, human, loop.deciding.policy[subtask])))
        moves = sum(loop.deciding.causes.values())
        grid.add_row(
            Text(
                f"{moves} moves, {loop.decided} decided, {loop.in_time} in time, {loop.deciding.causes['']} taught; "
                "not: " + (", ".join(f"{why} {n}" for why, n in loop.deciding.causes.items() if why) or "none")
            )
        )
        for name, values in loop.durations.items():
            grid.add_row(Text(f"{name:<28} median {np.median(values):8.2f} ms   99 % {np.percentile(values, 99):8.2f}"))
        for one in list(loop.trials)[-_DECISIONS:]:
            said = f"P(takeover) {one.probability:.2f}" if one.probability is not None else "no decision"
            end = f"  {one.cause}" if one.cause else ""
            grid.add_row(
                Text(
                    f"{one.block}.{one.episode}.{one.trial} {one.actor}, next {one.next or '-'}: {said} "
                    f"{one.predicted}{end}"
                )
            )
        grid.add_row(Text(self._signal(loop)))
        for event in self._events:
            grid.add_row(Text(f"! {event}"))
        return grid

    def _signal(self, loop: Online) -> str:
        if not loop.recent:
            return "no EEG yet"
        about, record = loop.eeg.inlet.description, self._record
        values = np.concatenate(list(loop.recent), axis=1)
        states = health.states(values, flat_uv=record.flat_uv, rail_uv=record.rail_uv)
        names = [about.labels[row] for row in loop.eeg.rows]
        wrong = [f"{name} {state}" for name, state in zip(names, states, strict=True) if state]
        size = float(np.nanmedian(health.rms(values)))
        return f"EEG {about.name}: {size:.1f} µV (median over channels)" + (
            f"; {', '.join(wrong[:8])}" if wrong else ""
        )


def bar(subtask: str, learned: float, used: float) -> str:
    """Return a line that shows what is learned of a subtask, and what the robot acts by.

    Args:
        subtask: Its name.
        learned, used: Probability that it is left to the human, as learned and as in force.
    """
    filled = round(_BAR * learned)
    return f"{subtask}  robot {'·' * (_BAR - filled)}{'█' * filled} human {learned:.2f}   in force {used:.2f}"
