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

    from hrcneuro.analyses.contrasts import ContrastOptions
    from hrcneuro.eeg.contrasts import GroupContrast
    from hrcneuro.eeg.selection import TrialSet


def stratified_contrasts(config: ContrastOptions) -> dict[str, tuple[str, ...]]:
    """Return the contrasts that are computed within strata, too: name -> [plus, minus]."""
    return {
        name: pair
        for name, pair in config.contrasts.items()
        if any(fnmatchcase(name, pattern) for pattern in config.stratified)
    }


def stratified_sets(
    table: pd.DataFrame, sets: list[TrialSet], config: ContrastOptions
) -> tuple[list[TrialSet], list[str]]:
    """Return the strata's sets of trials, and a sentence on what has none.

    Args:
        table: The trial table.
        sets: Those of whole conditions.
        config: The options: contrasts, strata and the least number of trials.
    """
    from hrcneuro.eeg.selection import strata

    contrasts = stratified_contrasts(config)
    if not contrasts or not config.strata:
        return [], []
    lacking = [column for column in config.strata if column not in table or table[column].isna().all()]
    within = strata(table, sets, config.strata, contrasts.values(), at_least=config.min_stratum)
    return within, [f"no strata of {', '.join(lacking)}: no such column, or no value in it"] if lacking else []


def summary(tested: Iterable[GroupContrast], axes: Mapping[str, Iterable[Any]]) -> dict[str, Any]:
    """Return stratum -> contrast -> the contrast as JSON, as :func:`.contrasts.contrast_summary` has it."""
    from hrcneuro.analyses.contrasts import contrast_summary

    summaries: dict[str, Any] = {}
    for one in tested:
        summaries.setdefault(one.scenario, {})[one.name] = contrast_summary(one, axes)
    return summaries
