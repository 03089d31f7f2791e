"""Mistakes in the configured conditions and scenarios, as people read them."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses.conditions import absent, matching, scenarios, trial_sets
from hrcneuro.errors import ConfigError

STUDY = pd.DataFrame({"event": "move", "scenario": ["sC", "iC", "iC"], "soa_s": [0.9, None, 0.7]})


@pytest.mark.parametrize(
    ("query", "problem"),
    [
        ("condition_befor == 'HH'", "condition_befor"),
        ("soa_s + 1", "gives float64 values, not true or false a trial"),
        ("soa_s >", "cannot be evaluated on the trial table"),
    ],
)
def test_a_bad_query_names_its_option_and_the_columns(query, problem):
    with pytest.raises(ConfigError, match=problem) as caught:
        trial_sets(STUDY, {"mine": query}, "")
    assert caught.value.problem.startswith(f"conditions.mine = {query!r} ")
    assert "event, scenario, soa_s" in caught.value.cure
    assert "event == 'square'" in caught.value.cure


def test_a_misspelt_split_names_its_option_and_is_corrected():
    with pytest.raises(ConfigError, match="did you mean 'scenario'") as caught:
        scenarios(STUDY, "scenaro")
    assert caught.value.problem.startswith("study.split = 'scenaro' is no column of the trial table")
    assert "event, scenario, soa_s" in caught.value.cure


def test_what_is_right_gives_the_sets():
    sets = trial_sets(STUDY, {"any": "event == 'move'"}, "scenario")
    assert {one.label: one.n for one in sets} == {"all/any": 3, "iC/any": 2, "sC/any": 1}
    np.testing.assert_array_equal(sets[1].mask, [False, True, True])


def test_a_condition_without_a_trial_is_told_with_the_value_that_it_may_have_meant():
    queries = {"all": "event == 'move'", "slip": "event == 'mvoe'", "never": "soa_s > 5 and scenario == 'iC'"}
    said = absent(STUDY, queries, matching(STUDY, queries))
    assert set(said) == {"conditions.slip", "conditions.never"}
    assert "(did you mean 'move'?)" in said["conditions.slip"]
    assert "did you mean" not in said["conditions.never"]
