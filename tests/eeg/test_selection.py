import numpy as np
import pandas as pd
import pytest

from hrcneuro.eeg.selection import nearest_channel, shortest_gap_s, strata, trial_sets

STUDY = pd.DataFrame(
    {
        "event": "move",
        "scenario": ["sC", "iC", "iC", "sC", None],
        "condition_after": ["HH", "HH", "HR", None, "HH"],
        "error": [False, True, False, None, None],
        "soa_s": [0.9, None, 0.7, 0.8, 1.1],
    }
)


def test_sets_are_scenario_by_condition_with_all_first():
    found = trial_sets(
        STUDY, {"HH": "condition_after == 'HH'", "ok": "condition_after == 'HH' and not error"}, split="scenario"
    )
    assert [(c.label, c.n) for c in found] == [
        ("all/HH", 3),
        ("all/ok", 2),  # a missing error counts as none
        ("iC/HH", 1),
        ("iC/ok", 0),
        ("sC/HH", 1),
        ("sC/ok", 1),
    ]
    np.testing.assert_array_equal(found[0].mask, [True, True, False, False, True])


def test_scenarios_partition_the_trials_that_have_one():
    found = {c.scenario: c.n for c in trial_sets(STUDY, {"any": "event == 'move'"}, split="scenario")}
    assert found == {"all": 5, "iC": 2, "sC": 2}


def test_a_foreign_study_has_empty_columns():
    trials = pd.DataFrame({"event": ["square", "rt"], "scenario": [None, None], "error": [None, None]})
    trials["condition_before"] = np.nan
    conditions = {"square": "event == 'square'", "ok": "not error", "HH": "condition_before == 'HH'"}
    assert [(c.label, c.n) for c in trial_sets(trials, conditions, split="scenario")] == [
        ("all/square", 1),
        ("all/ok", 2),
        ("all/HH", 0),
    ]


def test_numbers_may_split():
    trials = pd.DataFrame({"event": ["a", "a", "b"], "block": [2, 1, 2]})
    assert [c.label for c in trial_sets(trials, {"a": "event == 'a'"}, split="block")] == ["all/a", "1/a", "2/a"]


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ("condition_befor == 'HH'", "condition_befor"),
        ("soa_s + 1", "float64 values, not true or false"),
        ("soa_s >", "cannot be evaluated"),
    ],
)
def test_a_bad_query_names_itself(query, told):
    with pytest.raises(ValueError, match=told) as caught:
        trial_sets(STUDY, {"mine": query})
    assert str(caught.value).startswith(f"mine = {query!r} ")


def test_a_split_by_no_column_is_refused():
    with pytest.raises(ValueError, match="'scenaro' is no column"):
        trial_sets(STUDY, {"any": "event == 'move'"}, split="scenaro")


def test_shortest_gap():
    assert shortest_gap_s(STUDY) == 0.7
    assert np.isnan(shortest_gap_s(STUDY[1:2]))
    assert np.isnan(shortest_gap_s(STUDY[["event"]]))


def test_nearest_channel():
    assert nearest_channel("cz", ["Fz", "CZ"]) == "CZ"
    assert nearest_channel("Cz", ["F3", "Oz", "Pz"]) == "Pz"
    assert nearest_channel("Cz", ["A1", "A2"]) == "A1"


def strata_of(table, *, split="scenario", at_least=1, columns=("turn",)):
    conditions = {name: f"case == '{name}'" for name in ("A", "B", "C")}
    return strata(table, trial_sets(table, conditions, split=split), columns, [("A", "B")], at_least=at_least)


def test_strata_hold_both_conditions_of_a_pair_or_neither():
    table = pd.DataFrame(
        {
            "scenario": ["x"] * 6 + ["y"] * 4,
            "case": ["A", "A", "B", "B", "A", "C", "A", "B", "A", "B"],
            "turn": [True, False, True, False, False, True, True, True, False, True],
        }
    )
    found = strata_of(table)
    assert [(c.label, c.n) for c in found] == [
        ("x, turn no/A", 2),
        ("x, turn no/B", 1),
        ("x, turn yes/A", 1),
        ("x, turn yes/B", 1),
        ("y, turn yes/A", 1),
        ("y, turn yes/B", 2),
    ]
    np.testing.assert_array_equal(np.flatnonzero(found[0].mask), [1, 4])
    assert strata_of(table, at_least=2) == []
    assert {c.scenario for c in strata_of(table, split="")} == {"all, turn no", "all, turn yes"}


@pytest.mark.parametrize("values", [[True] * 4, [None] * 4, [True, True, None, None]])
def test_a_column_without_two_values_is_no_stratification(values):
    table = pd.DataFrame({"scenario": "x", "case": list("ABAB"), "turn": values})
    assert strata_of(table) == []
    assert strata_of(table, columns=("mood",)) == []


@pytest.mark.parametrize("query", ["t_f_s < 0.9", "row == 0", "block <= 6", "block < 7 and not error", "kind == 'a'"])
def test_a_column_without_any_value_selects_no_trial(query):
    table = pd.DataFrame(
        {"event": ["a"] * 4, "t_f_s": [None] * 4, "row": np.nan, "block": None, "kind": None, "error": False}
    )
    assert trial_sets(table, {"some": query})[0].n == 0
