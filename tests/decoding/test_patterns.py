"""Patterns of linear decoders beside MNE's, and what sets them apart from weights."""

import mne
import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from hrcneuro.decoding import features, patterns
from hrcneuro.decoding.classifiers import RegularizedLDA
from hrcneuro.decoding.decoders import Decoders
from hrcneuro.decoding.recipes import BUILTIN

TIMES_S = np.arange(-13, 77) / 64


@pytest.fixture
def trials():
    """Two features: the first holds a signal and noise, the second the noise alone; labels, and the signal's size."""
    rng = np.random.default_rng(8)
    labels = np.arange(4000) % 2 == 1
    noise, signal = rng.normal(0, 4, len(labels)), labels + rng.normal(0, 0.3, len(labels))
    return np.column_stack([signal + noise, noise + rng.normal(0, 0.1, len(labels))]), labels


@pytest.mark.parametrize("estimator", [RegularizedLDA(0.1), LogisticRegression()])
def test_patterns_are_mnes_but_for_their_unit(trials, estimator):
    rows, labels = trials
    model = mne.decoding.LinearModel(estimator).fit(rows, labels.astype(int))
    theirs = np.ravel(mne.decoding.get_coef(model, "patterns_"))
    weights = np.ravel(mne.decoding.get_coef(model, "filters_"))
    ours = patterns.pattern(rows, weights)
    np.testing.assert_allclose(ours / np.linalg.norm(ours), theirs / np.linalg.norm(theirs), rtol=1e-9)


def test_a_feature_that_only_cancels_noise_has_weight_and_no_pattern(trials):
    rows, labels = trials
    weights = RegularizedLDA(1e-6).fit(rows, labels).coef_
    assert abs(weights[1]) > 0.9 * abs(weights[0])
    found = patterns.pattern(rows, weights)
    assert found[0] > 10 * abs(found[1])
    # Both halves of the classes lie half of the signal from its mean.
    assert found[0] == pytest.approx(np.sqrt(0.5**2 + 0.3**2), rel=0.1)


def test_without_shrinkage_the_pattern_of_lda_is_the_difference_of_the_classes(trials):
    rows, labels = trials
    found = patterns.pattern(rows, RegularizedLDA(1e-9).fit(rows, labels).coef_)
    difference = rows[labels].mean(axis=0) - rows[~labels].mean(axis=0)
    np.testing.assert_allclose(found / np.linalg.norm(found), difference / np.linalg.norm(difference), atol=1e-3)


def test_the_size_of_the_weights_does_not_matter_and_equal_scores_have_no_pattern(trials):
    rows, _ = trials
    weights = np.array([1.0, -2.0])
    np.testing.assert_allclose(patterns.pattern(rows, 1e3 * weights), patterns.pattern(rows, weights))
    assert np.isnan(patterns.pattern(rows, np.zeros(2))).all()


def epochs_with_a_late_effect(n=160):
    rng = np.random.default_rng(2)
    labels = rng.random(n) < 0.5
    data = rng.normal(0, 5, (n, 4, len(TIMES_S)))
    data[:, 2] += 6 * labels[:, None] * ((TIMES_S >= 0.4) & (TIMES_S < 0.5))
    return data, labels


@pytest.mark.parametrize("name", list(BUILTIN))
def test_a_decoders_pattern_is_largest_where_the_effect_was_planted(name):
    data, labels = epochs_with_a_late_effect()
    made = Decoders({name: BUILTIN[name]}, epochs_uv=lambda rows: data[rows], times_s=TIMES_S)
    (found,) = patterns.of_problem(made, made.features_of(np.arange(len(labels))), labels)
    assert found.decoder == name
    if name == "xdawn_tangent":
        assert found.patterns is None
        return
    columns = [(channel, one) for block in found.layout for channel in range(4) for one in block]
    means = [i for i, (_, one) in enumerate(columns) if one.unit == "µV"]
    assert len(columns) == len(found.patterns) == len(found.weights)
    channel, where = columns[max(means, key=lambda i: found.patterns[i])]
    assert channel == 2
    assert where.span_s[0] >= 0.35
    assert where.span_s[1] <= 0.55


@pytest.mark.parametrize("kind", features.FEATURES)
def test_the_layout_names_every_feature_in_its_place(kind):
    rng = np.random.default_rng(4)
    data = rng.normal(0, 5, (3, 2, len(TIMES_S)))
    extracted = features.extract(kind, data, TIMES_S)
    blocks = features.layout(kind)
    assert extracted[0].size == 2 * sum(map(len, blocks))
    # A channel that is louder shows in its own columns of each block.
    louder = features.extract(kind, data * np.array([1.0, 3.0])[:, None], TIMES_S).reshape(3, -1)
    changed = ~np.isclose(louder, extracted.reshape(3, -1)).all(axis=0)
    assert changed.tolist() == [channel == 1 for block in blocks for channel in range(2) for _ in block]


def test_unknown_features_have_no_layout():
    with pytest.raises(ValueError, match="'x' are not known; allowed: windows"):
        features.layout("x")
