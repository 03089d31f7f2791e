"""Learners compared on the same draws: paired differences with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.learning.learner import learn
from hrcneuro.learning.learners import Kind
from hrcneuro.learning.simulations import Z95, Variant, blocks

_COLUMNS = 500  # the log-odds of so many repetitions stay below 50 MB


@dataclass(frozen=True)
class Comparison:
    """What each learner reached in each variant.

    Attributes:
        learners: Names; the first is the reference.
        measures: Names of the measures; ``mean`` is the average over all episodes.
        values: ndarray, shape (n_variants, n_learners, n_measures, n_repetitions): choice accuracy.
        greedy: The same for the share of subtasks whose better-valued action is correct.
        curves: ndarray, shape (n_variants, n_learners, n_episodes): mean choice accuracy.
    """

    learners: tuple[str, ...]
    measures: tuple[str, ...]
    values: np.ndarray
    greedy: np.ndarray
    curves: np.ndarray


def compare(
    variants: Sequence[Variant],
    learners: Mapping[str, Kind],
    *,
    repetitions: int,
    seed: int,
    tau: float,
    episodes: Sequence[int] = (35, 100, 200),
) -> Comparison:
    """Return every learner's accuracy on the same episodes, assignments and decoder answers."""
    length = variants[0].task.episodes
    shown = [e for e in episodes if e <= length] or [length]
    measures = ("mean", *(f"episode {e}" for e in shown))
    shape = (len(variants), len(learners), len(measures), repetitions)
    values, greedy = np.empty(shape), np.empty(shape)
    curves = np.zeros((len(variants), len(learners), length))
    done = np.zeros(len(variants), int)
    for work in blocks(variants, repetitions=repetitions, seed=seed, evidence=True, columns=_COLUMNS):
        before = done.copy()
        for at, kind in enumerate(learners.values()):
            soft, hard = learn(
                kind.make,
                [b.draws for b in work],
                [b.answers.predicted for b in work],
                tau=tau,
                evidence=[b.answers.log_odds(kind.evidence) for b in work],
            )
            done[:], start = before, 0
            for block in work:
                v, n = block.variant, block.draws.repetitions
                part, into = slice(start, start := start + n), slice(done[v], done[v] + n)
                for reached, store in ((soft, values), (hard, greedy)):
                    store[v, at, 0, into] = reached[:, part].mean(axis=0)
                    for i, episode in enumerate(shown, 1):
                        store[v, at, i, into] = reached[episode - 1, part]
                curves[v, at] += soft[:, part].sum(axis=1) / repetitions
                done[v] += n
    return Comparison(tuple(learners), measures, values, greedy, curves)


def paired(values: np.ndarray, reference: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return each learner's mean difference from a reference on the same draws, and half its 95 % interval.

    Args:
        values: ndarray, shape (n_variants, n_learners, n_measures, n_repetitions).
        reference: Index of the learner to compare with.

    Returns:
        Two arrays of shape (n_variants, n_learners, n_measures).
    """
    difference = values - values[:, reference : reference + 1]
    n = values.shape[-1]
    return difference.mean(axis=-1), Z95 * difference.std(axis=-1, ddof=1) / np.sqrt(n)
