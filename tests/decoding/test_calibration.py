"""How a frozen decoder is found: no block leaks, what is planted is found, strata are matched, probabilities hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits

from hrcneuro.decoding.calibration import (
    Training,
    balanced,
    calibrate,
    evidence_weights,
    held_out,
    log_loss,
    platt,
    strata_cells,
)
from hrcneuro.decoding.frozen_refusals import FewTrialsError
from hrcneuro.decoding.lda import discriminant
from hrcneuro.decoding.metrics import rates

BLOCKS = 6
ALIKE = np.zeros(60, int)


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    """Hundreds of small systems are solved: threads that wait for each other would take most of the time."""
    with threadpool_limits(1):
        yield


def trials(seed, *, n=240, features=30, effect=0.0, share=0.3, drift=0.0, cues=None):
    """Return features, labels and blocks: a shift of class 2, and one of each block that says nothing of classes."""
    rng = np.random.default_rng(seed)
    labels = rng.random(n) < share
    blocks = np.arange(n) * BLOCKS // n
    rows = rng.normal(0, 3, (n, features)) + drift * rng.normal(0, 1, (BLOCKS, features))[blocks]
    rows[labels, :5] += effect
    return rows, labels, blocks


def found(seed, *, cells=None, draws=5, **kind):
    rows, labels, blocks = trials(seed, **kind)
    cells = np.zeros(len(labels), int) if cells is None else cells
    training = Training(rows, labels, blocks, cells)
    return training, calibrate(training, shrinkage=0.9, draws=draws, rng=np.random.default_rng(seed))


def bacc(training, result):
    return rates(training.labels, result.scores)[3]


def test_without_an_effect_held_out_blocks_are_at_chance_and_probabilities_know_nothing():
    ones = [found(seed, drift=2.0) for seed in range(40)]
    scored = np.array([bacc(*one) for one in ones])
    assert abs(scored.mean() - 0.5) < 3 * scored.std(ddof=1) / np.sqrt(len(scored))
    losses = [log_loss(result.probabilities, training.labels, training.cells) for training, result in ones]
    assert np.mean(losses) > 0.995


def test_what_is_planted_is_found_and_probabilities_say_how_sure_that_is():
    ones = [found(seed, effect=3.0) for seed in range(8)]
    assert np.mean([bacc(*one) for one in ones]) > 0.75
    p = np.concatenate([result.probabilities for _, result in ones])
    labels = np.concatenate([training.labels for training, _ in ones])
    assert log_loss(p, labels, np.zeros(len(p), int)) < 0.8
    # Both classes weighing alike, of trials that are called 0.6 to 0.8 about 0.7 are takeovers.
    weight = np.where(labels, 0.5 / labels.mean(), 0.5 / (~labels).mean())
    here = (p > 0.6) & (p < 0.8)
    assert abs(np.average(labels[here], weights=weight[here]) - np.average(p[here], weights=weight[here])) < 0.07


def test_a_block_s_own_labels_do_not_reach_its_scores():
    training, before = found(3, effect=1.0)
    here = training.held_out == 2
    labels = training.labels.copy()
    labels[here] = np.random.default_rng(1).permutation(labels[here])
    swapped = Training(training.features, labels, training.held_out, training.cells)
    after = calibrate(swapped, shrinkage=0.9, draws=5, rng=np.random.default_rng(3))
    # The folds' draws come from one generator, block by block: those of block 0 to 2 in the first draw are the same.
    once = [calibrate(one, shrinkage=0.9, draws=1, rng=np.random.default_rng(3)) for one in (training, swapped)]
    np.testing.assert_array_equal(once[0].scores[here], once[1].scores[here])
    assert not np.array_equal(before.weights, after.weights)


def test_the_decoder_is_the_mean_of_balanced_ones():
    training, result = found(5, effect=1.0, draws=1)
    rng = np.random.default_rng(5).spawn(2)[0]
    train = balanced(np.arange(240), training.labels, training.cells, rng)
    weights, bias = discriminant(training.features[train], training.labels[train], shrinkage=0.9)
    np.testing.assert_array_equal(result.weights, weights)
    assert result.bias == bias
    assert np.count_nonzero(training.labels[train]) * 2 == len(train)


def test_unequal_classes_do_not_pull_the_threshold():
    """With a tenth of takeovers and no effect a decoder that learned from all trials would call nearly none."""
    ones = [found(seed, share=0.1, features=100) for seed in range(20)]
    stays = np.array([(result.scores <= 0).mean() for _, result in ones])
    assert abs(stays.mean() - 0.5) < 0.06


def test_within_matched_strata_a_decoder_does_not_learn_the_cue():
    """Features that show the cue alone, which foretells the label: plain training uses it, matched does not."""
    plain, matched = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        labels = rng.random(400) < 0.4
        cue = rng.random(400) < np.where(labels, 0.8, 0.3)
        rows = rng.normal(0, 1, (400, 10)) + 3.0 * cue[:, None]
        blocks = np.arange(400) * BLOCKS // 400
        for cells, scored in ((np.zeros(400, int), plain), (strata_cells({"turn": cue}, 400), matched)):
            training = Training(rows, labels, blocks, cells)
            scored.append(bacc(training, calibrate(training, shrinkage=0.9, draws=5, rng=rng)))
    assert np.mean(plain) > 0.7
    assert abs(np.mean(matched) - 0.5) < 0.05


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6))
def test_balanced_training_sets_have_both_classes_alike_in_every_cell(seed):
    rng = np.random.default_rng(seed)
    labels, cells = rng.random(60) < 0.4, rng.integers(0, 3, 60)
    among = np.flatnonzero(rng.random(60) < 0.8)
    train = balanced(among, labels, cells, rng)
    assert set(train) <= set(among)
    assert len(set(train)) == len(train)
    assert not np.diff(labels[train].astype(int)).min(initial=0) < 0
    for cell in range(3):
        sizes = [np.count_nonzero((cells[among] == cell) & (labels[among] == label)) for label in (False, True)]
        got = [np.count_nonzero((cells[train] == cell) & (labels[train] == label)) for label in (False, True)]
        assert got == [min(sizes)] * 2


def test_cells_tell_every_combination_of_cues_apart():
    a, b = np.array([0, 0, 1, 1], bool), np.array([0, 1, 0, 1], bool)
    assert len(set(strata_cells({"prev_error": a, "turn": b}, 4))) == 4
    assert len(set(strata_cells({}, 4))) == 1


def test_without_two_blocks_fifths_are_held_out_and_too_few_trials_are_refused():
    labels, cells = np.arange(40) % 3 == 0, np.zeros(40, int)
    blocks = np.arange(40) // 20
    groups, by_block = held_out(labels, blocks, cells)
    assert by_block
    assert groups is blocks
    for lacking in (None, np.ones(40, int)):
        groups, by_block = held_out(labels, lacking, cells)
        assert not by_block
        assert np.bincount(groups).tolist() == [8] * 5
        assert (np.diff(groups) >= 0).all()
    with pytest.raises(FewTrialsError, match="38 trials of class 1 and 2 of class 2"):
        held_out(np.arange(40) < 2, blocks, cells)
    # Both classes occur, but never in one stratum.
    with pytest.raises(FewTrialsError, match="0 pairs of them within strata"):
        held_out(labels, blocks, labels.astype(int))


def test_platt_finds_the_log_odds_of_two_gaussians_whatever_the_classes_sizes():
    rng = np.random.default_rng(0)
    scores = np.concatenate([rng.normal(-1, 2, 40_000), rng.normal(3, 2, 4000)])
    slope, offset = platt(scores, np.arange(44_000) >= 40_000, np.zeros(44_000, int))
    # log N(3, 2) / N(-1, 2) = (4 s − 4) / 4
    assert slope == pytest.approx(1.0, rel=0.05)
    assert offset == pytest.approx(-1.0, rel=0.08)


def test_platt_stays_finite_where_classes_do_not_overlap_and_turns_nothing_around():
    labels = np.arange(20) >= 10
    apart = np.where(labels, 5.0, -5.0)
    slope, offset = platt(apart, labels, ALIKE[:20])
    assert 0 < slope < 10
    assert abs(offset) < 1e-6
    assert platt(-apart, labels, ALIKE[:20]) == (0.0, 0.0)
    assert platt(np.zeros(20), labels, ALIKE[:20]) == (0.0, 0.0)


@given(st.integers(0, 10**6), st.floats(0.01, 1000))
@settings(deadline=None, max_examples=30)
def test_platt_does_not_depend_on_the_unit_of_the_score(seed, unit):
    rng = np.random.default_rng(seed)
    labels = np.arange(60) % 3 == 0
    scores = rng.normal(0, 1, 60) + labels
    slope, offset = platt(scores, labels, ALIKE)
    other = platt(unit * scores, labels, ALIKE)
    assert other[0] * unit == pytest.approx(slope, rel=1e-6, abs=1e-9)
    assert other[1] == pytest.approx(offset, rel=1e-6, abs=1e-6)


def test_log_loss_is_one_bit_where_nothing_is_known():
    labels = np.arange(10) < 3
    assert log_loss(np.full(10, 0.5), labels, ALIKE[:10]) == pytest.approx(1)
    assert log_loss(np.where(labels, 1.0, 0.0), labels, ALIKE[:10]) == pytest.approx(0, abs=1e-9)
    assert log_loss(np.where(labels, 0.0, 1.0), labels, ALIKE[:10]) > 30


def test_a_cue_that_shows_in_the_score_is_no_evidence_where_its_strata_are_matched():
    """A score that follows the cue and nothing else: the cue foretells the label, within its strata nothing does."""
    rng = np.random.default_rng(0)
    labels = rng.random(4000) < 0.4
    cue = rng.random(4000) < np.where(labels, 0.8, 0.3)
    scores = rng.normal(0, 1, 4000) + 2.0 * cue
    plain, _ = platt(scores, labels, np.zeros(4000, int))
    matched, _ = platt(scores, labels, cue.astype(int))
    assert plain > 0.4
    assert matched < 0.1
    weights = evidence_weights(labels, cue.astype(int))
    for value in (False, True):
        sums = [weights[(cue == value) & (labels == label)].sum() for label in (False, True)]
        assert sums[0] == pytest.approx(sums[1])
    assert weights.sum() == pytest.approx(1)
