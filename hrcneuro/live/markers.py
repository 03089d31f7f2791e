"""Markers on the lab streaming layer (LSL), beside which a laboratory records its EEG."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.live.liblsl import library
from hrcneuro.live.transport import MOVES

_TRIES = 5
_AT_ONCE = 5e-5  # s
_SLICE = 0.2  # s


class MarkerOutlet:
    """An LSL stream of texts at irregular times; a context manager, so that leaving it closes the stream.

    Who finds it is a matter of liblsl's own configuration, which a laboratory keeps in the file that LSLAPICFG names.
    """

    def __init__(self, source: str) -> None:
        """Open the stream of a ``source``, by which a recorder finds it again after an interruption.

        Raises:
            HardwareError: mne-lsl is not installed, or its liblsl does not load.
        """
        lsl = library("markers go out through", instead='do without them: robot.markers = "none"')
        about = lsl.StreamInfo(MOVES, "Markers", 1, 0.0, "string", source)
        about.set_channel_names(["marker"])
        self._outlet: Any = lsl.StreamOutlet(about, chunk_size=1)
        self._clock = lsl.local_clock

    def __enter__(self) -> MarkerOutlet:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._outlet = None

    def wait(self, seconds: float) -> None:
        """Return once someone listens.

        Raises:
            HardwareError: Nobody does within ``seconds``.
        """
        # In slices: liblsl waits in one call, in which Python does not hear Ctrl-C.
        end = self._clock() + seconds
        while not self._outlet.wait_for_consumers(timeout=min(_SLICE, seconds)):
            if self._clock() >= end:
                raise HardwareError(
                    f"nobody listens to the marker stream {MOVES!r} after {seconds:g} s; nothing has moved",
                    cure="start the recorder and choose the stream; wait longer, or not at all: robot.recorder_wait_s",
                )

    def send(self, text: str, age: Callable[[], float]) -> float:
        """Send a marker of what was ``age()`` seconds ago; return its stamp, on LSL's clock, seconds."""
        # An age, not an instant: neither the offset of two clocks nor their drift needs to be known. Where the machine
        # turned to something else between reading the one and the other, they are read again.
        for _ in range(_TRIES):
            before, now, after = age(), float(self._clock()), age()
            if after - before < _AT_ONCE:
                break
        stamp = now - 0.5 * (before + after)
        self._outlet.push_sample([text], timestamp=stamp)
        return stamp
