"""Which trials belong to the configured conditions and scenarios; a mistake in them is said with its cure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hrcneuro.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from hrcneuro.eeg.selection import TrialSet


def trial_sets(table: pd.DataFrame, conditions: Mapping[str, str], split: str) -> list[TrialSet]:
    """Return a set a scenario and condition, as :func:`hrcneuro.eeg.selection.trial_sets` does.

    Raises:
        ConfigError: A query or the split names no column, or a query is no condition.
    """
    from hrcneuro.eeg import selection

    return selection.crossed(matching(table, conditions), scenarios(table, split))


def matching(table: pd.DataFrame, conditions: Mapping[str, str]) -> dict[str, NDArray[np.bool_]]:
    """Return condition -> which trials belong to it, ndarray, shape (n_trials,).

    Raises:
        ConfigError: A query names no column, or is no condition.
    """
    from hrcneuro.eeg import selection

    try:
        return selection.matching(table, conditions)
    except ValueError as error:
        raise ConfigError(
            f"conditions.{error}",
            cure=f"write a comparison, such as \"event == 'square'\", of its columns: {_columns(table)}",
        ) from error


def classes(
    table: pd.DataFrame, conditions: Mapping[str, str], problems: Mapping[str, tuple[str, ...]]
) -> dict[str, NDArray[np.bool_]]:
    """Return condition -> which trials belong to it, for the conditions that decoding problems use.

    Args:
        table: The trial table.
        conditions: Name -> query.
        problems: Name -> [class 1, class 2].

    Raises:
        ConfigError: As :func:`matching` says, or trials belong to both classes of a problem.
    """
    used = {name for pair in problems.values() for name in pair}
    rows = matching(table, {name: query for name, query in conditions.items() if name in used})
    for problem, pair in problems.items():
        both = int((rows[pair[0]] & rows[pair[1]]).sum())
        if both:
            raise ConfigError(
                f"problem {problem}: {both} trials belong to both {pair[0]} and {pair[1]}",
                cure="make the two conditions exclude each other",
            )
    return rows


def absent(
    table: pd.DataFrame, conditions: Mapping[str, str], members: Mapping[str, NDArray[np.bool_]]
) -> dict[str, str]:
    """Return the conditions without a trial, by the option that names them, each with the nearest spelling.

    Args:
        table: The trial table.
        conditions: Name -> query.
        members: What :func:`matching` returned.
    """
    empty = {name: conditions[name] for name, mask in members.items() if not mask.any()}
    return {
        f"conditions.{name}": f"the condition {name} = {query!r}{_nearest(table, query)}"
        for name, query in empty.items()
    }


def _nearest(table: pd.DataFrame, query: str) -> str:
    """Return a question after the value that a query may have meant: one of a column that it compares with a text."""
    for column, _, text in re.findall(r"(\w+)\s*==\s*(['\"])(.*?)\2", query):
        have = [str(value) for value in table[column].dropna().unique()] if column in table else []
        if text not in have and (hint := did_you_mean(text, have)):
            return hint
    return ""


def scenarios(table: pd.DataFrame, split: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return each value of the column ``split``, sorted, and which trials have it; none where ``split`` is empty.

    Raises:
        ConfigError: The split names no column.
    """
    from hrcneuro.eeg import selection

    try:
        return selection.scenarios(table, split)
    except ValueError as error:
        raise ConfigError(
            f"study.split = {error}{did_you_mean(split, map(str, table.columns))}",
            cure=f"use one of {_columns(table)}, or leave it empty",
        ) from error


def _columns(table: pd.DataFrame) -> str:
    return ", ".join(map(str, table.columns))
