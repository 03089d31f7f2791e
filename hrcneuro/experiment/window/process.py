"""A window in a process of its own: drawing never delays the flow, and a window that hangs or dies stops no arm."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import select
import signal
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import ConfigError, HardwareError, HrcError
from hrcneuro.experiment.messages import Closed, Focus, Key, Scene
from hrcneuro.experiment.parameters import WindowOptions
from hrcneuro.experiment.window.requests import Calibrating, Leave, Opened, Saved, Screenshot

Event = Key | Closed | Focus

_OPENS_S = 30.0
_SAVES_S = 10.0
_LEAVES_S = 2.0


class Window:
    """A window on the person's screen; a context manager.

    Attributes:
        connection: Becomes readable when :meth:`events` has something; for ``multiprocessing.connection.wait``. After
            ``Closed`` it stays readable: wait for it no longer.
        opened: Which screen, how large its pixels are, and where that is from.
    """

    def __init__(self, options: WindowOptions, calibrating: Callable[[], None] = lambda: None) -> None:
        """Open it, and wait until it is there.

        Args:
            options: Which screen, how large.
            calibrating: Called where a person must hold a bank card to the screen first: say so.

        Raises:
            HardwareError: pygame-ce is not installed; there is no such screen, or it is smaller than the grid.
            ConfigError: The font cannot be read.
        """
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._process = context.Process(target=_main, args=(theirs, options), name="window", daemon=True)
        self._waiting: list[Event] = []
        self._gone = False
        self._process.start()
        theirs.close()
        try:
            self.opened = self._await_opened(calibrating)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Window:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the window's process."""
        return self._process.pid

    def show(self, scene: Scene) -> None:
        """Show a scene; where several come at once, the newest. A window that is closed shows nothing."""
        self._send(scene)

    def events(self) -> list[Event]:
        """Return what has come since the last call, oldest first, without waiting.

        The last one ever is :class:`~hrcneuro.experiment.messages.Closed`, with a problem where the process died.
        """
        while not self._gone and self.connection.poll():
            message = self._receive()
            if not isinstance(message, Saved):
                self._waiting.append(message)
        events, self._waiting = self._waiting, []
        return events

    def screenshot(self, path: Path) -> None:
        """Write what is on the screen into a picture file, once the scenes sent before are on it.

        Keys that come meanwhile are kept for the next call of :meth:`events`.

        Raises:
            HardwareError: The window is closed, or does not answer.
            ConfigError: The file cannot be written.
        """
        self._send(Screenshot(str(path)))
        until = seconds() + _SAVES_S
        while not self._gone and self.connection.poll(max(0.0, until - seconds())):
            message = self._receive()
            if isinstance(message, Saved):
                if message.problem:
                    raise ConfigError(
                        f"{path}: {message.problem}", cure="check the folder, and the ending, such as .png"
                    )
                return
            self._waiting.append(message)
        raise HardwareError("the window gave no picture of itself", cure="see whether it was closed")

    def close(self) -> None:
        """Close the window, and wait until its process has ended."""
        self._send(Leave())
        self._process.join(_LEAVES_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._gone = True
        self.connection.close()

    def _await_opened(self, calibrating: Callable[[], None]) -> Opened:
        until: float | None = seconds() + _OPENS_S
        while self.connection.poll(None if until is None else max(0.0, until - seconds())):
            message = self._receive()
            if isinstance(message, Calibrating):
                calibrating()
                until = None
            elif isinstance(message, HrcError):
                raise message
            elif isinstance(message, Closed):
                raise HardwareError(message.problem, cure=message.cure)
            else:
                return message
        raise HardwareError(
            f"the window's process has not opened a window within {_OPENS_S:g} s",
            cure="see whether the window system answers: open any other window on the same screen",
        )

    def _receive(self) -> Any:
        """Return the next message; where the process has gone, that it is closed, once."""
        try:
            message = self.connection.recv()
        except (EOFError, OSError):
            self._process.join(_LEAVES_S)
            message = Closed(
                f"the window's process has ended by itself ({_end(self._process.exitcode)})",
                "see that the screen and the window system are still there, then begin again",
            )
        if isinstance(message, Closed):
            self._gone = True
        return message

    def _send(self, message: Any) -> None:
        # A window that hangs reads nothing: once the pipe is full, what is sent is lost, and nobody waits for it.
        if not self._gone and select.select((), (self.connection,), (), 0.0)[1]:
            with contextlib.suppress(OSError):
                self.connection.send(message)


def _end(code: int | None) -> str:
    if code is None:
        return "it hangs"
    if code >= 0:
        return f"exit code {code}"
    return f"killed by {signal.Signals(-code).name}"


def _main(link: Connection, options: WindowOptions) -> None:
    # Ctrl-C is for the flow, which brings the arm to rest first and shows on the screen that it does.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    code = 0
    try:
        from hrcneuro.experiment.window import library

        library.prepare()
        from hrcneuro.experiment.window import loop

        loop.serve(link, options, parent.sentinel if parent else None)
    except HrcError as error:
        code = error.exit_code
        with contextlib.suppress(OSError):
            link.send(error)
    except Exception as error:
        code = 1
        traceback.print_exc()
        with contextlib.suppress(OSError):
            link.send(
                Closed(
                    f"the window's process failed: {type(error).__name__}: {error}", "report it, with the lines above"
                )
            )
    finally:
        link.close()
        # The reading thread may still wait for a scene.
        os._exit(code)
