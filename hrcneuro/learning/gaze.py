"""A robot whose gaze a person learns to read: the policy of Ehrlich & Cheng 2018 and its update.

The robot has chosen one of three objects and looks around by a policy of four states: 0 the chosen object, 1 and 2 the
others, 3 the person. The person guesses the object, a light shows it, and an error-related potential is decoded. After
every trial each transition of that trial becomes likelier where no error was decoded, and less likely where one was.

Reference: S. K. Ehrlich and G. Cheng, J. Neural Eng. 15 (2018) 066014, doi:10.1088/1741-2552/aae069. The numbers of
the truncation are not printed; they follow from the session logs, of which they explain every row (docs/evidence.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STATES = 4
OBJECTS = 3
CHANCE = 1 / OBJECTS
STEP = 0.1  # what one transition adds to its probability, or takes from it, before normalising
EDGE = 1e-12  # so near to 0 or 1 a sum of tenths is taken for it: which side it falls on is chance of the rounding
FLOOR = 1e-4  # what a probability becomes that a trial would bring to 0 or below; 1 - FLOOR where to 1 or above
TRIALS = 50
TAIL = 10  # trials at either end of a session over which right guesses are counted
UNSCORED_RUN = 3  # whose logs hold no guesses; why is not documented
PUBLISHED = frozenset((f"s{subject:02d}", run) for subject in range(3, 19) for run in range(1, 5))
"""Subject and run of the closed sessions that were published."""
SUCCESS = 8  # right guesses of the last ten: the fewest that are as far above chance as 80 % right choices of two


def uniform() -> np.ndarray:
    """Return the policy with which every session begins: ndarray, shape (4, 4), all 0.25."""
    return np.full((STATES, STATES), 1 / STATES)


def update(policy: np.ndarray, counts: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the policy after a trial.

    Args:
        policy: ndarray, shape (..., 4, 4): p(next state | state), rows sum to 1.
        counts: ndarray, shape (..., 4, 4): how often the trial had each transition.
        error: ndarray, shape (...), bool: whether an error was decoded.
    """
    sign = np.where(np.asarray(error), -1.0, 1.0)[..., None, None]
    moved = policy + sign * STEP * counts
    moved = np.where((counts > 0) & (moved <= EDGE), FLOOR, np.where(moved >= 1.0 - EDGE, 1.0 - FLOOR, moved))
    return moved / moved.sum(axis=-1, keepdims=True)


def replay(counts: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return the policies after each trial of a session that begins with the uniform one.

    Args:
        counts: ndarray, shape (n_trials, 4, 4).
        error: ndarray, shape (n_trials,), bool.
    """
    policies, policy = np.empty(counts.shape), uniform()
    for trial, (count, wrong) in enumerate(zip(counts, error, strict=True)):
        policies[trial] = policy = update(policy, count, wrong)
    return policies


@dataclass(frozen=True)
class GazeSession:
    """What the log of a closed session holds.

    Attributes:
        subject: As its file names it, ``s03``.
        run: 1 to 4.
        error: ndarray, shape (n_trials,), bool: whether the online decoder said ERROR.
        policies: ndarray, shape (n_trials, 4, 4): the policy after each trial.
        right: ndarray, shape (n_trials,), bool: whether the person's guess was right; None where it was not logged.
        transitions: ndarray, shape (n_trials,), int: gaze transitions of each trial; None where not logged.
    """

    subject: str
    run: int
    error: np.ndarray
    policies: np.ndarray
    right: np.ndarray | None
    transitions: np.ndarray | None

    @property
    def before(self) -> np.ndarray:
        """The policy before each trial: ndarray, shape (n_trials, 4, 4)."""
        return np.concatenate([uniform()[None], self.policies[:-1]])


@dataclass(frozen=True)
class DecoderRates:
    """How often a decoder of errors was right: an error is a wrong guess.

    Attributes:
        tnr: Share of the right guesses after which it said ``noError``; nan without any.
        tpr: Share of the wrong guesses after which it said ``ERROR``; nan without any.
    """

    tnr: float
    tpr: float

    @property
    def balanced(self) -> float:
        """The balanced accuracy."""
        return (self.tnr + self.tpr) / 2


def rates(right: np.ndarray, error: np.ndarray, *, prior: float = 0.0) -> DecoderRates:
    """Return how often a decoder was right.

    Args:
        right: ndarray, shape (n_trials,), bool: whether the guess was right.
        error: ndarray, shape (n_trials,), bool: whether the decoder said ERROR.
        prior: Trials of each outcome that are added to both classes: 0.5 keeps a share of few trials off 0 and 1.
    """
    with np.errstate(invalid="ignore"):
        tnr = np.divide((right & ~error).sum() + prior, right.sum() + 2 * prior)
        tpr = np.divide((~right & error).sum() + prior, (~right).sum() + 2 * prior)
    return DecoderRates(float(tnr), float(tpr))
