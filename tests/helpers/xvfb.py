"""A screen in memory with keys that come from outside, as a keyboard's do: Xvfb and the X server's test extension."""

from __future__ import annotations

import contextlib
import ctypes
import ctypes.util
import os
import shutil
import subprocess
from collections.abc import Iterator

# Places on the keyboard (evdev's codes plus 8), whatever the layout says of them.
CODES = {"N": 111, "W": 113, "E": 114, "S": 116, "escape": 9, "other": 38, "enter": 36}


def absent() -> str:
    """Return why there can be no such screen here; empty where there can."""
    if not shutil.which("Xvfb"):
        return "Xvfb is not installed: apt-get install xvfb"
    if not ctypes.util.find_library("Xtst"):
        return "libXtst is not installed: apt-get install libxtst6"
    return ""


@contextlib.contextmanager
def screen(width: int = 1920, height: int = 1080, *others: tuple[int, int]) -> Iterator[str]:
    """Start an X server with one screen of so many pixels, or several; yield what DISPLAY must be."""
    sizes = enumerate([(width, height), *others])
    screens = [word for number, (w, h) in sizes for word in ("-screen", str(number), f"{w}x{h}x24")]
    ours, theirs = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(theirs), *screens, "-nolisten", "tcp"],
        pass_fds=(theirs,), stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(theirs)
    try:
        number = b""
        while not number.endswith(b"\n") and (more := os.read(ours, 16)):
            number += more
        assert number, "Xvfb did not start"
        yield f":{number.decode().strip()}"
    finally:
        os.close(ours)
        server.terminate()
        server.wait()


class Keyboard:
    """Presses keys on an X server."""

    def __init__(self, display: str) -> None:
        self._x = ctypes.CDLL(ctypes.util.find_library("X11"))
        self._test = ctypes.CDLL(ctypes.util.find_library("Xtst"))
        self._x.XOpenDisplay.restype = ctypes.c_void_p
        self._display = ctypes.c_void_p(self._x.XOpenDisplay(display.encode()))
        assert self._display

    def press(self, name: str, *, down: bool = True, up: bool = True) -> None:
        """Let a key go down, and up again."""
        for pressed in [True] * down + [False] * up:
            self._test.XTestFakeKeyEvent(self._display, CODES[name], int(pressed), ctypes.c_ulong(0))
        self._x.XFlush(self._display)

    def print_on(self, name: str, keysym: int) -> None:
        """Let a key mean something else from now on, as another layout does; for instance 0x61, the letter a."""
        code, symbols = CODES[name], (ctypes.c_ulong * 2)(keysym, keysym)
        self._x.XChangeKeyboardMapping(self._display, code, 2, symbols, 1)
        self._x.XSync(self._display, 0)

    def close(self) -> None:
        """Let go of the server."""
        self._x.XCloseDisplay(self._display)
