"""Leave-one-subject-out decoding: held against scikit-learn, pyRiemann and plain refits; who sees which trials."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import fractional_matrix_power

from hrcneuro.decoding import crossval, metrics, recentring, transfer
from hrcneuro.decoding.lda import Moments, discriminant, discriminant_of
from hrcneuro.decoding.recentring import centre, common, covariances, recentred
from hrcneuro.decoding.refusals import MissingLibraryError
from hrcneuro.decoding.transfer import Person, calibrations, scored
from hrcneuro.decoding.transfer_scheme import TransferScheme

pytest.importorskip("pyriemann", reason="needs the extra decoders")

SHAPE = (4, 3)  # channels, windows


def person(seed, *, n=48, effect=2.0, offset=0.0, mixing=0.0, parts=4, balanced=True):
    """A subject whose class 2 has more of the first channel, with a mean and a mixing of its own."""
    rng = np.random.default_rng(seed)
    labels = np.arange(n) % 2 == 1 if balanced else rng.random(n) < 0.3
    features = 5 * rng.standard_normal((n, *SHAPE))
    features[labels, 0] += effect
    own = np.eye(SHAPE[0]) + mixing * rng.standard_normal((SHAPE[0], SHAPE[0]))
    features = own @ features + offset * rng.standard_normal(SHAPE)
    return Person(features, labels, 3.0 * np.arange(n), 1 + np.arange(n) * parts // n)


def everyone(how_many=5, **options):
    return {f"s{i}": person(i, **options) for i in range(how_many)}


def only(people, target="s0", seed=0, **options):
    scheme = TransferScheme(**{"draws": 1, "shrinkage": 0.5, "pairs": (3,), **options})
    return {(one.way, one.size): one for one in scored(people, target, scheme, np.random.default_rng(seed))}


def bacc(one, of):
    return metrics.rates(of.labels, one.scores)[3]


@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 100))
def test_moments_of_two_heaps_are_those_of_one(n, more, seed):
    rows = np.random.default_rng(seed).normal(3, 5, (n + more, 4))
    joined, whole = Moments.of(rows[:n]).joined(Moments.of(rows[n:])), Moments.of(rows)
    assert joined.n == n + more
    np.testing.assert_allclose(joined.mean, whole.mean, atol=1e-10)
    np.testing.assert_allclose(joined.scatter, whole.scatter, atol=1e-9)


@pytest.mark.parametrize("shrinkage", [0.1, 0.9, 1.0])
def test_the_discriminant_of_moments_is_the_study_s(shrinkage):
    rng = np.random.default_rng(1)
    rows, labels = rng.normal(0, 5, (30, 8)), np.arange(30) % 3 == 0
    weights, bias = discriminant_of(Moments.of(rows[~labels]), Moments.of(rows[labels]), shrinkage=shrinkage)
    expected, expected_bias = discriminant(rows, labels, shrinkage=shrinkage)
    np.testing.assert_allclose(weights, expected, rtol=1e-9)
    assert bias == pytest.approx(expected_bias, rel=1e-9)


def groups_of(people):
    return np.concatenate([np.full(len(one.labels), name) for name, one in people.items()])


class Ridge:
    """The study's covariance of a class, as scikit-learn's LDA asks for one."""

    def __init__(self, shrinkage):
        self.shrinkage = shrinkage

    def fit(self, rows):
        plain = np.cov(rows, rowvar=False, ddof=1)
        self.covariance_ = (1 - self.shrinkage) * plain + self.shrinkage * np.eye(len(plain))
        return self


def left_out_scores(rows, labels, groups, shrinkage):
    """Return the scores of scikit-learn's LDA with one group left out at a time, in the study's scale."""
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.model_selection import LeaveOneGroupOut, cross_val_predict

    lda = LinearDiscriminantAnalysis(solver="lsqr", priors=[0.5, 0.5], covariance_estimator=Ridge(shrinkage))
    scores = cross_val_predict(lda, rows, labels, groups=groups, cv=LeaveOneGroupOut(), method="decision_function")
    # It halves the sum of covariances: (Σ₁ + Σ₂) / 2.
    return scores / 2


def test_pooled_scores_are_those_of_scikit_learn_with_one_group_left_out():
    people = everyone(offset=3.0)
    rows, labels = (np.concatenate([getattr(one, name) for one in people.values()]) for name in ("rows", "labels"))
    groups = groups_of(people)
    expected = left_out_scores(rows, labels, groups, 0.5)
    for name in people:
        found = only(people, name, ways=("pooled",))
        assert set(found) == {("pooled", 0)}
        np.testing.assert_allclose(found["pooled", 0].scores, expected[groups == name], rtol=1e-8)


def test_recentred_scores_are_those_of_scikit_learn_on_what_pyriemann_recentres():
    from pyriemann.transfer import TLCenter, encode_domains

    people = everyone(offset=3.0, mixing=0.2)
    groups = groups_of(people)
    rows, labels = (np.concatenate([getattr(one, name) for one in people.values()]) for name in ("rows", "labels"))
    centred = TLCenter("", metric="euclid").fit_transform(*encode_domains(rows, labels, groups)).reshape(-1, *SHAPE)
    matrices = covariances(centred, np.zeros(SHAPE))
    fitted = TLCenter("", metric="euclid").fit(*encode_domains(matrices, labels, groups)).centers_
    for name in people:
        others = [one for one in people if one != name]
        middle = np.mean([fitted[one]._mean for one in others], axis=0)
        mean = np.mean([people[one].features.mean(axis=0) for one in others], axis=0)
        size = np.sqrt(np.trace(middle) / len(middle))
        moved = np.concatenate([fitted[one].filters_ @ centred[groups == one] for one in people])
        # Of the target nothing is known: it is taken to be in the middle.
        moved[groups == name] = fractional_matrix_power(middle, -0.5) @ (people[name].features - mean)
        expected = left_out_scores(size * moved.reshape(len(moved), -1), labels, groups, 0.5)[groups == name]
        np.testing.assert_allclose(only(people, name)["recentred", 0].scores, expected, rtol=1e-6, atol=1e-9)


def test_a_centre_is_the_mean_that_pyriemann_finds_and_the_prior_counts_as_trials():
    one, prior = person(1, offset=4.0).features, centre(person(2, offset=4.0, mixing=0.3).features)
    found = centre(one[:6], prior, weight=10.0)
    mean = (one[:6].sum(axis=0) + 10 * prior.mean) / 16
    np.testing.assert_allclose(found.mean, mean)
    matrix = (covariances(one[:6], mean).sum(axis=0) + 10 * prior.covariance) / 16
    np.testing.assert_allclose(found.covariance, matrix)
    np.testing.assert_allclose(found.whitening, fractional_matrix_power(matrix, -0.5), rtol=1e-8)
    nothing = centre(one[:0], prior, weight=10.0)
    np.testing.assert_allclose(nothing.mean, prior.mean)
    np.testing.assert_allclose(nothing.covariance, prior.covariance)
    with pytest.raises(ValueError, match="a centre of 0 trials"):
        centre(one[:0])


def test_recentred_trials_have_no_mean_and_the_same_size_in_all_directions():
    for seed in range(3):
        features = person(seed, offset=5.0, mixing=0.5).features
        own = centre(features)
        moved = recentred(features, own, size_uv=7.0).reshape(features.shape)
        np.testing.assert_allclose(moved.mean(axis=0), 0, atol=1e-9)
        back = own.whitening @ covariances(features, own.mean).mean(axis=0) @ own.whitening
        np.testing.assert_allclose(back, np.eye(SHAPE[0]), atol=1e-9)
        assert 4 < moved.std() < 8


def test_a_direction_that_is_empty_stays_so():
    """The average reference empties one: whitening must not make a signal of rounding."""
    features = person(0).features
    features = features - features.mean(axis=1, keepdims=True)
    moved = recentred(features, centre(features), size_uv=1.0).reshape(features.shape)
    assert np.abs(moved.sum(axis=1)).max() < 1e-9
    assert np.isfinite(moved).all()


def test_the_middle_of_several_is_their_mean():
    centres = [centre(person(i, offset=2.0).features) for i in range(3)]
    middle = common(centres)
    np.testing.assert_allclose(middle.mean, np.mean([one.mean for one in centres], axis=0))
    np.testing.assert_allclose(middle.covariance, np.mean([one.covariance for one in centres], axis=0))


@pytest.mark.parametrize("size", [0, 2, 5, None])
def test_a_calibration_is_what_follows_the_held_out_block_and_no_more_than_needed(size):
    own = person(3, balanced=False)
    made = calibrations(own, size)
    assert [one.test.tolist() for one in made] == [np.flatnonzero(own.parts == part).tolist() for part in (1, 2, 3, 4)]
    for part, one in zip((1, 2, 3, 4), made, strict=True):
        assert not set(one.seen) & set(one.test)
        following = [*range(part + 1, 5), *range(1, part)]
        order = [trial for other in following for trial in np.flatnonzero(own.parts == other)]
        assert one.seen.tolist() == order[: len(one.seen)]
        counts = [int((own.labels[one.seen] == label).sum()) for label in (False, True)]
        assert one.pairs == min(counts)
        if size:
            assert min(counts) == size
            fewer = [int((own.labels[one.seen[:-1]] == label).sum()) for label in (False, True)]
            assert min(fewer) == size - 1
        else:
            assert len(one.seen) == (0 if size == 0 else len(order))


def test_cap_time_is_from_a_block_s_first_trial_to_the_last_that_is_seen():
    own = person(3)  # a trial every 3 s, twelve a block
    first = calibrations(own, 3)[0]
    assert len(first.seen) == 6
    assert first.minutes == pytest.approx(5 * 3 / 60)
    whole = calibrations(own, None)[0]
    assert whole.minutes == pytest.approx(3 * 11 * 3 / 60)
    assert calibrations(own, 0)[0].minutes == 0


def test_a_size_that_a_part_cannot_give_is_left_out():
    assert calibrations(person(3), 18)
    assert calibrations(person(3), 19) == []
    found = only(everyone(), pairs=(2, 19))
    assert {size for way, size in found if way == "own"} == {2, None}


def test_own_and_joint_are_plain_refits():
    people = everyone(offset=2.0, mixing=0.2)
    own, found = people["s0"], only(people)
    centres = [centre(people[name].features) for name in ("s1", "s2", "s3", "s4")]
    middle = common(centres)
    sources = [
        recentred(people[name].features, at, size_uv=middle.size_uv)
        for name, at in zip(("s1", "s2", "s3", "s4"), centres, strict=True)
    ]
    labels = np.concatenate([people[name].labels for name in ("s1", "s2", "s3", "s4")])
    for one in calibrations(own, None):
        weights, bias = discriminant(own.rows[one.seen], own.labels[one.seen], shrinkage=0.5)
        expected = own.rows[one.test] @ weights + bias
        np.testing.assert_allclose(found["own", None].scores[one.test], expected, rtol=1e-7, atol=1e-9)
        moved = recentred(own.features, centre(own.features[one.seen], middle, weight=10.0), size_uv=middle.size_uv)
        rows = np.concatenate([*sources, moved[one.seen]])
        weights, bias = discriminant(rows, np.append(labels, own.labels[one.seen]), shrinkage=0.5)
        expected = moved[one.test] @ weights + bias
        np.testing.assert_allclose(found["joint", None].scores[one.test], expected, rtol=1e-7, atol=1e-9)


def test_without_its_labels_a_subject_s_labels_change_nothing():
    people = everyone(offset=2.0)
    rng = np.random.default_rng(5)
    own = people["s0"]
    other = people | {"s0": Person(own.features, rng.permutation(own.labels), own.onsets_s, own.parts)}
    one, two = only(people), only(other)
    for key in (("pooled", 0), ("recentred", 0), ("recentred", None)):
        np.testing.assert_array_equal(one[key].scores, two[key].scores)
    assert not np.array_equal(one["own", None].scores, two["own", None].scores)


def test_a_held_out_block_changes_the_scores_of_its_own_trials_alone():
    people = everyone(offset=2.0)
    own = people["s0"]
    changed = own.features.copy()
    changed[own.parts == 2] += 100.0
    one = only(people, pairs=())
    two = only(people | {"s0": Person(changed, own.labels, own.onsets_s, own.parts)}, pairs=())
    assert np.array_equal(one["pooled", 0].scores[own.parts != 2], two["pooled", 0].scores[own.parts != 2])
    for key in (("own", None), ("recentred", None), ("joint", None)):
        # Of the decoder that scores block 2 nothing changes: the shift adds the same to all of its trials.
        shift = two[key].scores[own.parts == 2] - one[key].scores[own.parts == 2]
        np.testing.assert_allclose(shift, shift[0], rtol=1e-6)


def test_leaving_a_way_out_changes_no_other():
    people = everyone(balanced=False, offset=2.0)
    every = only(people, draws=3)
    for way in ("own", "pooled", "recentred"):
        for key, one in only(people, draws=3, ways=(way,)).items():
            np.testing.assert_array_equal(one.scores, every[key].scores)


def test_what_is_common_is_found_in_a_new_subject_and_recentring_helps_where_subjects_differ():
    people = everyone(8, n=96, effect=4.0, offset=12.0, mixing=0.3)
    found = {name: only(people, name, draws=2, pairs=(2, 10)) for name in people}
    mean = {key: np.mean([bacc(found[name][key], people[name]) for name in people]) for key in found["s0"]}
    assert mean["recentred", None] > 0.65
    assert mean["recentred", None] > mean["pooled", 0] + 0.05
    assert mean["recentred", None] > mean["recentred", 0]
    assert mean["own", None] > mean["own", 2]
    assert mean["joint", None] > mean["own", 2]


def test_without_a_common_effect_nothing_is_found():
    people = everyone(8, n=96, effect=0.0, offset=5.0, mixing=0.3)
    found = {name: only(people, name, pairs=(10,)) for name in people}
    for key in found["s0"]:
        values = [bacc(found[name][key], people[name]) for name in people]
        # 768 trials as binomial draws: four standard errors of 1.8 points.
        assert np.mean(values) == pytest.approx(0.5, abs=0.072)


def test_without_pyriemann_recentring_says_what_is_missing_and_the_other_ways_work(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyriemann", None)
    monkeypatch.setitem(sys.modules, "pyriemann.transfer", None)
    with pytest.raises(MissingLibraryError, match="recentring needs the library pyriemann"):
        recentring.tools()
    found = only(everyone(), ways=("own", "pooled"))
    assert {way for way, _ in found} == {"own", "pooled"}


def test_the_scores_of_several_draws_are_their_mean():
    people = everyone(balanced=False)
    own = people["s0"]
    rng = np.random.default_rng(9)
    drawn = [crossval.balance(np.arange(48), own.labels, "undersample", rng) for _ in range(2)]
    classes = [(Moments.of(own.rows[d][: len(d) // 2]), Moments.of(own.rows[d][len(d) // 2 :])) for d in drawn]
    weights, bias = transfer._mean_discriminant(classes, 0.5)
    each = [discriminant(own.rows[d], own.labels[d], shrinkage=0.5) for d in drawn]
    expected = np.mean([own.rows @ w + b for w, b in each], axis=0)
    np.testing.assert_allclose(own.rows @ weights + bias, expected, rtol=1e-8, atol=1e-10)
