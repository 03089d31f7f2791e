"""Decoders that never look at EEG: what a trial's history alone predicts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hrcneuro.decoding.crossval import Split


def rule_bacc(cues: np.ndarray, labels: np.ndarray) -> float:
    """Return the balanced accuracy of "where the cue holds, class 2", as a fraction; NaN where a class is absent.

    Args:
        cues: ndarray, shape (n_trials,), bool: the move before was an error, or the next target differs.
        labels: ndarray, shape (n_trials,), true for class 2.
    """
    if not labels.any() or labels.all():
        return float("nan")
    return float(cues[labels].mean() + 1 - cues[~labels].mean()) / 2


def fitted_scores(cues: np.ndarray, labels: np.ndarray, splits: Sequence[Split]) -> list[np.ndarray]:
    """Return the held-out scores of a rule learnt in each training set: P(cue | class 2) − P(cue | class 1).

    The best a decoder can do that sees only the cue. Positive scores mean class 2; a tie decides for class 1.

    Args:
        cues: ndarray, shape (n_trials,), whole numbers: the cue's value, or a code for several cues together.
        labels: ndarray, shape (n_trials,), true for class 2.
        splits: The folds of the decoder beside which this stands.
    """
    n_values = int(cues.max()) + 1 if len(cues) else 1
    out = []
    for split in splits:
        second = labels[split.train]
        seen = cues[split.train]
        share1 = np.bincount(seen[~second], minlength=n_values) / max(int((~second).sum()), 1)
        share2 = np.bincount(seen[second], minlength=n_values) / max(int(second.sum()), 1)
        out.append((share2 - share1)[cues[split.test]])
    return out
