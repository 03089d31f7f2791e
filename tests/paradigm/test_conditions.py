"""Conditions by the definitions of the paper's Table 1, and the published numbers on the real logs."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.paradigm.conditions import CASES, annotate, count_pairs, matched, no_previous_error


def table(actors, errors, *, targets=None, practice=False, episode=None, onset_s=None):
    n = len(actors)
    data = {
        "scenario": "iC",
        "practice": practice,
        "block": 1,
        "episode": episode or [1] * n,
        "actor": [{"H": "human", "R": "robot"}[a] for a in actors],
        "error": [e == "x" for e in errors],
        "target": targets or ["N"] * n,
    }
    return pd.DataFrame(data | ({} if onset_s is None else {"onset_s": onset_s}))


def test_cases_and_conditions_of_a_short_episode():
    out = annotate(table("HRRHH", "..x.."))
    assert out["case"].tolist() == [None, "HR", "RR", "RH", "HH"]
    assert out["condition_before"].tolist() == ["HR", "RR", None, "HH", None]
    assert out["condition_after"].tolist() == [None, "HR", "RR", None, "HH"]
    assert out["prev_error"].tolist() == [False, False, False, True, False]


def test_pairs_do_not_cross_episodes_or_blocks_and_practice_counts_none():
    out = annotate(table("HRHR", "....", episode=[1, 1, 2, 2]))
    assert out["condition_before"].tolist() == ["HR", None, "HR", None]
    assert out["case"].tolist() == [None, "HR", None, "HR"]
    practice = annotate(table("HR", "..", practice=True))
    assert practice["case"].tolist() == [None, "HR"]
    assert practice["condition_before"].tolist() == practice["condition_after"].tolist() == [None, None]


def test_an_error_before_an_episodes_first_move_is_not_its_previous_error():
    out = annotate(table("HR", "x.", episode=[1, 2]))
    assert not out["prev_error"].any()


def test_turn_and_soa_look_ahead_within_the_episode():
    out = annotate(table("HRH", "...", targets=["N", "E", "E"], onset_s=[1.0, 1.75, 2.75]))
    assert out["turn"].tolist() == [True, False, False]
    np.testing.assert_array_equal(out["soa_s"], [0.75, 1.0, np.nan])
    assert annotate(table("HR", ".."))["soa_s"].isna().all()


def test_several_subjects_in_one_table_do_not_mix():
    both = pd.concat([table("H", ".").assign(subject="s01"), table("R", ".").assign(subject="s02")])
    assert annotate(both)["case"].tolist() == [None, None]


def test_an_empty_table_and_an_input_left_as_it_was():
    trials = table("HRH", "...")
    copy = trials.copy()
    assert len(annotate(trials.iloc[:0])) == 0
    annotate(trials)
    pd.testing.assert_frame_equal(trials, copy)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from("HR"), st.sampled_from(".x"), st.booleans(), st.booleans()), max_size=40),
)
def test_the_fast_columns_equal_a_plain_loop(rows):
    actors, errors = "".join(r[0] for r in rows), "".join(r[1] for r in rows)
    episode = np.cumsum([r[2] for r in rows]).tolist()
    trials = table(actors, errors, episode=episode, practice=[r[3] for r in rows])
    trials["practice"] = trials.groupby("episode")["practice"].transform("first").astype(bool)
    out = annotate(trials)
    for i in range(len(rows)):
        follows = i > 0 and episode[i] == episode[i - 1]
        pair = follows and errors[i - 1] == "." and not trials["practice"][i]
        assert out["case"][i] == (actors[i - 1] + actors[i] if follows else None)
        assert out["condition_after"][i] == (out["case"][i] if pair else None)
        assert out["prev_error"][i] == (follows and errors[i - 1] == "x")
        if i:
            assert out["condition_before"][i - 1] == out["condition_after"][i]
    assert annotate(out).equals(out)


def test_the_logs_give_the_published_trial_counts(logs):
    counts = {subject: count_pairs(trials) for subject, trials in logs.items()}
    total = pd.DataFrame({subject: count.sum() for subject, count in counts.items() if subject != "s07"})
    assert total.mean(axis=1).round(1).to_dict() == {"HH": 610.8, "HR": 148.4, "RR": 530.2, "RH": 212.5}
    assert total.std(axis=1).round(1).to_dict() == {"HH": 42.8, "HR": 14.0, "RR": 25.5, "RH": 22.0}
    assert counts["s01"].loc["sC", list(CASES)].tolist() == [351, 67, 278, 47]
    assert counts["s01"].loc["iC", list(CASES)].tolist() == [302, 70, 224, 130]


@pytest.mark.parametrize(
    ("subset", "expected"),
    [
        (no_previous_error, {"RR": (174, 21), "RH": (49, 8)}),
        (matched, {"RR": (30, 8), "RH": (49, 8), "HH": (27, 9), "HR": (84, 10)}),
    ],
)
def test_the_matched_subsets_of_ic_have_the_sizes_of_notes_md(logs, subset, expected):
    counts = pd.DataFrame({s: count_pairs(t[subset(t)]).loc["iC"] for s, t in logs.items() if s != "s07"})
    for case, (mean, sd) in expected.items():
        assert counts.loc[case].mean() == pytest.approx(mean, abs=0.51)
        assert counts.loc[case].std() == pytest.approx(sd, abs=0.51)


def test_after_conditions_without_errors_have_the_sizes_of_notes_md(logs):
    good = pd.DataFrame({s: t[~t["error"]]["condition_after"].value_counts() for s, t in logs.items() if s != "s07"})
    assert good.mean(axis=1).round().to_dict() == {"HH": 430, "HR": 104, "RR": 378, "RH": 147}
