"""Cross-validation: folds, balanced training sets, and the plain loop over them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Scorer = Callable[[np.ndarray], np.ndarray]
Trainer = Callable[[np.ndarray, np.ndarray], Scorer]

# Covariances with n − 1 need two trials a class in each training set, and one more to test on.
SMALLEST_CLASS = 3

ONE_EVENT_S = 0.1
"""The longest window of a mean over time: trials closer than this share samples in one and the same feature.

Covariances over the whole epoch share samples for longer, as all overlapping epochs do.
"""


@dataclass(frozen=True)
class Split:
    """One fold of one repeat: training trials (balanced, class 1 first; one may recur) and held-out ones."""

    repeat: int
    fold: int
    train: np.ndarray
    test: np.ndarray


def distinct(onsets_s: np.ndarray) -> np.ndarray:
    """Return which trials are events of their own: those that begin no less than ONE_EVENT_S after the last such.

    Trials nearer than that hold the same samples in the same features. With one in a training set and the other held
    out, noise decodes; counted as two, chance is taken for too narrow.

    Args:
        onsets_s: ndarray, shape (n_trials,), s, in any order; of equal onsets the first counts.
    """
    own = np.ones(len(onsets_s), bool)
    last = -np.inf
    for trial in np.argsort(onsets_s, kind="stable"):
        # A nanosecond of room: 10 Hz is not too fast.
        own[trial] = onsets_s[trial] - last >= ONE_EVENT_S - 1e-9
        last = onsets_s[trial] if own[trial] else last
    return own


def feasible_folds(labels: np.ndarray, wanted: int) -> int:
    """Return how many stratified folds the smaller class allows: ``wanted``, fewer, or 0 where none are possible."""
    smaller = int(min(np.count_nonzero(labels), np.count_nonzero(~labels)))
    return min(wanted, smaller) if smaller >= SMALLEST_CLASS else 0


def stratified_folds(labels: np.ndarray, n_folds: int, rng: np.random.Generator) -> np.ndarray:
    """Return the fold of each trial: shuffled, each class spread evenly, and so are the fold sizes.

    Plain random folds leave a class empty now and then; these do not while each class has a trial a fold.
    """
    folds = np.empty(len(labels), dtype=int)
    dealt = 0
    for members in (np.flatnonzero(~labels), np.flatnonzero(labels)):
        # The second class is dealt on from where the first ended, so that the left-over trials do not pile up.
        folds[rng.permutation(members)] = (dealt + np.arange(len(members))) % n_folds
        dealt += len(members)
    return folds


def balance(train: np.ndarray, labels: np.ndarray, how: str, rng: np.random.Generator) -> np.ndarray:
    """Return the training trials with both classes equally often, class 1 first.

    ``undersample`` draws the larger class down without replacement; ``oversample`` draws the smaller up with
    replacement; ``none`` keeps all.
    """
    first, second = train[~labels[train]], train[labels[train]]
    if how == "undersample":
        size = min(len(first), len(second))
        first, second = (np.sort(rng.permutation(c)[:size]) if len(c) > size else c for c in (first, second))
    elif how == "oversample":
        size = max(len(first), len(second))
        first, second = (np.sort(rng.choice(c, size)) if len(c) < size else c for c in (first, second))
    return np.concatenate([first, second])


def shuffled_splits(
    labels: np.ndarray, *, n_folds: int, n_repeats: int, how: str, rng: np.random.Generator
) -> list[Split]:
    """Return ``n_repeats`` × ``n_folds`` stratified, shuffled folds; each training set is balanced anew."""
    splits = []
    for repeat in range(n_repeats):
        folds = stratified_folds(labels, n_folds, rng)
        splits += [_split(labels, folds == fold, repeat, fold, how, rng) for fold in range(n_folds)]
    return splits


def block_splits(
    labels: np.ndarray, blocks: np.ndarray, *, n_repeats: int, how: str, rng: np.random.Generator
) -> list[Split]:
    """Return folds that leave out one block each, ``n_repeats`` times with new balanced training sets.

    Random folds flatter: ownership is fixed within a block, and neighbouring trials share samples. The list is empty
    where there are fewer than two blocks or where a training set would hold fewer than two trials of a class.
    """
    names = np.unique(blocks)
    splits = [
        _split(labels, blocks == name, repeat, fold, how, rng)
        for repeat in range(n_repeats)
        for fold, name in enumerate(names)
    ]
    enough = all(min(np.count_nonzero(labels[s.train]), np.count_nonzero(~labels[s.train])) >= 2 for s in splits)
    return splits if len(names) > 1 and enough else []


def cross_validate(rows: np.ndarray, labels: np.ndarray, splits: Sequence[Split], train: Trainer) -> list[np.ndarray]:
    """Return the scores of each split's held-out trials: the plain loop, the reference of :mod:`.fast`.

    Args:
        rows: ndarray, shape (n_trials, ...): one row a trial.
        labels: ndarray, shape (n_trials,), true for class 2.
        splits: The folds.
        train: Takes training rows and labels, returns the function that scores rows (positive: class 2).
    """
    return [train(rows[s.train], labels[s.train])(rows[s.test]) for s in splits]


def by_repeat(splits: Sequence[Split], scores: Sequence[np.ndarray], n_trials: int) -> np.ndarray:
    """Return the scores: ndarray, shape (n_repeats, n_trials); in each repeat every trial is held out once."""
    table = np.full((splits[-1].repeat + 1, n_trials), np.nan)
    for split, score in zip(splits, scores, strict=True):
        table[split.repeat, split.test] = score
    return table


def _split(
    labels: np.ndarray, held_out: np.ndarray, repeat: int, fold: int, how: str, rng: np.random.Generator
) -> Split:
    return Split(repeat, fold, balance(np.flatnonzero(~held_out), labels, how, rng), np.flatnonzero(held_out))
