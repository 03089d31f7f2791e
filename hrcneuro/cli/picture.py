"""A picture on the terminal, drawn anew in its place, of something that goes on; without a terminal, lines."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from hrcneuro.cli.console import Console

if TYPE_CHECKING:
    from rich.console import RenderableType


class Picture:
    """A context manager; leaving it takes the picture away."""

    def __init__(self, talk: Console) -> None:
        self._talk = talk
        self._live: Any = None

    def __enter__(self) -> Picture:
        if self._talk.shows_progress:
            from rich.console import Console as RichConsole
            from rich.live import Live

            self._live = Live(console=RichConsole(stderr=True), auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    @property
    def shown(self) -> bool:
        """Whether there is a terminal, and no fault has ended it."""
        return self._live is not None

    def say(self, text: str, *, bell: bool = False) -> None:
        """Say at once what stands out, above the picture; ``bell``: with the terminal's."""
        if self._live is None:
            self._talk.say(text, style="bold red")
            return
        if bell:
            self._live.console.bell()
        self._live.console.print(text, style="bold red", highlight=False, markup=False)

    def draw(self, make: Callable[[], RenderableType | None], *, what: str, then: str) -> None:
        """Draw what ``make`` returns, if anything. A fault ends the picture, and never what it shows.

        Args:
            make: Returns the picture.
            what, then: What is left out after a fault, and what goes on, for the message.
        """
        if self._live is None:
            return
        try:
            picture = make()
            if picture is not None:
                self._live.update(picture, refresh=True)
        except Exception as error:
            self._live.stop()
            self._live = None
            self._talk.say(f"{what} is left out from here on ({type(error).__name__}: {error}); {then} goes on")
