"""Wilkinson formulas on the trial table: the columns they name, the predictors they make, which cannot be told apart.

``actor / takeover + error + soa`` and the like, read by formulaic; an intercept is there unless ``- 1`` takes it away.
Source of the notation: Wilkinson & Rogers 1973, doi:10.2307/2346786.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.refusals import Refusal

Floats = NDArray[np.float64]

# Of a column's length, what may be left of it beside the others and still be rounding.
_ROUNDING = 1e-8


class FormulaError(Refusal):
    """A formula cannot be read, or not be evaluated on the table."""


class AbsentColumnError(Refusal):
    """A formula names a ``column`` that the table lacks, or that has no value in it."""


class SingularError(Refusal):
    """Predictors cannot be told apart."""


@dataclass(frozen=True)
class Predictors:
    """The predictors that a formula makes of a trial table.

    Attributes:
        names: Of the columns, as formulaic names them: ``Intercept``, ``actor[T.robot]``, ``actor[robot]:takeover``.
        values: ndarray, shape (n_trials, n_predictors); NaN where a trial lacks what the predictor is made of.
    """

    names: tuple[str, ...]
    values: Floats

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which trials have all values, ndarray, shape (n_trials,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    @property
    def inflation(self) -> Floats:
        """Return each coefficient's variance inflation factor, ndarray, shape (n_predictors,).

        1 where a predictor has nothing to do with the others; NaN of the intercept.
        """
        rows = self.values[self.known]
        constant = np.ptp(rows, axis=0) == 0
        found = np.full(len(self.names), np.nan)
        found[~constant] = np.diag(np.linalg.pinv(np.atleast_2d(np.corrcoef(rows[:, ~constant].T))))
        return found


def columns_of(formula: str) -> tuple[str, ...]:
    """Return the columns that a formula names, sorted.

    Raises:
        FormulaError: It cannot be read, has a left side, or consists of several.
    """
    return tuple(sorted(map(str, _parsed(formula).required_variables)))


def predictors(formula: str, table: pd.DataFrame, fitted: NDArray[np.bool_] | None = None) -> Predictors:
    """Return the predictors of each trial.

    Args:
        formula: Right side of a Wilkinson formula.
        table: One row a trial; truth as 0 and 1, what is missing as NaN or None.
        fitted: Which rows are fitted, ndarray, shape (n_trials,), all where nothing is said: the others have a value in
            no column of words that these do not have.

    Raises:
        FormulaError: It cannot be read or evaluated.
        AbsentColumnError: The table lacks a column that it names, or all values of one.
        SingularError: Predictors cannot be told apart, or there are fewer trials than predictors.
    """
    import formulaic

    named = columns_of(formula)
    fitted = np.ones(len(table), bool) if fitted is None else fitted
    for name in named:
        if name not in table:
            raise AbsentColumnError(f"{formula!r} names the column {name!r}", column=name)
        if table.loc[fitted, name].isna().all():
            raise AbsentColumnError(f"{formula!r} names the column {name!r}, which has no value here", column=name)
    rows, missing = _filled(table[list(named)].reset_index(drop=True), fitted)
    try:
        matrix = formulaic.model_matrix(_parsed(formula), rows if len(named) else rows.assign(_=0.0), context={})
        values = np.array(matrix, float)
    except Exception as error:  # whatever the expressions in it lead Python to
        raise FormulaError(f"{formula!r} cannot be evaluated: {_plain(error)}") from error
    names = tuple(map(str, matrix.columns))
    if not names:
        raise FormulaError(f"{formula!r} has no predictor")
    if not np.isfinite(values).all():
        broken = names[int(np.argmin(np.isfinite(values).all(axis=0)))]
        raise FormulaError(f"{formula!r}: {broken} is not finite in every trial")
    spec = matrix.model_spec
    for term, columns in spec.term_slices.items():
        for name in set(map(str, spec.term_variables[term])) & set(named):
            values[missing[name], columns] = np.nan
    known = np.isfinite(values).all(axis=1) & fitted
    if dependent := dependencies(names, values[known]):
        raise SingularError(f"{formula!r}: {'; '.join(dependent)}")
    return Predictors(names, values)


def _filled(rows: pd.DataFrame, fitted: NDArray[np.bool_]) -> tuple[pd.DataFrame, dict[str, NDArray[np.bool_]]]:
    """Return the rows with some value where one is missing, and where that is, by column."""
    missing = {}
    for name in map(str, rows):
        column = rows[name]
        lacking = column.isna().to_numpy(bool)
        if not pd.api.types.is_numeric_dtype(column):
            lacking = lacking | ~column.isin(column[fitted & ~lacking]).to_numpy(bool)
        missing[name] = lacking
        rows = rows.assign(**{name: column.mask(lacking, column[fitted & ~lacking].iloc[0]).infer_objects()})
    return rows, missing


def dependencies(names: tuple[str, ...], values: Floats) -> list[str]:
    """Return a sentence on each predictor that the ones before it determine, so that its coefficient could be anything.

    Args:
        names: Of the columns.
        values: ndarray, shape (n_trials, n_predictors).
    """
    if len(values) < len(names):
        return [f"{len(values)} trials cannot tell {len(names)} predictors apart ({', '.join(names)})"]
    sentences = []
    free: list[int] = []
    for i, name in enumerate(names):
        column = values[:, i]
        length = float(np.sqrt(column @ column))
        if length == 0:
            sentences.append(f"{name} is 0 in every trial")
            continue
        before = values[:, free]
        weights = np.linalg.lstsq(before, column, rcond=None)[0] if free else np.zeros(0)
        rest = column - before @ weights
        if float(np.sqrt(rest @ rest)) > _ROUNDING * length:
            free.append(i)
            continue
        parts = [(weight, names[k]) for weight, k in zip(weights, free, strict=True) if abs(weight) > 1e-6]
        sentences.append(f"{name} = {' '.join(_term(w, part, first=k == 0) for k, (w, part) in enumerate(parts))}")
    return sentences


def _term(weight: float, name: str, *, first: bool) -> str:
    sign = ("-" if weight < 0 else "") if first else ("- " if weight < 0 else "+ ")
    size = "" if abs(abs(weight) - 1) < 1e-6 else f"{abs(weight):.4g} "
    return f"{sign}{size}{name}"


def _parsed(formula: str) -> Any:
    import formulaic

    try:
        parsed = formulaic.Formula(formula)
    except Exception as error:  # its parser has many errors
        raise FormulaError(f"{formula!r} cannot be read: {_plain(error)}") from error
    if not isinstance(parsed, formulaic.SimpleFormula):
        raise FormulaError(f"{formula!r} is more than the right side of one formula: leave out '~' and '|'")
    return parsed


def _plain(error: Exception) -> str:
    """Return the first line of an error, without the colours that formulaic puts into its words."""
    return str(error).strip().split("\n", 1)[0].rstrip(".")
