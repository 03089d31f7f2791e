"""The two partners: the robot with its fixed choice on a diagonal, and a human who takes errors back and may slip.

Beyond the rules that bind both, the logs show habits of the human. After an error that made the target a diagonal, 83 %
of the keys take the error back (29 to 98 % by subject); else either component is as likely. In sC it is 90 % where the
other way leads into the robot's area, 69 % where the way back does.

Wrong keys come in runs, and the runs in a few episodes, which are the longest (up to 72 moves). The first of an episode
comes at 0.9 % of the keys that could be wrong, never with the first key of 1031; a later run begins at 11 %. A wrong
key is pressed again 38 % of the time, after two 45, after three 65, after six or more 76 %, but at the grid's edge,
where it does nothing, at 2 turns of 19.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from hrcneuro.paradigm.grid import OPPOSITE, Tile, beyond, inside
from hrcneuro.paradigm.owners import Areas, Owners, allowed, wrong_keys

ROBOT_CHOICE = {"NE": "N", "NW": "N", "SE": "E", "SW": "S"}
"""Where the robot goes on a diagonal target that is all its own."""

_FIRST = 0.4  # the chance of an episode's first wrong key, as a share of the rate: 0.0085 / 0.0221 in the logs


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

    ``wrong_key``: a key is outside the target direction, over the session, as far as the usual run and relapse give
    that share. These do not grow with it: 0.01, 0.022, 0.05, 0.1, 0.2, 0.3 come out as 0.010, 0.020, 0.043, 0.084,
    0.14, 0.23 (means of 40 sessions). ``repeat``: a wrong key is pressed again,
    the likelier the longer its run, as if each run had its own probability, from a beta distribution with mean
    ``repeat`` and a + b = ``persistence``; never off the grid. ``relapse``: a new run begins in an episode that has had
    one.
    ``undo``: an error is taken back where that is one of the target's components; its odds are multiplied by ``stay``
    where only the way back keeps to the human's own area, divided where only the other way does.
    """

    wrong_key: float = 0.022
    repeat: float = 0.35
    persistence: float = 4.0
    relapse: float = 0.11
    undo: float = 0.80
    stay: float = 2.2

    def press(self, owners: Owners, target: str, before: Sequence[Move], *, rng: np.random.Generator) -> str:
        """Return the key pressed, as a direction, after the moves ``before`` of the episode.

        In iC only the human's own keys work, so a diagonal of two owned directions leaves no wrong key.
        """
        slips = wrong_keys(owners, target) if before else []
        if slips:
            keys = [move for move in before if move.actor == "human"]
            if keys and self._goes_on(keys, slips, _tile(before), rng):
                return keys[-1].intended
            # A human who always slips must come out as one, too.
            first = self.wrong_key * (_FIRST + (1 - _FIRST) * self.wrong_key)
            lost = any(move.key_wrong for move in keys)
            if rng.random() < (max(self.relapse, first) if lost else first):
                return slips[rng.integers(len(slips))]
        back = OPPOSITE.get(before[-1].executed or "", "") if before and before[-1].error else ""
        if len(target) == 1:
            return target
        if not back or back not in target:
            return target[rng.integers(2)]
        onward = target.replace(back, "")
        favour = self.stay ** (_keeps(owners, _tile(before), back) - _keeps(owners, _tile(before), onward))
        return back if rng.random() < self.undo * favour / (self.undo * favour + 1 - self.undo) else onward

    def _goes_on(self, keys: list[Move], slips: list[str], tile: Tile, rng: np.random.Generator) -> bool:
        last = keys[-1].intended
        # An error may have made the key right for a turn: that does not end the run.
        run = sum(move.key_wrong for move in takewhile(lambda move: move.intended == last, reversed(keys)))
        if not run or last not in slips or not inside(beyond(tile, last)):
            return False
        return bool(rng.random() < (self.repeat * self.persistence + run - 1) / (self.persistence + run - 1))


def _tile(before: Sequence[Move]) -> Tile:
    return before[-1].row, before[-1].col


def _keeps(owners: Owners, tile: Tile, direction: str) -> bool:
    # In iC there is no area to keep.
    return isinstance(owners, Areas) and beyond(tile, direction) in owners.human


def draw_human(rng: np.random.Generator) -> Human:
    """Return a subject: ``wrong_key`` 0.1 to 7 %, on average 2.2 %, its own way with errors, spread as in the logs."""
    wrong_key = np.clip(rng.gamma(2.6, 0.022 / 2.6), 0.001, 0.07)
    return Human(wrong_key=float(wrong_key), undo=float(rng.beta(2.8, 0.7)))
