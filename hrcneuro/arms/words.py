"""What a person must read at once: lines on standard error that keep nobody waiting, and that nothing can hold up."""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
from collections.abc import Callable
from types import TracebackType

_LAST = 1.0  # s, for the last lines to come out


class Words:
    """Prints in a thread of its own: a terminal that is stopped or gone must not stand between a fault and the stop.

    A context manager, so that what was said comes before what is said next.
    """

    def __init__(self, subject: str, out: Callable[[str], object] | None = None) -> None:
        """Begin each text with its ``subject``, as ``robot s01``; ``out`` takes the texts: none, standard error."""
        self._subject, self._out = subject, out or on_stderr
        self._texts: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._print, name="words", daemon=True)

    def __enter__(self) -> Words:
        return self

    def start(self) -> None:
        """Begin to print, in a thread that runs as this one does: once it runs before the machine's other work."""
        self._thread.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._texts.put(None)
        if not self._thread.ident:
            self._thread.start()
        self._thread.join(_LAST)

    def say(self, problem: str, *, cure: str = "") -> None:
        """Print a line, and a second one with the cure; return at once."""
        text = f"{self._subject}: {problem}\n"
        self._texts.put(text + f"  cure: {cure}\n" if cure else text)

    def _print(self) -> None:
        while (text := self._texts.get()) is not None:
            self._out(text)


def on_stderr(text: str) -> None:
    """Write a text on standard error."""
    # Nobody may be there to read: that is no reason to let go of an arm.
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stderr.write(text)
        sys.stderr.flush()
