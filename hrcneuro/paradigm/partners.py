"""The two partners: the robot with its fixed choice on a diagonal, and a human who takes errors back and may slip.

Beyond the rules that bind both, the logs show four habits of the human. After an error that made the target a diagonal,
83 % of the keys take the error back (29 to 98 % by subject); else either component is as likely. In sC it is 90 % where
the other way leads into the robot's area, 69 % where the way back does. A wrong key is repeated at the human's next
turn half of the time. No episode's first key, of 1031, is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.paradigm.grid import OPPOSITE, Tile, beyond
from hrcneuro.paradigm.owners import Areas, Owners, allowed, wrong_keys

ROBOT_CHOICE = {"NE": "N", "NW": "N", "SE": "E", "SW": "S"}
"""Where the robot goes on a diagonal target that is all its own."""


@dataclass(frozen=True)
class Move:
    """One move as the log knows it; ``executed`` is None where the grid's edge stopped it."""

    trial: int
    actor: str
    intended: str
    executed: str | None
    target: str
    error: bool
    row: int
    col: int
    key_wrong: bool


def robot_plan(owners: Owners, target: str) -> str:
    """Return the direction that the robot intends: the target's only component it commands, or its fixed choice."""
    mine = allowed(owners, "robot").intersection(target)
    return ROBOT_CHOICE[target] if len(mine) == 2 else next(iter(mine))


@dataclass(frozen=True)
class Human:
    """A subject's habits, each a probability.

    ``wrong_key``: a key is outside the target direction, over the session. ``repeat``: the wrong key of the last turn
    is pressed again. ``undo``: an error is taken back where that is one of the target's components; its odds are
    multiplied by ``stay`` where only the way back keeps to the human's own area, divided where only the other way does.
    """

    wrong_key: float = 0.022
    repeat: float = 0.5
    undo: float = 0.80
    stay: float = 2.2

    def press(self, owners: Owners, target: str, before: Sequence[Move], *, rng: np.random.Generator) -> str:
        """Return the key pressed, as a direction, after the moves ``before`` of the episode.

        In iC only the human's own keys work, so a diagonal of two owned directions leaves no wrong key.
        """
        slips = wrong_keys(owners, target) if before else []
        if slips:
            last = next((move for move in reversed(before) if move.actor == "human"), None)
            if last is not None and last.key_wrong and last.intended in slips and rng.random() < self.repeat:
                return last.intended
            # Repeated slips count in the rate, so fewer of them begin.
            if rng.random() < self.wrong_key * (1 - self.repeat):
                return slips[rng.integers(len(slips))]
        back = OPPOSITE.get(before[-1].executed or "", "") if before and before[-1].error else ""
        if len(target) == 1:
            return target
        if not back or back not in target:
            return target[rng.integers(2)]
        onward = target.replace(back, "")
        tile = before[-1].row, before[-1].col
        favour = self.stay ** (_keeps(owners, tile, back) - _keeps(owners, tile, onward))
        return back if rng.random() < self.undo * favour / (self.undo * favour + 1 - self.undo) else onward


def _keeps(owners: Owners, tile: Tile, direction: str) -> bool:
    # In iC there is no area to keep.
    return isinstance(owners, Areas) and beyond(tile, direction) in owners.human


def draw_human(rng: np.random.Generator) -> Human:
    """Return a subject: 0.1 to 7 % wrong keys, on average 2.2 %, and its own way with errors, spread as in the logs."""
    wrong_key = np.clip(rng.gamma(2.6, 0.022 / 2.6), 0.001, 0.07)
    return Human(wrong_key=float(wrong_key), undo=float(rng.beta(2.8, 0.7)))
