"""The classifiers keep scikit-learn's contract and do what their papers say."""

import sys

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from hrcneuro.decoding import classifiers, crossval, decoders
from hrcneuro.decoding.recipes import BUILTIN, ESTIMATORS
from hrcneuro.decoding.refusals import EstimatorError, MissingLibraryError


@parametrize_with_checks([classifiers.RegularizedLDA(), classifiers.ToeplitzLDA()])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def test_regularized_lda_is_the_plain_discriminant():
    rng = np.random.default_rng(0)
    rows, labels = rng.normal(size=(60, 12)), rng.permutation(60) < 25
    splits = crossval.shuffled_splits(labels, n_folds=5, n_repeats=1, how="undersample", rng=rng)
    plain = np.concatenate(decoders.plain_rlda(rows, shrinkage=0.9)(labels, splits))
    looped = decoders.looped(rows, lambda: classifiers.make("rlda", {"shrinkage": 0.9}))
    assert np.concatenate(looped(labels, splits)) == pytest.approx(plain)


def test_block_toeplitz_averages_blocks_of_equal_lag():
    rng = np.random.default_rng(0)
    n_channels, n_times = 3, 4
    rows = rng.normal(size=(50, n_channels * n_times))
    covariance = np.cov(rows, rowvar=False)
    found = classifiers.block_toeplitz(covariance, n_channels=n_channels, n_times=n_times)
    blocks, before = (c.reshape(n_channels, n_times, n_channels, n_times) for c in (found, covariance))
    for lag in range(n_times):
        mean = np.mean([before[:, s, :, s + lag] for s in range(n_times - lag)], axis=0) * (1 - lag / n_times)
        for start in range(n_times - lag):
            assert blocks[:, start, :, start + lag] == pytest.approx(mean)
    assert found == pytest.approx(found.T)
    assert np.linalg.eigvalsh(found).min() > 0


def test_block_toeplitz_of_one_step_changes_nothing():
    covariance = np.cov(np.random.default_rng(0).normal(size=(30, 5)), rowvar=False)
    assert classifiers.block_toeplitz(covariance, n_channels=5, n_times=1) == pytest.approx(covariance)


def test_toeplitz_refuses_features_that_do_not_divide():
    rows = np.random.default_rng(0).normal(size=(20, 10))
    with pytest.raises(ValueError, match="10 features are no multiple of n_times = 4"):
        classifiers.ToeplitzLDA(n_times=4).fit(rows, np.arange(20) % 2)


def test_toeplitz_gains_on_stationary_noise():
    # Few trials, many features, noise whose covariance depends on lag only: the assumption is worth something.
    rng = np.random.default_rng(1)
    n_channels, n_times = 6, 12
    white = rng.normal(size=(600, n_channels, n_times + 4))
    noise = sum(white[:, :, k : k + n_times] for k in range(5)) @ np.eye(n_times)
    noise = np.einsum("ij,njt->nit", rng.normal(size=(n_channels, n_channels)), noise)
    labels = np.arange(600) % 2 == 0
    noise[labels] += 0.35 * np.sin(np.linspace(0, 2 * np.pi, n_times))
    rows = noise.reshape(600, -1)
    share = {}
    for name, estimator in (
        ("toeplitz", classifiers.ToeplitzLDA(n_times=n_times)),
        ("shrinkage", classifiers.make("shrinkage_lda", {})),
    ):
        share[name] = estimator.fit(rows[:120], labels[:120].astype(int)).score(rows[120:], labels[120:].astype(int))
    assert share["toeplitz"] > share["shrinkage"]


def test_every_recipe_names_its_source_and_fits():
    rng = np.random.default_rng(0)
    t = np.arange(-26, 154) / 128
    data = rng.normal(0, 10, (40, 4, len(t)))
    labels = np.arange(40) % 2 == 0
    splits = crossval.shuffled_splits(labels, n_folds=2, n_repeats=1, how="undersample", rng=rng)
    recipes = {name: r for name, r in BUILTIN.items() if r.estimator != "xdawn_tangent" or _has_pyriemann()}
    made = decoders.Decoders(recipes, epochs_uv=lambda rows: data[rows], times_s=t)
    names = []
    for name, decoder, _ in made.of(made.features_of(np.arange(40))):
        assert BUILTIN[name].citation
        assert np.isfinite(np.concatenate(decoder(labels, splits))).all()
        names.append(name)
    assert names == list(recipes)


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyriemann", None)
    monkeypatch.setitem(sys.modules, "pyriemann.estimation", None)
    with pytest.raises(MissingLibraryError, match="xdawn_tangent needs the library pyriemann"):
        classifiers.make("xdawn_tangent", {})


def test_wrong_names_and_parameters_are_named_with_what_is_allowed():
    with pytest.raises(EstimatorError, match="'svm' is not known; allowed: rlda"):
        classifiers.make("svm", {})
    with pytest.raises(EstimatorError, match=r"\{'gamma': 2\} do not fit the estimator rlda"):
        classifiers.make("rlda", {"gamma": 2})
    assert {r.estimator for r in BUILTIN.values()} == set(ESTIMATORS)


def _has_pyriemann() -> bool:
    from importlib.util import find_spec

    return find_spec("pyriemann") is not None
