"""The mean ROC curve of the folds, beside scikit-learn's curves."""

import numpy as np
import pytest
from sklearn.metrics import roc_auc_score, roc_curve

from hrcneuro.decoding import metrics
from hrcneuro.decoding.crossval import Split, shuffled_splits


@pytest.fixture
def folds():
    """Return labels, folds and the held-out trials' scores, some of them equal."""
    rng = np.random.default_rng(11)
    labels = rng.random(230) < 0.4
    splits = shuffled_splits(labels, n_folds=5, n_repeats=3, how="undersample", rng=rng)
    scores = [np.round(rng.normal(1.2 * labels[s.test], 1) * 4) / 4 + 10 * s.fold for s in splits]
    return labels, splits, scores


def test_a_folds_curve_is_scikit_learns(folds):
    labels, splits, scores = folds
    for split, score in zip(splits, scores, strict=True):
        curve = metrics.mean_roc(labels, [split], [score])
        false, true, _ = roc_curve(labels[split.test], score, drop_intermediate=False)
        rises = np.isin(metrics.FALSE_POSITIVES.round(9), false.round(9))
        expected = np.interp(metrics.FALSE_POSITIVES, false, true)
        np.testing.assert_allclose(curve[~rises], expected[~rises], atol=1e-12)
        middle = [(true[np.isclose(false, f)].min() + true[np.isclose(false, f)].max()) / 2
                  for f in metrics.FALSE_POSITIVES[rises]]  # fmt: skip
        np.testing.assert_allclose(curve[rises], middle, atol=1e-12)


def test_the_mean_curve_encloses_the_mean_of_the_folds_auc(folds):
    labels, splits, scores = folds
    curve = metrics.mean_roc(labels, splits, scores)
    expected = np.mean([roc_auc_score(labels[s.test], v) for s, v in zip(splits, scores, strict=True)])
    assert np.trapezoid(curve, metrics.FALSE_POSITIVES) == pytest.approx(expected, abs=3e-3)
    assert metrics.fold_rates(labels, splits, scores).mean()["auc"] == pytest.approx(expected)
    assert (np.diff(curve) >= 0).all()


def test_scores_of_different_folds_are_not_compared(folds):
    labels, splits, scores = folds
    shifted = [score + 100 * i for i, score in enumerate(scores)]
    np.testing.assert_allclose(metrics.mean_roc(labels, splits, shifted), metrics.mean_roc(labels, splits, scores))


def test_perfect_and_blind_scores():
    labels = np.arange(40) % 2 == 1
    every = [Split(0, 0, np.arange(0), np.arange(40))]
    assert metrics.mean_roc(labels, every, [labels.astype(float)])[1:].tolist() == [1.0] * 100
    np.testing.assert_allclose(metrics.mean_roc(labels, every, [np.zeros(40)]), metrics.FALSE_POSITIVES, atol=1e-12)


def test_a_fold_that_lacks_a_class_is_left_out():
    labels = np.array([False, False, True, True])
    splits = [Split(0, 0, np.arange(0), np.array([0, 1])), Split(0, 1, np.arange(0), np.array([0, 3]))]
    scores = [np.zeros(2), np.array([0.0, 1.0])]
    np.testing.assert_array_equal(
        metrics.mean_roc(labels, splits, scores), metrics.mean_roc(labels, splits[1:], scores[1:])
    )
    assert np.isnan(metrics.mean_roc(labels, splits[:1], scores[:1])).all()
