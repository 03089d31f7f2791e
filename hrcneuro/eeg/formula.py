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
        values: ndarray, shape (n_trials, n_predictors); NaN throughout where a trial lacks a value.
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


def predictors(formula: str, table: pd.DataFrame) -> Predictors:
    """Return the predictors of each trial.

    Args:
        formula: Right side of a Wilkinson formula.
        table: One row a trial; truth as 0 and 1, what is missing as NaN or None.

    Raises:
        FormulaError: It cannot be read or evaluated.
        AbsentColumnError: The table lacks a column that it names, or all values of one.
        SingularError: Predictors cannot be told apart, or there are fewer trials than predictors.
    """
    import formulaic

    named = columns_of(formula)
    for name in named:
        if name not in table:
            raise AbsentColumnError(f"{formula!r} names the column {name!r}", column=name)
        if table[name].isna().all():
            raise AbsentColumnError(f"{formula!r} names the column {name!r}, which has no value here", column=name)
    known = table[list(named)].notna().all(axis=1).to_numpy(bool)
    rows = table.loc[known, list(named)].reset_index(drop=True)
    try:
        matrix = formulaic.model_matrix(_parsed(formula), rows if len(named) else rows.assign(_=0.0), context={})
        values = np.asarray(matrix, float)
    except Exception as error:  # whatever the expressions in it lead Python to
        raise FormulaError(f"{formula!r} cannot be evaluated: {_plain(error)}") from error
    names = tuple(map(str, matrix.columns))
    if not names:
        raise FormulaError(f"{formula!r} has no predictor")
    if not np.isfinite(values).all():
        broken = names[int(np.argmin(np.isfinite(values).all(axis=0)))]
        raise FormulaError(f"{formula!r}: {broken} is not finite in every trial")
    if dependent := dependencies(names, values):
        raise SingularError(f"{formula!r}: {'; '.join(dependent)}")
    every = np.full((len(table), len(names)), np.nan)
    every[known] = values
    return Predictors(names, every)


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
