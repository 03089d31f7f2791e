"""How far a run is: a bar, the time left, and a line for each task under way; on a terminal, and gone in the end."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from hrcneuro.pipeline.item import Item, State

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from hrcneuro.pipeline.forecast import Forecast
    from hrcneuro.pipeline.measured import Place

_BAR = 24


class Progress:
    """What is shown while tasks run."""

    def __init__(
        self, total: int, forecast: Forecast, *, workers: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.total, self.done = total, 0
        self._forecast, self._workers, self._clock = forecast, workers, clock
        self._begun = clock()
        # In the order in which they were handed over: the workers have the first ones, the others wait.
        self._under_way: list[Place] = []
        self._since: dict[Place, float] = {}

    def report(self, item: Item) -> None:
        """Take in what became of a task."""
        place = (item.stage, item.unit)
        if item.state is State.RUNNING:
            self._under_way.append(place)
        elif item.state.settled:
            self.done += 1
            if place in self._under_way:
                self._under_way.remove(place)
            self._forecast.settle(place, item.seconds if item.state is State.RAN else None)
        for one in self.running:
            self._since.setdefault(one, self._clock())

    @property
    def running(self) -> list[Place]:
        """What the workers have in hand."""
        return self._under_way[: self._workers]

    def lines(self) -> list[str]:
        """Return the lines to show: how far, how long; then a line a worker."""
        from hrcneuro.answers.words import roughly

        now = self._clock()
        since = {place: now - self._since.get(place, now) for place in self.running}
        filled = _BAR * self.done // self.total if self.total else _BAR
        seconds = self._forecast.left(since)
        left = "" if seconds is None else f", about {roughly(seconds)} left"
        head = f"{'━' * filled}{'─' * (_BAR - filled)} {self.done}/{self.total}  {_clock_time(now - self._begun)}{left}"
        return [head, *(f"  {name} {unit}  {_clock_time(since[name, unit])}" for name, unit in since)]

    def __rich__(self) -> Text:
        """Return the lines for Rich, which asks for them again and again."""
        from rich.text import Text

        return Text("\n".join(self.lines()), no_wrap=True, overflow="ellipsis")


@contextlib.contextmanager
def shown(progress: Progress, console: Console) -> Iterator[Callable[[], None]]:
    """Keep the progress on the screen; yields what draws it anew at once."""
    from rich.live import Live

    with Live(progress, console=console, transient=True, refresh_per_second=4) as live:
        yield live.refresh


def _clock_time(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
