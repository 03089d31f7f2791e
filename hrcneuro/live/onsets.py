"""Who is told of each motion's onset: a trigger port, the markers' stream, and a simulated person beside the robot."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.live.lsl import LslOutlet
from hrcneuro.live.markers import MarkerOutlet
from hrcneuro.live.transport import TRUTH
from hrcneuro.live.triggers import TriggerOptions, TriggerPort

OnOnset = Callable[[Callable[[], float], int], None]
"""Is called with how long ago an onset was, seconds, and the number of the move."""
_AT_FIRST_S = 1.0


def trigger(
    options: TriggerOptions,
    stack: contextlib.ExitStack,
    *,
    failed: Callable[[HardwareError], object],
    codes: Sequence[int] | None = None,
) -> OnOnset:
    """Return what lets a code stand on a port at each onset.

    Args:
        options: Which port.
        stack: Closes the port.
        failed: Is told once, in another thread, that a code did not go out.
        codes: One a move, which may grow; none: ``options.move_code`` for all.

    Raises:
        HardwareError: The port cannot be opened.
    """
    port = stack.enter_context(TriggerPort(options, time.perf_counter, failed=failed))
    if codes is None:
        return lambda age, move: port.signal(options.move_code)
    return lambda age, move: port.signal(codes[move])


class Markers:
    """The markers' stream: of onsets, and of what is no motion."""

    def __init__(self, source: str, wait_s: float, stack: contextlib.ExitStack) -> None:
        """Open it.

        Args:
            source: By which a recorder finds the stream again.
            wait_s: So long somebody is waited for who listens, seconds; 0 for not at all.
            stack: Closes the stream.

        Raises:
            HardwareError: Nobody listens, or mne-lsl is absent.
        """
        self._outlet = stack.enter_context(MarkerOutlet(source))
        if wait_s:
            self._outlet.wait(wait_s)

    def at_onsets(self, texts: Sequence[str], stamps: MutableMapping[int, float]) -> OnOnset:
        """Return what sends a marker of each onset.

        Args:
            texts: One a move; may grow.
            stamps: Takes each marker's stamp, by move, seconds of LSL's clock.
        """

        def mark(age: Callable[[], float], move: int) -> None:
            stamps[move] = self._outlet.send(texts[move], age)

        return mark

    def send(self, text: str, age: Callable[[], float]) -> float:
        """Send a marker of what was ``age()`` seconds ago; return its stamp, seconds of LSL's clock."""
        return self._outlet.send(text, age)


class Truths:
    """The stream that tells a simulated person's amplifier what comes."""

    def __init__(self, source: str, stack: contextlib.ExitStack) -> None:
        """Open it, and wait until an amplifier that is there has found it.

        Args:
            source: By which the stream is found again.
            stack: Closes the stream.

        Raises:
            HardwareError: mne-lsl is absent.
        """
        self._outlet = LslOutlet(TRUTH, "Markers", ["truth"], sfreq=0, source_id=source)
        stack.callback(self._outlet.close)
        # LSL keeps nothing for those who come later; the amplifier looks for it twice a second.
        time.sleep(_AT_FIRST_S)

    def send(self, move: Mapping[str, Any], *, key_in_s: float | None = None) -> None:
        """Tell of a move.

        Args:
            move: ``marker``, and what :mod:`hrcneuro.live.person` asks of it.
            key_in_s: In how many seconds the person's own motion begins, where that is known.
        """
        now = self._outlet.clock()
        timed = {} if key_in_s is None else {"key_s": now + key_in_s}
        self._outlet.send(json.dumps({**move, **timed}), now)


def truth(
    source: str, moves: Sequence[Mapping[str, Any]], gaps: Sequence[float], stack: contextlib.ExitStack
) -> OnOnset:
    """Return what tells a simulated person's amplifier of each next move, at the onset of the one before.

    Args:
        source: By which the stream is found again.
        moves: One a move: ``marker``, and what :mod:`hrcneuro.live.person` asks of it.
        gaps: From each onset to the next, seconds; NaN where that is not known ahead.
        stack: Closes the stream.

    Raises:
        HardwareError: mne-lsl is absent.
    """
    truths = Truths(source, stack)
    truths.send(moves[0])

    def tell(age: Callable[[], float], move: int) -> None:
        if move + 1 >= len(moves):
            return
        after = moves[move + 1]
        known = after.get("actor") == "human" and math.isfinite(gaps[move])
        truths.send(after, key_in_s=gaps[move] - age() if known else None)

    return tell
