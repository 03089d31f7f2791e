"""A problem from folds to scores: what each result says when the truth is known."""

import numpy as np
import pytest

from hrcneuro.decoding import decoders, problem, refusals
from hrcneuro.decoding.scheme import Scheme

SCHEME = Scheme(repeats=2, permutations=0)


def iC_trials(rng: np.random.Generator) -> problem.LabelledTrials:
    """Return labels and cues at the logs' iC counts of RR and RH: 26 and 68 % follow an error."""
    labels = rng.permutation(np.arange(389) < 153)
    prev_error = rng.random(389) < np.where(labels, 0.68, 0.26)
    turn = labels | (rng.random(389) < 0.23)
    return problem.LabelledTrials(
        labels, np.arange(389.0), np.arange(389) // 65, {"prev_error": prev_error, "turn": turn}
    )


def decoded(trials, rows, rng, scheme=SCHEME):
    plan = problem.draw_plan(trials, scheme, rng)
    found = problem.decode(trials, plan, scheme, decoders.rlda(rows, shrinkage=0.9))
    return plan, found, {(s.cue, s.value): s.bacc for s in found.strata}


@pytest.mark.parametrize("truth", ["anticipation", "post_error"])
def test_strata_tell_anticipation_from_a_response_to_the_error(truth):
    plain, strata = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        trials = iC_trials(rng)
        cause = trials.labels if truth == "anticipation" else trials.cues["prev_error"]
        rows = rng.normal(0, 4, (389, 60)) + cause[:, None] * np.where(np.arange(60) < 8, 2.6, 0)
        _, found, by_stratum = decoded(trials, rows, rng)
        plain.append(found.fold_rates.mean()["bacc"])
        strata.append([by_stratum["prev_error", False], by_stratum["prev_error", True]])
    assert np.mean(plain) > 0.58
    if truth == "anticipation":
        assert np.mean(strata) > np.mean(plain) - 0.06
    else:
        assert np.mean(strata) < 0.54


def test_a_stratum_without_both_classes_has_no_figure():
    rng = np.random.default_rng(0)
    trials = iC_trials(rng)
    _, _, by_stratum = decoded(trials, rng.normal(0, 4, (389, 10)), rng)
    assert np.isnan(by_stratum["turn", False])
    assert np.isfinite(by_stratum["turn", True])


def test_label_free_baselines_stand_beside():
    rng = np.random.default_rng(0)
    trials = iC_trials(rng)
    plan, *_ = decoded(trials, rng.normal(0, 4, (389, 10)), rng)
    found = problem.label_free(trials, plan)
    assert found["prev_error_rule_bacc"] == pytest.approx(0.71, abs=0.05)
    assert found["prev_error_fitted_bacc"] == pytest.approx(found["prev_error_rule_bacc"], abs=0.01)
    assert found["turn_fitted_bacc"] > 0.85


def test_block_effects_flatter_random_folds_but_not_blocks():
    # Each block has its own pattern and its own share of takeovers: random folds decode the block.
    rng = np.random.default_rng(1)
    blocks = np.repeat(np.arange(6), 40)
    labels = rng.random(240) < np.array([0.1, 0.9, 0.2, 0.8, 0.3, 0.7])[blocks]
    rows = rng.normal(0, 3, (6, 30))[blocks] + rng.normal(0, 1, (240, 30))
    trials = problem.LabelledTrials(labels, np.arange(240.0), blocks)
    _, found, _ = decoded(trials, rows, rng)
    assert found.fold_rates.mean()["bacc"] > 0.7
    assert found.lobo_bacc < 0.6


def test_the_matched_folds_hold_no_trial_after_an_error():
    rng = np.random.default_rng(0)
    trials = iC_trials(rng)
    plan = problem.draw_plan(trials, SCHEME, rng)
    used = np.concatenate([np.concatenate([s.train, s.test]) for s in plan.matched])
    assert not trials.cues["prev_error"][used].any()


def test_every_decoder_meets_the_same_folds_and_permutations():
    rng = np.random.default_rng(0)
    trials = problem.LabelledTrials(rng.permutation(80) < 30, np.arange(80.0), np.arange(80) // 20)
    scheme = Scheme(folds=5, repeats=1, permutations=9)
    plan = problem.draw_plan(trials, scheme, np.random.default_rng(4))
    again = problem.draw_plan(trials, scheme, np.random.default_rng(4))
    assert all(np.array_equal(a.train, b.train) for a, b in zip(plan.shuffled, again.shuffled, strict=True))
    seen: list[tuple] = []

    def spy(labels, splits):
        seen.append((labels.tobytes(), splits[0].train.tobytes()))
        return [np.zeros(len(s.test)) for s in splits]

    problem.permutation_test(trials, plan, spy)
    first = list(seen)
    seen.clear()
    problem.permutation_test(trials, plan, spy)
    assert seen == first
    assert len(set(first)) == 10
    problem.permutation_test(trials, again, spy)
    assert seen[10:] == first


@pytest.mark.parametrize(
    ("n1", "n2", "note"),
    [
        (40, 2, "the smaller class has 2 trials; at least 3 are needed"),
        (0, 0, "the smaller class has 0 trials"),
        (40, 6, "6 instead of 10 folds: the smaller class has 6 trials"),
    ],
)
def test_too_few_trials_are_noted(n1, n2, note):
    trials = problem.LabelledTrials(np.arange(n1 + n2) < n2, np.arange(n1 + n2, dtype=float), None)
    plan = problem.draw_plan(trials, SCHEME, np.random.default_rng(0))
    assert note in " ".join(plan.fallbacks)
    assert bool(plan.shuffled) == (min(n1, n2) >= 3)


def test_folds_are_drawn_of_no_event_twice():
    trials = problem.LabelledTrials(np.arange(40) < 20, np.repeat(np.arange(20.0), 2) + np.tile([0, 0.05], 20), None)
    with pytest.raises(refusals.TwinTrialsError, match=r"20 trials begin less than 0\.1 s after another"):
        problem.draw_plan(trials, SCHEME, np.random.default_rng(0))
