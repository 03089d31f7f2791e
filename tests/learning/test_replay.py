import numpy as np
import pytest
from scipy.special import expit

from hrcneuro.learning.rates import Rates, case
from hrcneuro.learning.replay import DecodedRepeat, HeldOutTrials, Replay, calibrated, mean_rates
from hrcneuro.learning.task import JointTask, actors, draw, previous_actors


def _held_out(rng, n1, n2, separation, threshold=0.0):
    label = rng.permutation(np.repeat([0, 1], [n1, n2]))
    score = rng.normal(size=n1 + n2) * 3 + separation * (label - 0.5) * 3 - threshold
    return HeldOutTrials(label, score, np.arange(n1 + n2) // 20)


@pytest.fixture(scope="module")
def repeats():
    rng = np.random.default_rng(0)
    return [DecodedRepeat(_held_out(rng, 236, 153, d), _held_out(rng, 276, 87, d / 2)) for d in (0.2, 0.6, 1.0)]


def _run(decoder, episodes=300, repetitions=60, seed=1, **options):
    rng = np.random.default_rng(seed)
    draws = draw(JointTask(episodes=episodes, carry_over=True), repetitions, rng)
    acting = actors(draws)
    before = previous_actors(acting, carry_over=True)
    return acting, before, case(before, acting), decoder.answer(draws, rng, **options)


def test_replayed_rates_are_the_recorded_ones(repeats):
    for repeat in repeats:
        acting, _, now, answers = _run(Replay([repeat]))
        right = answers.predicted == acting
        scored = [100 * right[now == which].mean() for which in (0, 1, 2, 3)]
        assert scored == pytest.approx(repeat.rates().by_case, abs=1.0)
    assert mean_rates(repeats).by_case == pytest.approx(np.mean([s.rates().by_case for s in repeats], axis=0))


def test_trials_of_a_case_come_in_recorded_order():
    n = 30
    label = np.tile([0, 1], n // 2)
    trials = HeldOutTrials(label, np.where(np.arange(n) % 4 < 2, -1.0, 1.0) * (1 + np.arange(n)), np.arange(n) // 6)
    replay = Replay([DecodedRepeat(trials, trials)])
    _, _, now, answers = _run(replay, episodes=8, repetitions=5)
    for which, wanted in ((0, 0), (1, 1), (2, 1), (3, 0)):
        taken = (trials.score > 0)[label == wanted]  # takeover yes, no, yes …
        for r in range(5):
            before = which >= 2
            said = (answers.predicted[..., r].ravel() != before)[now[..., r].ravel() == which]
            doubled = np.tile(taken, 30)
            assert any((said == doubled[k : k + len(said)]).all() for k in range(len(taken)))


def test_log_odds_are_calibrated(repeats):
    rng = np.random.default_rng(5)
    known, new = _held_out(rng, 2000, 700, 0.8, threshold=1.0), _held_out(rng, 60_000, 60_000, 0.8, threshold=1.0)
    odds = calibrated(known, new.score)
    np.testing.assert_allclose(np.mean(expit(odds)[new.label == 1]), 0.5 + 0.5 * np.tanh(0.16), atol=0.03)
    for low in (0.2, 0.4, 0.6):
        some = (expit(odds) > low) & (expit(odds) < low + 0.2)
        assert new.label[some].mean() == pytest.approx(expit(odds)[some].mean(), abs=0.03)
    _, before, _, answers = _run(Replay(repeats[2:]), evidence=True)
    acting = _run(Replay(repeats[2:]), evidence=True)[0]
    # Human's odds: on average positive where the human acts, whoever acted before.
    for was in (False, True):
        assert answers.graded[(before == was) & acting].mean() > answers.graded[(before == was) & ~acting].mean()
        assert answers.decision[(before == was) & acting].mean() > answers.decision[(before == was) & ~acting].mean()


@pytest.mark.parametrize("number", [[0, 1, 2, 3], [1, 3, 5, 7], [2, 4, 8, 10]])
def test_log_odds_come_from_every_other_block_however_blocks_are_numbered(number):
    drawn = _held_out(np.random.default_rng(7), 40, 40, 0.4)
    trials = HeldOutTrials(drawn.label, drawn.score, np.array(number)[drawn.block])
    second = drawn.block % 2 == 1
    halves = [HeldOutTrials(trials.label[half], trials.score[half], trials.block[half]) for half in (second, ~second)]
    odds = [calibrated(halves[i], halves[1 - i].score) for i in (0, 1)]
    answers = _run(Replay([DecodedRepeat(trials, trials)]), episodes=20, repetitions=10, evidence=True)[3]
    assert set(np.abs(answers.graded).ravel().tolist()) == set(np.abs(np.concatenate(odds)).tolist())


def test_a_single_block_is_calibrated_on_itself():
    rng = np.random.default_rng(3)
    one = _held_out(rng, 60, 60, 0.8)
    trials = HeldOutTrials(one.label, one.score, np.full(120, 5))
    answers = _run(Replay([DecodedRepeat(trials, trials)]), episodes=4, repetitions=6, evidence=True)[3]
    assert np.isin(np.abs(answers.graded), np.abs(calibrated(trials, trials.score))).all()


def test_scores_without_spread_say_nothing():
    trials = HeldOutTrials(np.array([0, 1, 0, 1]), np.zeros(4), np.arange(4))
    assert calibrated(trials, trials.score).tolist() == [0, 0, 0, 0]
    Replay([DecodedRepeat(trials, trials)])


def test_a_class_without_trials_is_refused():
    good = HeldOutTrials(np.array([0, 1]), np.array([-1.0, 1.0]), np.array([0, 1]))
    with pytest.raises(ValueError, match="after a human's action hold 2 takeovers of 2"):
        DecodedRepeat(good, HeldOutTrials(np.array([1, 1]), np.array([1.0, 1.0]), np.array([0, 1])))
    assert DecodedRepeat(good, good).rates() == Rates.level(100)
