"""The person who reads the robot's gaze: one who reads it the same way for ever, and one who learns to read it.

Both guess object k with p_k ∝ exp(w f_k), f_k being the share of the robot's looks at objects that went to it. People
differ: each has a weight w of her own, drawn from a normal distribution, with which each session begins. The fixed
partner keeps it. The adapting one sees after every trial which object it was, and moves her weight along the gradient
of that trial's log-likelihood: w ← w + η (f_chosen - Σ p_k f_k). A weight below 0 guesses what was looked at least.

It is the simplest model of learning of which the logs can tell (docs/evidence.md): one number more than the fixed one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from hrcneuro.learning.params import ADAPTING

_STEP = 0.25
WEIGHTS = np.arange(-20.0, 40.01, _STEP)
"""Weights that a person may begin with: beyond them guesses do not change."""
RATES = np.linspace(0.0, 1.0, 51)
"""Rates at which a weight may change."""
_NEVER = 1e-300  # the least likelihood, beside the likeliest weight's, that still has a logarithm
_FAR = 8  # rates to either side of one that is known to be near


@dataclass(frozen=True)
class Partner:
    """People who guess.

    Attributes:
        weight: How strongly the guess follows the looks when a session begins: the mean over people.
        spread: Its SD over people; 0 where all are alike.
        rate: How fast the weight changes, per trial; 0 for the fixed partner.
    """

    weight: float
    spread: float = 0.0
    rate: float = 0.0


def guess_probabilities(weights: np.ndarray, looks: np.ndarray) -> np.ndarray:
    """Return how likely each object is guessed, shape (..., 3), for weights (...) and shares of looks (..., 3)."""
    raised = weights[..., None] * looks
    likely = np.exp(raised - raised.max(axis=-1, keepdims=True))
    return likely / likely.sum(axis=-1, keepdims=True)


def adapted(weights: np.ndarray, looks: np.ndarray, rate: float | np.ndarray) -> np.ndarray:
    """Return the weights once the light has shown the object.

    Args:
        weights: ndarray, shape (...).
        looks: ndarray, shape (..., 3): shares of the looks, the chosen object's first.
        rate: Of a partner, or ndarray, shape (...).
    """
    expected = (guess_probabilities(weights, looks) * looks).sum(axis=-1)
    return weights + rate * (looks[..., 0] - expected)


@dataclass(frozen=True)
class Reading:
    """What people saw and guessed, in sessions of equal length.

    Attributes:
        people: Whose each session is.
        looks: ndarray, shape (n_sessions, n_trials, 3): shares of the looks, the chosen object's first.
        known: ndarray, shape (n_sessions, n_trials), bool: whether the trial's looks are known.
        right: ndarray, shape (n_sessions, n_trials), bool: whether the guess was right.
    """

    people: tuple[str, ...]
    looks: np.ndarray
    known: np.ndarray
    right: np.ndarray


@dataclass(frozen=True)
class Surface:
    """How likely each person's guesses are, whatever weight she begins with and however fast it changes.

    Attributes:
        people: Their names, sorted.
        log_likelihood: ndarray, shape (n_rates, n_weights, n_people), over :data:`RATES` and :data:`WEIGHTS`.
    """

    people: tuple[str, ...]
    log_likelihood: np.ndarray

    def without(self, person: str) -> Surface:
        """Return that of all others."""
        keep = np.array(self.people) != person
        return Surface(tuple(np.array(self.people)[keep].tolist()), self.log_likelihood[..., keep])

    def of(self, partner: Partner) -> dict[str, float]:
        """Return person -> log-likelihood of her guesses, over the weights that she may have."""
        found = self._over_weights(_index(partner.rate), partner.weight, partner.spread)
        return dict(zip(self.people, found.tolist(), strict=True))

    def fit(self, kind: str, *, alike: bool = False, near: Partner | None = None) -> Partner:
        """Return the partner under which the guesses are likeliest.

        Args:
            kind: ``fixed`` or ``adapting``.
            alike: Whether all people share one weight.
            near: A partner from whose rate that of the result is not far, such as the fit to one person more.
        """
        at = range(len(RATES)) if kind == ADAPTING else range(1)
        if near is not None and kind == ADAPTING:
            middle = _index(near.rate)
            at = range(max(0, middle - _FAR), min(len(RATES), middle + _FAR + 1))
        found = [self._best(rate, alike=alike, near=near) for rate in at]
        return max(found, key=lambda pair: pair[1])[0]

    def _best(self, rate: int, *, alike: bool, near: Partner | None) -> tuple[Partner, float]:
        """Return the likeliest partner with a rate, and the log-likelihood of all guesses."""
        if alike:
            total = self.log_likelihood[rate].sum(axis=1)
            return Partner(float(WEIGHTS[total.argmax()]), 0.0, float(RATES[rate])), float(total.max())
        best = minimize(
            lambda x: -self._over_weights(rate, x[0], abs(x[1])).sum(),
            (near.weight, near.spread) if near else (3.0, 2.0),
            method="Nelder-Mead",
            options={"xatol": 1e-2, "fatol": 1e-3},
        )
        return Partner(float(best.x[0]), abs(float(best.x[1])), float(RATES[rate])), -float(best.fun)

    def _over_weights(self, rate: int, weight: float, spread: float) -> np.ndarray:
        """Return the log-likelihood of each person's guesses, her weight drawn from a normal distribution."""
        own = self.log_likelihood[rate]
        if spread < _STEP / 2:
            return np.asarray(own[np.abs(WEIGHTS - weight).argmin()])
        mass = np.exp(-(((WEIGHTS - weight) / spread) ** 2) / 2)
        best = own.max(axis=0)
        return np.log(np.maximum(mass @ np.exp(own - best) / mass.sum(), _NEVER)) + best


def surface(reading: Reading) -> Surface:
    """Return how likely people's guesses are. A trial whose looks are not known says nothing, and changes no weight.

    Raises:
        ValueError: No trial's looks are known.
    """
    if not reading.known.any():
        raise ValueError("no trial's looks are known: a partner needs one at least")
    names = tuple(sorted(set(reading.people)))
    whose = np.array([names.index(name) for name in reading.people])
    sessions = np.stack([_of_sessions(reading, rate) for rate in RATES])
    return Surface(names, np.stack([sessions[..., whose == i].sum(axis=-1) for i in range(len(names))], axis=-1))


def _of_sessions(reading: Reading, rate: float) -> np.ndarray:
    """Return the log-likelihood of each session's guesses by its first weight: shape (n_weights, n_sessions)."""
    weights = np.repeat(WEIGHTS[:, None], len(reading.people), axis=1)
    total = np.zeros(weights.shape)
    for trial in range(reading.known.shape[1]):
        seen, known, right = reading.looks[:, trial], reading.known[:, trial], reading.right[:, trial]
        p = guess_probabilities(weights, seen)
        chosen = p[..., 0].clip(1e-12, 1 - 1e-12)
        total += np.where(known, np.log(np.where(right, chosen, 1 - chosen)), 0.0)
        if rate:
            weights = weights + np.where(known, rate * (seen[:, 0] - (p * seen).sum(axis=-1)), 0.0)
    return total


def _index(rate: float) -> int:
    return int(np.abs(RATES - rate).argmin())
