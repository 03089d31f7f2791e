"""The two partners: the robot's fixed choice on a diagonal, and a human who chooses freely and errs at times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrcneuro.paradigm.owners import Owners, allowed, wrong_keys

ROBOT_CHOICE = {"NE": "N", "NW": "N", "SE": "E", "SW": "S"}
"""Where the robot goes on a diagonal target that is all its own."""


def robot_plan(owners: Owners, target: str) -> str:
    """Return the direction that the robot intends: the target's only component it commands, or its fixed choice."""
    mine = allowed(owners, "robot").intersection(target)
    return ROBOT_CHOICE[target] if len(mine) == 2 else next(iter(mine))


@dataclass(frozen=True)
class Human:
    """How a subject presses keys.

    ``wrong_key`` is the probability of a key outside the target direction, ``vertical`` that of going north or south
    first on a diagonal target.
    """

    wrong_key: float
    vertical: float = 0.5

    def press(self, owners: Owners, target: str, *, first: bool, rng: np.random.Generator) -> str:
        """Return the key pressed, as a direction.

        In iC only the human's own keys work, so a diagonal of two owned directions leaves no wrong key. On an episode's
        first move the subject has had time to look: none of the 1031 logged first keys is wrong.
        """
        if rng.random() < self.wrong_key and not first:
            slips = wrong_keys(owners, target)
            if slips:
                return slips[rng.integers(len(slips))]
        if len(target) == 1:
            return target
        return target[0] if rng.random() < self.vertical else target[1]


def draw_wrong_key_rate(rng: np.random.Generator) -> float:
    """Return one subject's rate of wrong keys: between 0.1 and 7 %, on average 2.2 %, skewed as in the logs."""
    return float(np.clip(rng.gamma(2.6, 0.022 / 2.6), 0.001, 0.07))
