"""Formulas on a table: the predictors they make, what is unknown in them, and what cannot be told apart."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.eeg.formula import AbsentColumnError, FormulaError, SingularError, columns_of, predictors


def table():
    return pd.DataFrame(
        {
            "actor": ["human", "robot", "robot", "human", "robot", "human"],
            "takeover": [0.0, 1, 0, 1, np.nan, 0],
            "soa": [0.1, -0.3, 0.2, 0.0, np.nan, 0.5],
            "empty": [None] * 6,
        }
    )


def test_predictors_are_what_the_formula_says():
    made = predictors("actor / takeover + soa", table())
    assert made.names == ("Intercept", "actor[T.robot]", "soa", "actor[human]:takeover", "actor[robot]:takeover")
    robot, takeover = np.array([0, 1, 1, 0, 1, 0]), np.array([0, 1, 0, 1, np.nan, 0])
    known = [0, 1, 2, 3, 5]
    np.testing.assert_array_equal(made.values[:, 1], robot)
    np.testing.assert_array_equal(made.values[known, 3], ((1 - robot) * takeover)[known])
    np.testing.assert_array_equal(made.values[known, 4], (robot * takeover)[known])


def test_only_what_is_made_of_a_missing_value_is_unknown():
    made = predictors("actor / takeover + soa", table())
    assert np.isnan(made.values[4]).tolist() == [False, False, True, True, True]
    assert made.known.tolist() == [True, True, True, True, False, True]


def test_other_rows_neither_make_levels_nor_count_as_trials():
    more = pd.concat([table(), pd.DataFrame({"actor": ["ghost", "robot"], "takeover": [1.0, 1], "soa": [0, 0]})])
    fitted = np.arange(8) < 6
    made = predictors("actor + takeover", more, fitted)
    assert made.names == ("Intercept", "actor[T.robot]", "takeover")
    assert np.isnan(made.values[6]).tolist() == [False, True, False]
    assert made.values[7].tolist() == [1, 1, 1]
    with pytest.raises(SingularError, match="takeover is 0 in every trial"):
        predictors("takeover", more.assign(takeover=[0.0] * 6 + [1, 1]), fitted)


def test_inflation_is_one_of_unrelated_predictors_and_that_of_r_squared_of_others():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 500))
    frame = pd.DataFrame({"a": a, "b": b, "c": a + 0.5 * b + 0.3 * rng.standard_normal(500)})
    for formula, name in (("a + b", "a"), ("a + b + c", "c")):
        made = predictors(formula, frame)
        own = made.names.index(name)
        rest = np.delete(made.values, own, axis=1)
        fit = rest @ np.linalg.lstsq(rest, made.values[:, own], rcond=None)[0]
        r2 = 1 - np.var(made.values[:, own] - fit) / np.var(made.values[:, own])
        assert made.inflation[own] == pytest.approx(1 / (1 - r2))
        assert np.isnan(made.inflation[0])


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("actor + I(2 * soa) + soa", r"soa = 0\.5 I\(2 \* soa\)"),
        ("takeover + I(1 - takeover)", r"I\(1 - takeover\) = Intercept - takeover"),
        ("actor * takeover * soa", "5 trials cannot tell 8 predictors apart"),
        ("actor + I(takeover * 0)", r"I\(takeover \* 0\) is 0 in every trial"),
    ],
)
def test_predictors_that_cannot_be_told_apart_are_named(formula, words):
    with pytest.raises(SingularError, match=words):
        predictors(formula, table())


def test_columns_that_are_not_there_or_hold_nothing_are_named():
    for name in ("turn", "empty"):
        with pytest.raises(AbsentColumnError, match=f"'{name}'") as caught:
            predictors(f"actor + {name}", table())
        assert caught.value.column == name


@pytest.mark.parametrize("formula", ["actor +", "soa ~ actor", "actor | soa", "(actor", "actor = soa"])
def test_what_is_no_right_side_of_a_formula_is_refused(formula):
    with pytest.raises(FormulaError, match=r"cannot be read|more than the right side"):
        columns_of(formula)


@pytest.mark.parametrize("formula", ["np.log(soa)", "nothing(soa)", "soa - 1 - soa"])
def test_what_cannot_be_evaluated_is_refused(formula):
    with pytest.raises((FormulaError, AbsentColumnError)), np.errstate(all="ignore"):
        predictors(formula, table())


def test_columns_are_those_that_a_formula_names():
    assert columns_of("actor / takeover + np.log(soa_s) + {soa ** 2}") == ("actor", "soa", "soa_s", "takeover")
