"""URScript's functions for conveyors: two encoders that count, and tracking.

Nothing turns an encoder here but ``encoder_set_tick_count``; its counts can be read and unwound as on the robot. No
conveyor carries anything: tracking is taken and checked, and the arm does not follow.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

from hrcneuro.ur10.memory import Encoder
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.library import text
from hrcneuro.ur10.urscript.runtime import Pose
from hrcneuro.ur10.urscript.values import Values, index

_DECODERS = 5  # none, quadrature, both edges, rising, falling
_QUADRATURE = 1
_PINS = 4  # of the box's digital inputs that can count
_PULSES = (0, 1 << 16)  # what decoded pulses count up to
# The lowest count, and how many there are: 32 bits signed, then 8, 16, 24 and 32 bits unsigned.
_RANGES = ((-(1 << 31), 1 << 32), (0, 1 << 8), (0, 1 << 16), (0, 1 << 24), (0, 1 << 32))


def conveyor(encoders: list[Encoder]) -> dict[str, Callable[..., Any]]:
    """Return the functions by their names in a script."""
    return {**_encoders(encoders), **_of_old(encoders), **_tracking(encoders)}


def _encoders(encoders: list[Encoder]) -> dict[str, Callable[..., Any]]:
    def encoder_enable_pulse_decode(encoder_index: int, decoder_type: int, A: int, B: int = 0) -> None:
        encoder = encoders[index(encoder_index, len(encoders))]
        index(A, _PINS)
        if index(decoder_type, _DECODERS) == _QUADRATURE:
            index(B, _PINS)
        encoder.lowest, encoder.counts = _PULSES if decoder_type else (0, 0)
        encoder.ticks = 0

    def encoder_enable_set_tick_count(encoder_index: int, range_id: int) -> None:
        encoder = encoders[index(encoder_index, len(encoders))]
        encoder.lowest, encoder.counts = _RANGES[index(range_id, len(_RANGES))]
        encoder.ticks = 0

    def encoder_set_tick_count(encoder_index: int, count: int) -> None:
        encoder = encoders[index(encoder_index, len(encoders))]
        if not encoder.counts:
            raise ScriptError(
                f"runtime error: encoder {encoder_index} is not enabled: encoder_enable_set_tick_count does that"
            )
        encoder.ticks = _tick(count, encoder.lowest, encoder.counts)

    def encoder_get_tick_count(encoder_index: int) -> float:
        return float(encoders[index(encoder_index, len(encoders))].ticks)

    def encoder_unwind_delta_tick_count(encoder_index: int, delta_tick_count: float) -> float:
        counts = encoders[index(encoder_index, len(encoders))].counts
        delta = _finite(delta_tick_count, "a difference of ticks")
        if not counts:
            raise ScriptError(f"runtime error: encoder {encoder_index} is not enabled: its range is not known")
        if abs(delta) > counts / 2:
            delta -= counts if delta > 0.0 else -counts
        return delta

    return {
        function.__name__: function
        for function in (
            encoder_enable_pulse_decode,
            encoder_enable_set_tick_count,
            encoder_set_tick_count,
            encoder_get_tick_count,
            encoder_unwind_delta_tick_count,
        )
    }


def _of_old(encoders: list[Encoder]) -> dict[str, Callable[..., Any]]:
    # From before there were two: they mean the first.
    new = _encoders(encoders)

    def set_conveyor_tick_count(tick_count: int, absolute_encoder_resolution: int = 0) -> None:
        new["encoder_enable_set_tick_count"](0, absolute_encoder_resolution)
        new["encoder_set_tick_count"](0, tick_count)

    return {
        "conveyor_pulse_decode": lambda type, A, B=0: new["encoder_enable_pulse_decode"](0, type, A, B),
        "get_conveyor_tick_count": lambda: new["encoder_get_tick_count"](0),
        "set_conveyor_tick_count": set_conveyor_tick_count,
    }


def _tracking(encoders: list[Encoder]) -> dict[str, Callable[..., Any]]:
    def track_conveyor_linear(direction: Pose, ticks_per_meter: float, encoder_index: int = 0) -> None:
        _check_track(direction, ticks_per_meter)
        index(encoder_index, len(encoders))

    def track_conveyor_circular(
        center: Pose, ticks_per_revolution: float, rotate_tool: bool = False, encoder_index: int = 0
    ) -> None:
        _check_track(center, ticks_per_revolution)
        Values.boolean(rotate_tool)
        index(encoder_index, len(encoders))

    return {"track_conveyor_linear": track_conveyor_linear, "track_conveyor_circular": track_conveyor_circular}


def _check_track(pose: Any, ticks: Any) -> None:
    if not isinstance(pose, Pose):
        raise ScriptError(f"runtime error: a conveyor's direction or centre is a pose, not {text(pose)[:80]}")
    if _finite(ticks, "a number of ticks") == 0.0:
        raise ScriptError("runtime error: a conveyor has other than 0 ticks per metre or revolution")


def _tick(count: Any, lowest: int, counts: int) -> int:
    if isinstance(count, bool) or not isinstance(count, (int, float)) or count != count // 1:
        raise ScriptError(f"runtime error: a tick count is an integer, not {text(count)[:80]}")
    if not lowest <= count < lowest + counts:
        raise ScriptError(f"runtime error: no tick count {text(count)}: {lowest} … {lowest + counts - 1} are in range")
    return int(count)


def _finite(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not isfinite(value):
        raise ScriptError(f"runtime error: {what} is a number, not {text(value)[:80]}")
    return float(value)
