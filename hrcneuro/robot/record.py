"""What the loop keeps of every cycle, and the same as arrays."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

PHASES = ("home", "approach", "identify", "move", "rest", "stop")
HOME, APPROACH, IDENTIFY, MOVE, REST, STOP = range(len(PHASES))

_WIDTH = 6 + 6 * 3 + 3


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


class Recorder:
    """Collects rows of plain floats at well under 2 µs a cycle."""

    def __init__(self) -> None:
        self._rows = array("d")

    def __len__(self) -> int:
        return len(self._rows) // _WIDTH

    def add(self, head: tuple[float, ...], q: Sequence[float], qd: Sequence[float], command: Sequence[float],
            reference: Sequence[float]) -> None:  # fmt: skip
        """Keep one cycle; ``head`` is (time, phase, move, safety, scaling, limits)."""
        self._rows.extend((*head, *q, *qd, *command, *reference))

    def telemetry(self, first: int = 0, last: int | None = None) -> Telemetry:
        """Return the cycles ``first`` … ``last`` (exclusive; the end where None)."""
        rows = np.array(self._rows[first * _WIDTH : len(self._rows) if last is None else last * _WIDTH])
        rows = rows.reshape(-1, _WIDTH)
        whole = [rows[:, i].astype(np.int64) for i in (1, 2, 3, 5)]
        return Telemetry(
            rows[:, 0], whole[0], whole[1], whole[2], rows[:, 4], whole[3],
            rows[:, 6:12], rows[:, 12:18], rows[:, 18:24], rows[:, 24:27],
        )  # fmt: skip
