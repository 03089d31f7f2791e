"""Ehrlich & Cheng's game played by simulation: the robot's policy, a partner who guesses, a decoder that errs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hrcneuro.learning.gaze import STATES, TRIALS, DecoderRates, uniform, update
from hrcneuro.learning.gaze_counts import looks
from hrcneuro.learning.gaze_partner import Partner, adapted, guess_probabilities


def play(
    decoders: Sequence[DecoderRates],
    partners: Sequence[Partner],
    transitions: np.ndarray,
    *,
    repetitions: int,
    rng: np.random.Generator,
    trials: int = TRIALS,
) -> np.ndarray:
    """Return whether each guess is right: ndarray, shape (n_games, n_repetitions, n_trials), bool.

    Games differ in decoder and partner; all hear the same draws, so that they can be compared.

    Args:
        decoders: The decoder of each game.
        partners: The partner of each game, as many.
        transitions: ndarray, shape (n,), int: lengths of trials, one of which each trial takes.
        repetitions: Sessions a game.
        rng: Of every draw.
        trials: Trials a session.
    """
    shape = (len(decoders), repetitions)
    policy = np.broadcast_to(uniform(), (*shape, STATES, STATES)).copy()
    weight, spread, rate = (np.array([getattr(p, n) for p in partners])[:, None] for n in ("weight", "spread", "rate"))
    # Every repetition is a session with another person.
    weights = weight + spread * rng.standard_normal(repetitions)
    tnr, tpr = (np.array([getattr(d, name) for d in decoders])[:, None] for name in ("tnr", "tpr"))
    right = np.empty((*shape, trials), bool)
    for trial in range(trials):
        length = rng.choice(transitions, size=repetitions)
        counts = _walk(policy, length, rng)
        seen = looks(counts)
        p = guess_probabilities(weights, seen)[..., 0]
        guessed = right[..., trial] = rng.random(repetitions) < p
        said_error = rng.random(repetitions) < np.where(guessed, 1 - tnr, tpr)
        weights = adapted(weights, seen, rate)
        policy = update(policy, counts, said_error)
    return right


def _walk(policy: np.ndarray, length: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the transitions of one trial each: ndarray like ``policy``, (n_games, n_repetitions, 4, 4), int.

    Where the gaze begins is not logged: anywhere.
    """
    games, repetitions = policy.shape[:2]
    # The longest first: those that still walk are then the first ones.
    order = np.argsort(-length, kind="stable")
    cumulative = policy[:, order].cumsum(axis=-1)
    at = np.broadcast_to(rng.integers(STATES, size=repetitions), (games, repetitions)).copy()
    counts = np.zeros(policy.shape, int)
    for walking in (length[None] > np.arange(length.max())[:, None]).sum(axis=1):
        game, repetition = np.ogrid[:games, :walking]
        here = at[:, :walking]
        draw = rng.random(walking)[:, None]
        to = (draw >= cumulative[game, repetition, here]).sum(axis=-1).clip(max=STATES - 1)
        counts[game, order[:walking], here, to] += 1
        at[:, :walking] = to
    return counts
