"""How a frozen decoder is found: balanced training sets, blocks held out in turn, scores turned into probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.decoding import crossval, decoders
from hrcneuro.decoding.crossval import Split
from hrcneuro.decoding.frozen_refusals import FewTrialsError
from hrcneuro.decoding.lda import discriminant

_LEAST = 2  # trials a class of a training set: covariances with n − 1 need them
_PARTS = 5  # of a recording of one block, in the place of blocks


@dataclass(frozen=True)
class Training:
    """The trials of a problem, in the order of the recording.

    Attributes:
        features: ndarray, shape (n_trials, n_features), µV.
        labels: ndarray, shape (n_trials,), bool, true for class 2 (takeover).
        held_out: ndarray, shape (n_trials,), int: trials of equal value are held out together, see :func:`held_out`.
        cells: ndarray, shape (n_trials,), int: within each value both classes train with equally many trials; all equal
            where no strata are matched.
    """

    features: np.ndarray
    labels: np.ndarray
    held_out: np.ndarray
    cells: np.ndarray


@dataclass(frozen=True)
class Calibrated:
    """What is found on one problem.

    Attributes:
        weights, bias: Of the decoder that is trained on all trials.
        slope, offset: Of log-odds = slope · score + offset, fitted to the held-out scores.
        scores: ndarray, shape (n_trials,): of decoders that have not seen the trial's block.
        probabilities: ndarray, shape (n_trials,): of class 2; slope and offset come from the other blocks, too.
    """

    weights: np.ndarray
    bias: float
    slope: float
    offset: float
    scores: np.ndarray
    probabilities: np.ndarray


def strata_cells(cues: Mapping[str, np.ndarray], n_trials: int) -> np.ndarray:
    """Return a number a trial that is equal for trials alike in all cues: ndarray, shape (n_trials,), int.

    Args:
        cues: Name -> ndarray, shape (n_trials,), bool.
        n_trials: How many trials there are; without a cue they are all alike.
    """
    cells = np.zeros(n_trials, int)
    for values in cues.values():
        cells = 2 * cells + np.asarray(values, int)
    return cells


def held_out(labels: np.ndarray, blocks: np.ndarray | None, cells: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return which trials are held out together, ndarray, shape (n_trials,), int, and whether they are the blocks.

    Where there are no two blocks, or where the trials outside a block would not do for training, the recording is cut
    into five equal parts in the order of its trials.

    Args:
        labels: ndarray, shape (n_trials,), true for class 2.
        blocks: ndarray, shape (n_trials,), int; None without.
        cells: As :class:`Training` has them.

    Raises:
        FewTrialsError: Not even that leaves enough to train on.
    """
    parts = np.arange(len(labels)) * _PARTS // max(len(labels), 1)
    for groups in (blocks, parts):
        if groups is not None and len(np.unique(groups)) > 1 and _trains(labels, groups, cells):
            return groups, groups is blocks
    n2 = int(np.count_nonzero(labels))
    raise FewTrialsError(
        f"{len(labels) - n2} trials of class 1 and {n2} of class 2{_in_cells(labels, cells)}; allowed: so many that "
        f"{_LEAST} a class are left to train on, whichever part of the recording is held out"
    )


def balanced(train: np.ndarray, labels: np.ndarray, cells: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return training trials with both classes equally often in every cell, class 1 first: the larger is drawn down."""
    drawn = [crossval.balance(train[cells[train] == cell], labels, "undersample", rng) for cell in np.unique(cells)]
    both = np.concatenate(drawn)
    return np.concatenate([both[~labels[both]], both[labels[both]]])


def calibrate(training: Training, *, shrinkage: float, draws: int, rng: np.random.Generator) -> Calibrated:
    """Return the decoder of a problem, and how it does on held-out blocks.

    The classes differ in size, and a decoder that is trained on unequal classes prefers the larger one. So the larger
    is drawn down ``draws`` times, and the decoder is the mean of what comes out: weights and biases are averaged, which
    for a linear score is the mean of the scores.

    Args:
        training: The problem's trials.
        shrinkage: λ of the regularised LDA (paper 2.5.4).
        draws: Balanced training sets that are drawn.
        rng: For the draws.
    """
    labels, cells = training.labels, training.cells
    # Each kind of draw has its own stream of random numbers: leaving one out changes no other.
    final_rng, fold_rng = rng.spawn(2)
    weights, bias = _mean_discriminant(training, np.arange(len(labels)), shrinkage, draws, final_rng)
    splits = [
        Split(draw, fold, balanced(np.flatnonzero(training.held_out != part), labels, cells, fold_rng),
              np.flatnonzero(training.held_out == part))
        for draw in range(draws)
        for fold, part in enumerate(np.unique(training.held_out))
    ]  # fmt: skip
    tables = decoders.rlda(training.features, shrinkage=shrinkage)(labels, splits)
    scores = crossval.by_repeat(splits, tables, len(labels)).mean(axis=0)
    slope, offset = platt(scores, labels, cells)
    return Calibrated(weights, bias, slope, offset, scores, _held_out_probabilities(scores, training))


def pairs(labels: np.ndarray, cells: np.ndarray) -> int:
    """Return how many trials of each class a balanced training set has, of these labels and cells."""
    here = [labels[cells == cell] for cell in np.unique(cells)]
    return sum(int(min(np.count_nonzero(one), np.count_nonzero(~one))) for one in here)


def evidence_weights(labels: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return what each trial weighs: ndarray, shape (n_trials,), of sum 1; within each cell both classes weigh alike.

    A cell weighs as much as it has pairs of trials of both classes: what a balanced training set holds of it. Where no
    cell has both, all trials count alike.
    """
    weights = np.zeros(len(labels))
    for cell in np.unique(cells):
        for label in (False, True):
            here = (cells == cell) & (labels == label)
            weights[here] = pairs(labels[cells == cell], cells[cells == cell]) / max(int(here.sum()), 1)
    return weights / weights.sum() if weights.any() else np.full(len(labels), 1 / max(len(labels), 1))


def platt(scores: np.ndarray, labels: np.ndarray, cells: np.ndarray, *, steps: int = 100) -> tuple[float, float]:
    """Return slope and offset of the log-odds of class 2 for a score, both classes weighing alike within each cell.

    Logistic regression on the score with Platt's targets, which are a little less than certain, so that classes that do
    not overlap at all still have a finite slope (Platt 1999, Advances in Large Margin Classifiers, pp. 61-74). A slope
    below zero would turn a decoder that failed around; it is 0, and all probabilities are one half.

    Args:
        scores: ndarray, shape (n_trials,), of trials that the decoder was not trained on.
        labels: ndarray, shape (n_trials,), true for class 2; both classes occur.
        cells: As :class:`Training` has them.
        steps: Newton steps at most.
    """
    n2 = int(np.count_nonzero(labels))
    n1 = len(labels) - n2
    spread = float(scores.std())
    if not spread > 0:
        return 0.0, 0.0
    target = np.where(labels, (n2 + 1) / (n2 + 2), 1 / (n1 + 2))
    weight = evidence_weights(labels, cells)
    x = np.column_stack([(scores - scores.mean()) / spread, np.ones(len(scores))])
    beta = np.zeros(2)
    for _ in range(steps):
        p = 1 / (1 + np.exp(-np.clip(x @ beta, -50, 50)))
        gradient = x.T @ (weight * (p - target))
        curvature = (x * (weight * p * (1 - p))[:, None]).T @ x + 1e-12 * np.eye(2)
        step = np.linalg.solve(curvature, gradient)
        # Newton's step from far away may be too long; log-odds do not move by more than 2 at a time.
        beta -= step * min(1.0, 2.0 / max(float(np.abs(step).max()), 1e-300))
        if float(np.abs(step).max()) < 1e-10:
            break
    slope = float(beta[0]) / spread
    if slope <= 0:
        return 0.0, 0.0
    return slope, float(beta[1]) - slope * float(scores.mean())


def log_loss(probabilities: np.ndarray, labels: np.ndarray, cells: np.ndarray) -> float:
    """Return the mean of −log₂ P(true class) in bits, weighed as in the fit: 1 where nothing is known.

    Args:
        probabilities: ndarray, shape (n_trials,), of class 2.
        labels: ndarray, shape (n_trials,), true for class 2.
        cells: As :class:`Training` has them.
    """
    right = np.clip(np.where(labels, probabilities, 1 - probabilities), 1e-12, 1)
    return float(-np.log2(right) @ evidence_weights(labels, cells))


def _mean_discriminant(
    training: Training, trials: np.ndarray, shrinkage: float, draws: int, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    found = []
    for _ in range(draws):
        train = balanced(trials, training.labels, training.cells, rng)
        found.append(discriminant(training.features[train], training.labels[train], shrinkage=shrinkage))
    return np.mean([weights for weights, _ in found], axis=0), float(np.mean([bias for _, bias in found]))


def _held_out_probabilities(scores: np.ndarray, training: Training) -> np.ndarray:
    """Return P(class 2) a trial, where slope and offset are fitted to the trials of all other blocks."""
    out = np.full(len(scores), 0.5)
    for part in np.unique(training.held_out):
        here = training.held_out == part
        slope, offset = platt(scores[~here], training.labels[~here], training.cells[~here])
        out[here] = 1 / (1 + np.exp(-np.clip(slope * scores[here] + offset, -500, 500)))
    return out


def _trains(labels: np.ndarray, groups: np.ndarray, cells: np.ndarray) -> bool:
    """Return whether enough trials of both classes are left to train on, whichever group is held out."""
    return all(pairs(labels[groups != one], cells[groups != one]) >= _LEAST for one in np.unique(groups))


def _in_cells(labels: np.ndarray, cells: np.ndarray) -> str:
    present: Sequence[int] = np.unique(cells).tolist()
    return f", {pairs(labels, cells)} pairs of them within strata" if len(present) > 1 else ""
