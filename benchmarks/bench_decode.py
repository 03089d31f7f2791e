"""The study's decoder, 4 problems × 10 × 10 folds at the size of one subject, against loops of numpy and scikit-learn.

All three meet the same folds and the same balanced training sets. The numpy loop fits the very same classifier;
scikit-learn has none with the paper's regularisation (each class's covariance shrunk towards the identity in µV²), its
nearest is LDA with a fixed shrinkage of the pooled covariance.
"""

from __future__ import annotations

import _measure
import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

from hrcneuro.decoding import crossval, decoders

# Trials a class: the means of the real logs (sC HH/HR, sC RR/RH, iC HH/HR, iC RR/RH), 405 features.
PROBLEMS = ((335, 62), (295, 59), (276, 87), (236, 153))
FEATURES, SHRINKAGE = 405, 0.9
TARGET = 15


def subject() -> list[tuple[np.ndarray, np.ndarray, list[crossval.Split]]]:
    """Return features (µV, correlated as neighbouring windows and channels are), labels and folds of every problem."""
    rng = np.random.default_rng(0)
    mixing = rng.standard_normal((60, FEATURES)) * 0.8
    found = []
    for first, second in PROBLEMS:
        labels = rng.permutation(np.arange(first + second) < second)
        rows = rng.standard_normal((len(labels), 60)) @ mixing + rng.normal(0, 3, (len(labels), FEATURES))
        rows[labels] += rng.normal(0, 0.4, FEATURES)
        found.append(
            (rows, labels, crossval.shuffled_splits(labels, n_folds=10, n_repeats=10, how="undersample", rng=rng))
        )
    return found


def ours(problems: list) -> list[np.ndarray]:
    return [np.concatenate(decoders.rlda(x, shrinkage=SHRINKAGE)(y, splits)) for x, y, splits in problems]


def plain(problems: list) -> list[np.ndarray]:
    return [np.concatenate(decoders.plain_rlda(x, shrinkage=SHRINKAGE)(y, splits)) for x, y, splits in problems]


def sklearn_loop(problems: list) -> list[np.ndarray]:
    found = []
    for x, y, splits in problems:
        scores = []
        for split in splits:
            lda = LinearDiscriminantAnalysis(solver="lsqr", shrinkage=SHRINKAGE).fit(x[split.train], y[split.train])
            scores.append(lda.decision_function(x[split.test]))
        found.append(np.concatenate(scores))
    return found


def main() -> None:
    chosen = _measure.options(__doc__)
    problems = subject()
    _measure.heading()
    works = (plain, sklearn_loop, ours)
    by_plain, by_sklearn, by_us = _measure.in_turns(chosen.repeats, *(lambda w=w: w(problems) for w in works))
    reference, fast = np.concatenate(plain(problems)), np.concatenate(ours(problems))
    differing = int(np.count_nonzero((reference > 0) != (fast > 0)))
    gap = np.abs(reference - fast).max() / np.abs(reference).max()
    said = f"{differing} of {len(fast)} labels, scores {gap:.0e} relative"
    _measure.row("decode, 4 problems × 10 × 10 folds; numpy loop", by_plain, by_us, TARGET, said)
    _measure.row("the same; scikit-learn's LDA", by_sklearn, by_us, None, "another regularisation")


if __name__ == "__main__":
    main()
