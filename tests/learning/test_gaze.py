"""The robot that looks, of Ehrlich & Cheng 2018: its update, the counts behind it, its partner and the whole game."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.learning import gaze, gaze_counts, gaze_game, gaze_partner
from hrcneuro.learning.gaze import DecoderRates
from tests.helpers import gaze_logs

SEEDS = st.integers(0, 2**32 - 1)


def test_the_first_trial_of_the_published_logs():
    # s03_corl1, first trial, row 0: (13, 11, 7, 5) / 36 from 0.25 and n = (4, 3, 1, 0).
    counts = np.zeros((4, 4), int)
    counts[0] = (4, 3, 1, 0)
    after = gaze.update(gaze.uniform(), counts, np.array(False))
    assert after[0] == pytest.approx(np.array([13, 11, 7, 5]) / 36, abs=1e-15)
    assert np.array_equal(after[1:], gaze.uniform()[1:])


def test_a_probability_that_would_leave_its_range_is_truncated_and_one_inside_is_left():
    policy = np.array([[0.1, 0.00002, 0.3, 0.59998]] * 4)
    counts = np.array([[1, 0, 0, 4], [0, 0, 3, 0], [2, 0, 0, 0], [0, 0, 0, 0]])
    less = gaze.update(policy, counts, np.array(True))
    # To 0 exactly, by rounding or not, and below: 0.0001 before the row is normalised; untouched ones may be smaller.
    assert less[0] == pytest.approx(np.array([0.0001, 0.00002, 0.3, 0.19998]) / 0.5001, rel=1e-12)
    assert less[1] == pytest.approx(np.array([0.1, 0.00002, 0.0001, 0.59998]) / 0.7001, rel=1e-12)
    more = gaze.update(policy, counts, np.array(False))
    assert more[0] == pytest.approx(np.array([0.2, 0.00002, 0.3, 0.99998]) / 1.5, rel=1e-12)
    up = gaze.update(policy, 2 * counts, np.array(False))
    assert up[0] == pytest.approx(np.array([0.3, 0.00002, 0.3, 0.9999]) / 1.59992, rel=1e-12)


@given(SEEDS, st.booleans())
@settings(max_examples=60, deadline=None)
def test_an_update_stays_a_policy_and_its_counts_are_found_again(seed, error):
    rng = np.random.default_rng(seed)
    policy = rng.dirichlet(np.full(4, rng.choice([0.3, 2.0])), size=4).clip(1e-7)
    policy /= policy.sum(axis=1, keepdims=True)
    counts = gaze_logs.walk(policy, int(rng.integers(0, 40)), rng)
    after = gaze.update(policy, counts, np.array(error))
    assert np.allclose(after.sum(axis=1), 1.0)
    assert (after > 0).all()
    found = gaze_counts.trial_counts(policy, after, error=error)
    assert found.solved
    assert found.allows(int(counts.sum()))
    for row, true in zip(found.rows, counts, strict=True):
        # One of the solutions is the truth: equal where nothing was truncated, no more than it where something was.
        assert any(
            all(t >= n if cut else t == n for t, n, cut in zip(true, one.least, one.truncated, strict=True))
            for one in row
        )
    ways = found.matrices(int(counts.sum()))
    assert not len(ways) or any(np.array_equal(one, counts) for one in ways)
    assert all(one.sum() == counts.sum() for one in ways)


def test_a_whole_session_is_replayed_to_the_last_digit_of_its_log():
    one, counts = gaze_logs.session("s03", 1, seed=5)
    assert np.abs(gaze.replay(counts, one.error) - one.policies).max() < 1e-12
    found = [
        gaze_counts.trial_counts(before, after, error=bool(wrong))
        for before, after, wrong in zip(one.before, one.policies, one.error, strict=True)
    ]
    again = gaze.replay(np.stack([each.least for each in found]), one.error)
    assert np.abs(again - one.policies).max() < 1e-12
    # A sum that the log does not have is not allowed where all is known.
    whole = next(each for each in found if each.unique and not each.truncated)
    assert not whole.allows(int(whole.least.sum()) + 1)
    assert len(whole.matrices(int(whole.least.sum()) + 1)) == 0


def test_trials_follow_where_each_of_their_rows_has_a_solution():
    one, _ = gaze_logs.session("s03", 1, seed=6)
    found = [
        gaze_counts.trial_counts(before, after, error=bool(wrong)).solved
        for before, after, wrong in zip(one.before, one.policies, one.error, strict=True)
    ]
    assert all(found)
    assert gaze_counts.follows(one.before, one.policies, one.error).tolist() == found
    said = one.error.copy()
    said[[3, 17]] ^= True
    assert np.flatnonzero(~gaze_counts.follows(one.before, one.policies, said)).tolist() == [3, 17]
    # A probability of 0 has no sum that its truncation would give.
    gone = one.policies.copy()
    gone[10, 1] = (0.0, 0.5, 0.25, 0.25)
    assert not gaze_counts.follows(one.before, gone, one.error)[10]


def test_a_policy_that_no_counts_explain_has_no_solution():
    before = gaze.uniform()[0]
    assert gaze_counts.row_solutions(before, np.array([0.26, 0.25, 0.25, 0.24]), error=False) == []
    assert gaze_counts.row_solutions(before, np.array([0.5, 0.25, 0.25, 0.0]), error=True) == []


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_a_walk_is_one_path_and_one_with_a_step_too_many_elsewhere_is_none(seed):
    rng = np.random.default_rng(seed)
    counts = gaze_logs.walk(gaze.uniform(), int(rng.integers(1, 30)), rng)
    assert gaze_counts.is_path(counts)
    torn = counts.copy()
    torn[0, 1] += 3
    assert not gaze_counts.is_path(torn)


def test_transitions_that_hang_not_together_are_no_path():
    apart = np.diag([2, 0, 0, 1])
    assert not gaze_counts.is_path(apart)
    apart[0, 3] = 1
    assert gaze_counts.is_path(apart)


def test_looks_are_shares_of_those_at_objects():
    counts = np.zeros((4, 4), int)
    counts[3, 0], counts[0, 3], counts[0, 1] = 3, 5, 1
    assert gaze_counts.looks(counts).tolist() == [0.75, 0.25, 0.0]
    assert gaze_counts.looks(np.zeros((4, 4), int)).tolist() == [0.0, 0.0, 0.0]


def test_rates_are_of_right_and_of_wrong_guesses():
    right = np.array([True, True, True, True, False, False])
    error = np.array([False, False, False, True, True, False])
    assert gaze.rates(right, error) == DecoderRates(0.75, 0.5)
    assert gaze.rates(right, error).balanced == 0.625
    assert np.isnan(gaze.rates(right[:4], error[:4]).tpr)
    assert gaze.rates(right[:4], error[:4], prior=0.5).tpr == 0.5


def test_a_partner_who_adapts_comes_to_read_what_she_read_wrongly():
    looked = np.array([[0.8, 0.1, 0.1]])
    weights = np.array([-2.0])
    before = gaze_partner.guess_probabilities(weights, looked)[0, 0]
    for _ in range(60):
        weights = gaze_partner.adapted(weights, looked, 0.3)
    assert before < 0.2
    assert gaze_partner.guess_probabilities(weights, looked)[0, 0] > 0.6
    # The fixed one does not move, and looks that tell nothing teach nothing.
    assert gaze_partner.adapted(np.array([-2.0]), looked, 0.0) == -2.0
    assert gaze_partner.adapted(np.array([-2.0]), np.full((1, 3), 1 / 3), 0.3) == pytest.approx(-2.0)


def test_the_game_teaches_with_a_good_decoder_and_not_with_one_that_guesses():
    good, chance = DecoderRates(0.95, 0.95), DecoderRates(0.5, 0.5)
    reader, other = gaze_partner.Partner(8.0), gaze_partner.Partner(8.0, rate=0.5)
    lengths = np.arange(5, 20)

    def ends(decoder, partner):
        rng = np.random.default_rng(3)
        right = gaze_game.play([decoder], [partner], lengths, repetitions=300, rng=rng)
        assert right.shape == (1, 300, 50)
        return right[..., :10].mean(), right[..., -10:].mean()

    first, last = ends(good, reader)
    assert first < 0.5 < last - 0.1
    assert abs(ends(chance, reader)[1] - 1 / 3) < 0.06
    # Somebody who reads the gaze the wrong way round is taught by the light, where she can be.
    wrong = gaze_partner.Partner(-3.0)
    assert ends(good, dataclasses.replace(wrong, rate=0.6))[1] > ends(good, wrong)[1] + 0.02
    assert ends(good, other) == ends(good, other)


def test_a_game_walks_as_long_as_it_is_told():
    rng = np.random.default_rng(0)
    policy = np.broadcast_to(gaze.uniform(), (2, 5, 4, 4)).copy()
    length = np.array([3, 9, 1, 4, 9])
    counts = gaze_game._walk(policy, length, rng)
    assert np.array_equal(counts.sum(axis=(2, 3)), np.stack([length, length]))
    assert gaze_counts.is_path(counts).all()


def reading(rate, *, people=8, spread=0.0, seed=0):
    """Return what people with planted weights saw and guessed, twice each."""
    rng = np.random.default_rng(seed)
    weights = 4.0 + spread * rng.standard_normal(people)
    names, looks, right = [], [], []
    for person, weight in enumerate(weights):
        for _ in range(2):
            w, seen = np.array([weight]), rng.dirichlet(np.ones(3), size=(50, 1))
            guesses = []
            for trial in seen:
                guesses.append(rng.random() < gaze_partner.guess_probabilities(w, trial)[0, 0])
                w = gaze_partner.adapted(w, trial, rate)
            names.append(f"p{person}")
            looks.append(seen[:, 0])
            right.append(guesses)
    return gaze_partner.Reading(tuple(names), np.array(looks), np.ones((2 * people, 50), bool), np.array(right))


@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_a_fit_finds_the_weights_that_were_planted(spread):
    likely = gaze_partner.surface(reading(0.0, spread=spread, people=10))
    found = likely.fit("fixed")
    assert found.rate == 0.0
    assert found.weight == pytest.approx(4.0, abs=0.6 + spread / 2)
    assert abs(found.spread - spread) < 1.2
    assert likely.fit("fixed", alike=True).spread == 0.0


def test_adapting_is_told_from_fixed_people():
    for rate, least, most in ((0.0, -1.0, 3.0), (0.8, 8.0, np.inf)):
        likely = gaze_partner.surface(reading(rate))
        fixed, adapting = likely.fit("fixed"), likely.fit("adapting")
        gain = sum(likely.of(adapting).values()) - sum(likely.of(fixed).values())
        assert least < gain < most
        near = likely.fit("adapting", near=adapting)
        assert near.rate == adapting.rate
    assert adapting.rate > 0.2


def test_trials_that_nobody_knows_say_nothing():
    whole = reading(0.3, people=2)
    half = dataclasses.replace(whole, known=np.arange(50) < np.full((4, 1), 25))
    short = gaze_partner.Reading(whole.people, whole.looks[:, :25], whole.known[:, :25], whole.right[:, :25])
    assert np.array_equal(gaze_partner.surface(half).log_likelihood, gaze_partner.surface(short).log_likelihood)
    with pytest.raises(ValueError, match="no trial's looks are known"):
        gaze_partner.surface(dataclasses.replace(whole, known=np.zeros_like(whole.known)))
