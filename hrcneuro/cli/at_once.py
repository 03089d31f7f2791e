"""Ctrl-C is answered at once, also while a numeric library has the main thread and Python's own handlers must wait."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator

from hrcneuro.interrupts import INTERRUPTS

_END = b"\0"


@contextlib.contextmanager
def answered(answer: Callable[[], None]) -> Iterator[None]:
    """Call ``answer`` when the first signal that ends a run comes; from a thread, as the main one may be deep in C.

    Outside the main thread, where Python delivers no signal, nothing happens.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    thread = threading.Thread(target=_wait, args=(reading, answer), daemon=True)
    thread.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        with contextlib.suppress(BlockingIOError):
            os.write(writing, _END)
        thread.join(1.0)
        os.close(writing)


def _wait(reading: int, answer: Callable[[], None]) -> None:
    said = False
    while (byte := os.read(reading, 1)) not in (_END, b""):
        if byte[0] in INTERRUPTS and not said:
            said = True
            answer()
    os.close(reading)
