"""Who is told of each motion's onset: a trigger port, the markers' stream, and a simulated person beside the robot."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import Any

from hrcneuro.live.lsl import LslOutlet
from hrcneuro.live.markers import MarkerOutlet
from hrcneuro.live.transport import TRUTH
from hrcneuro.live.triggers import TriggerOptions, TriggerPort

OnOnset = Callable[[Callable[[], float], int], None]
"""Is called with how long ago an onset was, seconds, and the number of the move."""
_AT_FIRST_S = 1.0


def trigger(options: TriggerOptions, stack: contextlib.ExitStack) -> OnOnset:
    """Return what lets a code stand on a port at each onset.

    Raises:
        HardwareError: The port cannot be opened.
    """
    port = stack.enter_context(TriggerPort(options, time.perf_counter))
    return lambda age, move: port.signal(options.move_code)


def marker(
    source: str, texts: Sequence[str], stamps: MutableMapping[int, float], wait_s: float, stack: contextlib.ExitStack
) -> OnOnset:
    """Return what sends a marker of each onset over LSL.

    Args:
        source: By which a recorder finds the stream again.
        texts: One a move.
        stamps: Takes each marker's stamp, by move, seconds of LSL's clock.
        wait_s: So long somebody is waited for who listens; 0 for not at all.
        stack: Closes the stream.

    Raises:
        HardwareError: Nobody listens, or mne-lsl is absent.
    """
    outlet = stack.enter_context(MarkerOutlet(source))
    if wait_s:
        outlet.wait(wait_s)

    def mark(age: Callable[[], float], move: int) -> None:
        stamps[move] = outlet.send(texts[move], age)

    return mark


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
    outlet = LslOutlet(TRUTH, "Markers", ["truth"], sfreq=0, source_id=source)
    stack.callback(outlet.close)
    # LSL keeps nothing for those who come later; the amplifier looks for it twice a second.
    time.sleep(_AT_FIRST_S)
    outlet.send(json.dumps(moves[0]), outlet.clock())

    def tell(age: Callable[[], float], move: int) -> None:
        if move + 1 >= len(moves):
            return
        then = dict(moves[move + 1])
        if then.get("actor") == "human" and math.isfinite(gaps[move]):
            then["key_s"] = outlet.clock() - age() + gaps[move]
        outlet.send(json.dumps(then), outlet.clock())

    return tell
