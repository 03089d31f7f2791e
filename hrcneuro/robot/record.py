"""What the loop keeps of every cycle, and the same as arrays."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from struct import Struct

import numpy as np

from hrcneuro.robot.trajectory import MotionState

PHASES = ("home", "approach", "identify", "move", "rest", "stop")
HOME, APPROACH, IDENTIFY, MOVE, REST, STOP = range(len(PHASES))

COLUMNS = (
    *("time_s", "phase", "move", "safety_bits", "speed_scaling", "limit_bits"),
    *(f"q_{i}_rad" for i in range(1, 7)),
    *(f"qd_{i}_rad_s" for i in range(1, 7)),
    *(f"qd_command_{i}_rad_s" for i in range(1, 7)),
    *(f"reference_{axis}_m" for axis in "xyz"),
)
"""What a row of the recorder holds, in this order; ``phase`` is an index into :data:`PHASES`."""
_WIDTH = len(COLUMNS)
# To be extended by numbers, an array takes three times as long.
_PACK = Struct(f"{_WIDTH}d").pack


@dataclass(frozen=True)
class Telemetry:
    """Every cycle of a session: arrays over cycles; SI units, ``base`` frame."""

    time: np.ndarray  # (n,)
    phase: np.ndarray  # (n,), index into PHASES
    move: np.ndarray  # (n,), index of the move; −1 between moves
    safety: np.ndarray  # (n,), bits
    scaling: np.ndarray  # (n,)
    limits: np.ndarray  # (n,), bits of limits.py
    q: np.ndarray  # (n, 6), measured
    qd: np.ndarray  # (n, 6), measured
    command: np.ndarray  # (n, 6), joint velocities sent
    reference: np.ndarray  # (n, 3), where the tip should be; nan while homing and stopping


@dataclass(frozen=True)
class Track:
    """One path as it was followed: rows of the record, and times from the session's start, seconds."""

    first: int  # row of the first cycle
    last: int  # row after the last cycle
    start: float
    onset: float  # the first command that was not zero: t = 0 of the study's epochs; nan without one
    end: float
    marked: float = nan  # when its marker had gone out; nan without an onset
    motion: MotionState | None = None  # of the reference in the next cycle, where another path takes over without rest


class Recorder:
    """Collects rows of plain floats at well under 1 µs a cycle."""

    def __init__(self) -> None:
        self._rows = array("d")

    def __len__(self) -> int:
        return len(self._rows) // _WIDTH

    def add(self, head: tuple[float, ...], q: Sequence[float], qd: Sequence[float], command: Sequence[float],
            reference: Sequence[float]) -> None:  # fmt: skip
        """Keep one cycle; ``head`` is (time, phase, move, safety, scaling, limits)."""
        self._rows.frombytes(_PACK(*head, *q, *qd, *command, *reference))

    def rows(self, first: int) -> array[float]:
        """Return the cycles from ``first`` on, one after the other, :data:`COLUMNS` each."""
        # A copy: another thread may take it while the loop adds cycles.
        return self._rows[first * _WIDTH :]

    def telemetry(self, first: int = 0, last: int | None = None) -> Telemetry:
        """Return the cycles ``first`` … ``last`` (exclusive; the end where None)."""
        rows = np.array(self._rows[first * _WIDTH : len(self._rows) if last is None else last * _WIDTH])
        rows = rows.reshape(-1, _WIDTH)
        whole = [rows[:, i].astype(np.int64) for i in (1, 2, 3, 5)]
        return Telemetry(
            rows[:, 0], whole[0], whole[1], whole[2], rows[:, 4], whole[3],
            rows[:, 6:12], rows[:, 12:18], rows[:, 18:24], rows[:, 24:27],
        )  # fmt: skip
