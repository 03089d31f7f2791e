"""PolyScope's modes and states by their numbers ("RTDE guide", "Dashboard server, CB-series", Universal Robots)."""

from __future__ import annotations

from dataclasses import dataclass

POWER_OFF, POWER_ON, IDLE, RUNNING = 3, 4, 5, 7
NORMAL, PROTECTIVE, SAFEGUARD, EMERGENCY = 1, 3, 5, 7
STOPPED, PLAYING, PAUSED = 1, 2, 4
POSITION, TEACH = 0, 1  # what the joints follow: their targets, or a hand

_SAFETY_BITS = {NORMAL: 1 << 0, PROTECTIVE: 1 << 2, SAFEGUARD: 1 << 4, EMERGENCY: 1 << 6 | 1 << 7}
_STOPPED_BY_SAFETY = 1 << 10


@dataclass(frozen=True)
class Notice:
    """Something that the controller says: to its log, and on the primary interface.

    Kinds: ``text``, ``error``, ``popup``, ``exception`` (a program went wrong, at ``line`` and ``column``; ``code`` is
    the controller's own word), ``label`` and ``error`` (with its ``number``), ``started`` and ``stopped`` (a program,
    by name), ``safety`` (the mode is ``number``).
    """

    kind: str
    text: str = ""
    line: int = 0
    column: int = 0
    number: int = 0
    code: str = ""


def safety_bits(mode: int) -> int:
    """Return RTDE's safety_status_bits in a safety mode."""
    return _SAFETY_BITS[mode] if mode == NORMAL else _SAFETY_BITS[mode] | _STOPPED_BY_SAFETY
