"""What the real logs predict without any EEG, and the chance level at their counts (skipped where they are absent)."""

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hrcneuro.decoding import baselines, chance, crossval, metrics

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"
SUBJECTS = [f"s{i:02d}" for i in range(1, 13) if i != 7]
PROBLEMS = {"HHvsHR": ("HH", "HR"), "RRvsRH": ("RR", "RH")}


@cache
def trials() -> dict[str, pd.DataFrame]:
    if not LOGS.is_dir():
        pytest.skip(f"the study's logs are not at {LOGS}")
    from hrcneuro.paradigm.conditions import annotate
    from hrcneuro.sources.logs import read_log

    found = {subject: read_log(LOGS, subject) for subject in SUBJECTS}
    return {s: t if "condition_before" in t else annotate(t) for s, t in found.items()}


def classes(subject: str, scenario: str, problem: str) -> tuple[pd.DataFrame, np.ndarray]:
    table = trials()[subject]
    pair = PROBLEMS[problem]
    rows = table[(table["scenario"] == scenario) & table["condition_before"].isin(pair)]
    return rows, (rows["condition_before"] == pair[1]).to_numpy(dtype=bool)


def rule(cue: str, scenario: str, problem: str) -> np.ndarray:
    found = []
    for subject in SUBJECTS:
        rows, labels = classes(subject, scenario, problem)
        found.append(100 * baselines.rule_bacc(rows[cue].to_numpy(dtype=bool), labels))
    return np.array(found)


def test_the_chance_level_is_the_printed_one():
    levels = [
        100 * chance.chance_level(len(classes(s, scenario, problem)[1]))
        for s in SUBJECTS
        for scenario in ("sC", "iC")
        for problem in PROBLEMS
    ]
    assert len(levels) == 44
    assert np.mean(levels) == pytest.approx(54.27, abs=0.005)


@pytest.mark.parametrize(
    ("cue", "scenario", "problem", "percent"),
    [
        # docs/confound.md prints them.
        ("prev_error", "iC", "RRvsRH", 70.8),
        ("prev_error", "iC", "HHvsHR", 38.0),
        ("prev_error", "sC", "RRvsRH", 48.2),
        ("prev_error", "sC", "HHvsHR", 44.3),
        ("turn", "iC", "RRvsRH", 88.7),
        ("turn", "iC", "HHvsHR", 89.2),
        ("turn", "sC", "RRvsRH", 49.9),
        ("turn", "sC", "HHvsHR", 46.3),
    ],
)
def test_rules_that_never_look_at_eeg(cue, scenario, problem, percent):
    assert rule(cue, scenario, problem).mean() == pytest.approx(percent, abs=0.06)


@pytest.mark.parametrize(
    ("scenario", "problem", "percent"),
    [("iC", "RRvsRH", 60.5), ("iC", "HHvsHR", 76.0), ("sC", "RRvsRH", 83.2), ("sC", "HHvsHR", 84.4)],
)
def test_how_often_the_actor_stays(scenario, problem, percent):
    shares = [100 * (1 - classes(subject, scenario, problem)[1].mean()) for subject in SUBJECTS]
    assert np.mean(shares) == pytest.approx(percent, abs=0.06)


def test_the_spread_over_subjects():
    assert rule("prev_error", "iC", "RRvsRH").std(ddof=1) == pytest.approx(3.9, abs=0.05)


def test_fitted_in_the_training_folds_it_predicts_as_well():
    found = []
    for subject in SUBJECTS:
        rows, labels = classes(subject, "iC", "RRvsRH")
        rng = np.random.default_rng(int(subject[1:]))
        splits = crossval.shuffled_splits(labels, n_folds=10, n_repeats=2, how="undersample", rng=rng)
        scores = baselines.fitted_scores(rows["prev_error"].to_numpy(dtype=int), labels, splits)
        found.append(100 * metrics.fold_rates(labels, splits, scores).mean()["bacc"])
    assert np.mean(found) == pytest.approx(70.8, abs=0.4)


def test_a_fitted_rule_learns_its_sign():
    labels = np.arange(60) % 2 == 0
    splits = crossval.shuffled_splits(labels, n_folds=5, n_repeats=1, how="none", rng=np.random.default_rng(0))
    scores = baselines.fitted_scores((~labels).astype(int), labels, splits)
    assert all(np.array_equal(s > 0, labels[split.test]) for s, split in zip(scores, splits, strict=True))


def test_a_useless_cue_is_at_fifty():
    labels = np.arange(60) % 2 == 0
    splits = crossval.shuffled_splits(labels, n_folds=5, n_repeats=1, how="none", rng=np.random.default_rng(0))
    scores = baselines.fitted_scores(np.zeros(60, dtype=int), labels, splits)
    assert metrics.fold_rates(labels, splits, scores).mean()["bacc"] == 0.5
