"""What is seen of a recording while it grows: each channel, the markers as they come, what stands out."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.cli.console import Console
from hrcneuro.cli.picture import Picture
from hrcneuro.eeg import health
from hrcneuro.live.preflight import names_of, scales

if TYPE_CHECKING:
    from rich.table import Table

    from hrcneuro.live.parameters import RecordOptions
    from hrcneuro.live.recorded_stream import Stream
    from hrcneuro.live.watch import Event

_EVERY_S = 0.5
_LOOK_BACK_S = 2.0
_MARKERS = 5
_COLUMNS = 3
_EVENTS = 6


class View:
    """A table on the terminal, drawn twice a second; without a terminal, lines for what stands out."""

    def __init__(self, talk: Console, folder: Path, options: RecordOptions) -> None:
        self._talk, self._folder, self._options = talk, folder, options
        self._picture = Picture(talk)
        self._drawn = 0.0
        self._windows: dict[str, deque[np.ndarray]] = {}
        self._markers: deque[str] = deque(maxlen=_MARKERS)
        self._events: deque[str] = deque(maxlen=_EVENTS)
        self._seen: dict[str, int] = {}
        self._since: dict[tuple[str, str], float] = {}

    def __enter__(self) -> View:
        self._talk.say(f"recording into {self._folder}; Ctrl-C ends it")
        self._picture.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._picture.__exit__(kind, error, at)

    def tell(self, stream: Stream, event: Event) -> None:
        """Say at once what stands out, with the terminal's bell."""
        text = f"{time.strftime('%H:%M:%S')} {stream.key}: {event}"
        self._events.append(text)
        self._picture.say(text, bell=True)

    def fail(self, text: str) -> None:
        """Say at once that the recording cannot go on."""
        print(f"\aerror: {text}; the recording ends", file=sys.stderr, flush=True)

    def tell_patience(self) -> None:
        """Answer those who press Ctrl-C again."""
        self._talk.say("the recording is being ended; a moment")

    def show(self, streams: Sequence[Stream], size: int, seconds: float) -> None:
        """Take in what has come; draw it where there is a terminal and the time has come."""
        self._picture.draw(lambda: self._due(streams, size, seconds), what="the table", then="the recording")

    def _due(self, streams: Sequence[Stream], size: int, seconds: float) -> Table | None:
        for stream in streams:
            self._take(stream)
        now = time.monotonic()
        if now - self._drawn < _EVERY_S:
            return None
        self._drawn = now
        return self._table(streams, size, seconds, now)

    def _take(self, stream: Stream) -> None:
        if stream.last is None or self._seen.get(stream.key) == stream.watch.count:
            return
        self._seen[stream.key] = stream.watch.count
        if stream.description.channel_format == "string":
            self._markers += [f"{row[0]}" for row in stream.last.values]
            return
        window = self._windows.setdefault(stream.key, deque())
        window.append(np.asarray(stream.last.values))
        most = _LOOK_BACK_S * (stream.description.sfreq or 1.0)
        while sum(map(len, window)) - len(window[0]) > most:
            window.popleft()

    def _table(self, streams: Sequence[Stream], size: int, seconds: float, now: float) -> Table:
        from rich.table import Table
        from rich.text import Text

        grid = Table.grid(padding=(0, 2))
        minutes = f"{int(seconds // 3600)}:{int(seconds // 60 % 60):02d}:{int(seconds % 60):02d}"
        grid.add_row(Text(f"{minutes} recorded, {size / 1e6:.1f} MB on disk in {self._folder}"))
        for stream in streams:
            grid.add_row(Text(self._line(stream)))
            if stream.key in self._windows and stream.description.type.lower() == "eeg":
                grid.add_row(self._channels(stream, now))
        if self._markers:
            grid.add_row(Text("markers: " + "   ".join(self._markers)))
        for text in self._events:
            grid.add_row(Text(f"! {text}"))
        return grid

    def _line(self, stream: Stream) -> str:
        about, watch = stream.description, stream.watch
        state = "gone" if stream.inlet is None or stream.gone else "SILENT" if watch.stalled else "comes"
        missing = f", {watch.missing} missing" if watch.missing else ""
        rate = f" at {about.sfreq:g} Hz" if about.sfreq else ""
        return f"{stream.key} ({about.name}): {state}, {watch.count:,} samples{rate}{missing}"

    def _channels(self, stream: Stream, now: float) -> Table:
        """Return RMS, noise of the mains and state of each channel that is a voltage, three channels a row."""
        from rich.table import Table
        from rich.text import Text

        options, about = self._options, stream.description
        factors = scales(about)
        shown = np.flatnonzero(factors)
        values = (np.concatenate(self._windows[stream.key])[:, shown] * factors[shown]).T
        rms, line = health.rms(values), health.line_noise(values, about.sfreq, options.line_hz)
        states = health.states(values, flat_uv=options.flat_uv, rail_uv=options.rail_uv)
        table = Table.grid(padding=(0, 3))
        table.add_row(*[f"     µV: size, {options.line_hz:g} Hz"] * _COLUMNS)
        cells = []
        for row, level, hum, state in zip(shown, rms, line, states, strict=True):
            name = names_of(about)[row]
            since = self._told_since(stream.key, name, state, now)
            told = f"{state} {since:.0f} s" if state else ""
            cells.append(Text.assemble(f"{name:>6} {level:8.1f} {hum:6.1f}  ", (f"{told:<9}", "bold red")))
        for at in range(0, len(cells), _COLUMNS):
            table.add_row(*cells[at : at + _COLUMNS])
        return table

    def _told_since(self, stream: str, channel: str, state: str, now: float) -> float:
        if not state:
            self._since.pop((stream, channel), None)
            return 0.0
        return now - self._since.setdefault((stream, channel), now)
