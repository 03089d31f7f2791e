"""What is written on the experimenter's terminal, by a thread of its own: a terminal that is held up, by Ctrl-S or by a
connection that hangs, holds up no session.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.console import RenderableType

_LAST_WORDS_S = 1.0


class Writer:
    """Writes sentences, all of them, and pictures, of which only the newest; who hands them over never waits.

    Attributes:
        gone: There is no terminal any more.
    """

    def __init__(self, *, pictures: bool, quiet: bool = False) -> None:
        """Begin to write on standard error.

        Args:
            pictures: It is a terminal, on which a picture is drawn over the one before.
            quiet: Nothing is written without pictures.
        """
        self.gone = quiet and not pictures
        self._pictures = pictures
        self._sentences: deque[str] = deque()
        self._picture: RenderableType | None = None
        self._ending = False
        self._news = threading.Event()
        self._thread = threading.Thread(target=self._run, name="terminal", daemon=True)
        self._thread.start()

    def say(self, text: str) -> None:
        """Write a sentence above the picture."""
        if not self.gone:
            self._sentences.append(text)
            self._news.set()

    def draw(self, picture: RenderableType) -> None:
        """Draw a picture in the place of the last one; where others wait to be drawn, they are dropped."""
        self._picture = picture
        self._news.set()

    def close(self) -> None:
        """Take the picture away once all sentences are written; give up after a second."""
        self._ending = True
        self._news.set()
        self._thread.join(_LAST_WORDS_S)

    # --- in the thread ------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        out = _Unbuffered()
        try:
            if self._pictures:
                with _live(out) as live:
                    self._serve(
                        lambda text: live.console.print(text, style="bold", highlight=False, markup=False), live
                    )
            else:
                self._serve(lambda text: out.write(f"{text}\n"), None)
        except OSError:
            self.gone = True

    def _serve(self, write: Any, live: Any) -> None:
        ending = False
        while not ending:
            self._news.wait()
            self._news.clear()
            # Read first: what was said before the end is written.
            ending = self._ending
            while self._sentences:
                write(self._sentences.popleft())
            picture, self._picture = self._picture, None
            if live is not None and picture is not None and not ending:
                live.update(picture, refresh=True)


@contextlib.contextmanager
def _live(out: _Unbuffered) -> Iterator[Any]:
    from rich.console import Console
    from rich.live import Live

    # What others print must not wait for this thread either.
    with Live(
        console=Console(file=cast("Any", out)), auto_refresh=False, transient=True, redirect_stdout=False,
        redirect_stderr=False,
    ) as live:  # fmt: skip
        yield live


class _Unbuffered:
    """Standard error without its buffer: a thread that waits within one keeps the whole program from ending."""

    def __init__(self) -> None:
        self.encoding = sys.stderr.encoding or "utf-8"
        try:
            self._file: int | None = sys.stderr.fileno()
        except (OSError, ValueError):
            self._file = None

    def write(self, text: str) -> int:
        """Write all of a text."""
        if self._file is None:
            return sys.stderr.write(text)
        left = text.encode(self.encoding, errors="replace")
        while left:
            left = left[os.write(self._file, left) :]
        return len(text)

    def flush(self) -> None:
        """Nothing is kept back."""

    def fileno(self) -> int:
        """Return the file's number."""
        if self._file is None:
            raise OSError("standard error is no file")
        return self._file

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self._file is not None and os.isatty(self._file)
