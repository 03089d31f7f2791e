"""What erp and ersp share to compute contrasts again within strata: is a difference one of what went before?

In the study's iC most takeovers follow an error and all are turns (docs/confound.md): within trials that are alike in
that, a difference cannot stem from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.eeg.contrasts import Tested
    from hrcneuro.eeg.selection import Cell


def chosen(config: Any) -> dict[str, tuple[str, ...]]:
    """Return the contrasts that are stratified."""
    return {
        name: pair
        for name, pair in config.contrasts.items()
        if any(fnmatchcase(name, pattern) for pattern in config.stratified)
    }


def cells(table: pd.DataFrame, found: list[Cell], config: Any) -> tuple[list[Cell], list[str]]:
    """Return the strata's cells, and a sentence on what has none.

    Args:
        table: The trial table.
        found: The cells that are stratified.
        config: The options: contrasts, strata and the least number of trials.
    """
    from hrcneuro.eeg.selection import strata

    contrasts = chosen(config)
    if not contrasts or not config.strata:
        return [], []
    lacking = [column for column in config.strata if column not in table or table[column].isna().all()]
    made = strata(table, found, config.strata, contrasts.values(), at_least=config.min_stratum)
    return made, [f"no strata of {', '.join(lacking)}: no such column, or no value in it"] if lacking else []


def summary(tested: Iterable[Tested], axes: Mapping[str, Iterable[Any]]) -> dict[str, Any]:
    """Return stratum -> contrast -> the contrast as JSON, as :func:`.group_contrasts.contrast_summary`."""
    from hrcneuro.analyses.contrasts import contrast_summary

    found: dict[str, Any] = {}
    for one in tested:
        found.setdefault(one.scenario, {})[one.name] = contrast_summary(one, axes)
    return found
