"""Which trials an average is made of: conditions are queries on the trial table, scenarios the values of a column."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

if TYPE_CHECKING:
    import mne

FLAGS = frozenset({"practice", "error", "key_wrong", "prev_error", "turn"})
"""The trial table's columns of true and false, which a query may negate even where a study does not have them."""

ALL = "all"
"""The scenario that holds every trial."""


@dataclass(frozen=True)
class TrialSet:
    """The trials of one condition in one scenario, or in one stratum of it.

    Attributes:
        scenario: ``all``, a value of the column that splits the trials, or a stratum's label.
        condition: Name of the condition.
        mask: Which trials it holds, ndarray, shape (n_epochs,).
    """

    scenario: str
    condition: str
    mask: NDArray[np.bool_]

    @property
    def n(self) -> int:
        """Number of trials."""
        return int(self.mask.sum())

    @property
    def label(self) -> str:
        """The set's name in files: ``all/RH_before``."""
        return f"{self.scenario}/{self.condition}"


@dataclass(frozen=True)
class LabelledEpochs:
    """A subject's epochs with the trial table that says what each of them is.

    Attributes:
        data: ndarray, shape (n_epochs, n_channels, n_times), µV; floating point of the precision that was asked for.
        onsets: Sample of each onset in the continuous recording, ndarray, shape (n_epochs,).
        times: Time of each sample from the onset, ndarray, shape (n_times,), s.
        info: The channels.
        table: One row an epoch.
    """

    data: NDArray[Any]
    onsets: NDArray[np.integer]
    times: NDArray[np.float64]
    info: mne.Info
    table: pd.DataFrame


def trial_sets(trials: pd.DataFrame, conditions: Mapping[str, str], *, split: str = "") -> list[TrialSet]:
    """Return a set a scenario and condition, empty ones included, scenario ``all`` first.

    Args:
        trials: The trial table, one row an epoch.
        conditions: Name -> pandas query on the table's columns.
        split: The column whose values are the other scenarios; without any value there is only ``all``.

    Raises:
        ValueError: A query or the split names no column, or a query is no condition.
    """
    return crossed(matching(trials, conditions), scenarios(trials, split))


def crossed(
    members: Mapping[str, NDArray[np.bool_]], scenarios: Sequence[tuple[str, NDArray[np.bool_]]]
) -> list[TrialSet]:
    """Return a set of each condition among all trials, then among those of each scenario.

    Args:
        members: What :func:`matching` returned.
        scenarios: What :func:`scenarios` returned.
    """
    every = [TrialSet(ALL, name, mask) for name, mask in members.items()]
    return every + [TrialSet(place, name, mask & here) for place, here in scenarios for name, mask in members.items()]


def matching(trials: pd.DataFrame, conditions: Mapping[str, str]) -> dict[str, NDArray[np.bool_]]:
    """Return condition -> which trials belong to it, ndarray, shape (n_epochs,).

    Arguments and errors are those of :func:`trial_sets`.
    """
    table = _with_booleans(trials)
    return {name: _matching(table, name, query) for name, query in conditions.items()}


def scenarios(trials: pd.DataFrame, split: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return each value of the column ``split``, sorted, and which trials have it; none where ``split`` is empty.

    Raises:
        ValueError: The split names no column.
    """
    if not split:
        return []
    if split not in trials:
        raise ValueError(f"{split!r} is no column of the trial table")
    column = trials[split]
    values = sorted(column.dropna().unique(), key=str)
    return [(str(value), (column == value).to_numpy(bool)) for value in values]


def strata(
    trials: pd.DataFrame,
    sets: Sequence[TrialSet],
    columns: Iterable[str],
    pairs: Iterable[tuple[str, ...]],
    *,
    at_least: int,
) -> list[TrialSet]:
    """Return the sets of pairs of conditions among the trials with one value of a column: of each, or of neither.

    A stratum's scenario is ``iC, prev_error yes``. Where the trials are split into scenarios, those are stratified, not
    all trials together. A column without two values among a pair's trials is no stratification of it.

    Args:
        trials: The trial table, one row an epoch.
        sets: What :func:`trial_sets` returned.
        columns: Columns of the table; those that it lacks, or that hold nothing, give no set.
        pairs: Names of two conditions that are compared.
        at_least: Trials that each of the two must have.
    """
    masks_of = {(one.scenario, one.condition): one.mask for one in sets}
    names = list(dict.fromkeys(one.scenario for one in sets))
    made: dict[str, TrialSet] = {}
    for scenario in [s for s in names if s != ALL] or names:
        for column in columns:
            values = trials[column] if column in trials else pd.Series([None] * len(trials), dtype=object)
            for pair in pairs:
                masks = [masks_of.get((scenario, name), np.zeros(len(trials), bool)) for name in pair]
                inside = np.logical_or.reduce(masks)
                levels = sorted(values[inside].dropna().unique(), key=str)
                for level in levels if len(levels) > 1 else []:
                    here = (values == level).to_numpy(bool)
                    place = stratum_label(scenario, f"{column} {_level(level)}")
                    parts = [TrialSet(place, name, mask & here) for name, mask in zip(pair, masks, strict=True)]
                    if min(part.n for part in parts) >= at_least:
                        made |= {part.label: part for part in parts}
    return sorted(made.values(), key=lambda one: one.scenario)


def stratum_label(scenario: str, stratum: str | None) -> str:
    """Return the label of a scenario's stratum, ``iC, prev_error yes``; the scenario itself without one."""
    return f"{scenario}, {stratum}" if stratum else scenario


def split_label(scenario: str) -> tuple[str, str | None]:
    """Return the scenario and the stratum of what :func:`stratum_label` made; None where it is a whole scenario."""
    plain, _, stratum = scenario.partition(", ")
    return plain, stratum or None


def _level(value: object) -> str:
    return ("no", "yes")[bool(value)] if isinstance(value, bool | np.bool_) else str(value)


def shortest_gap_s(trials: pd.DataFrame) -> float:
    """Return the shortest time from one onset to the next, NaN where it is not known (column ``soa_s``)."""
    gaps = pd.to_numeric(trials["soa_s"], errors="coerce").dropna() if "soa_s" in trials else pd.Series(dtype=float)
    return float(gaps.min()) if len(gaps) else float("nan")


def nearest_channel(wanted: str, names: Iterable[str]) -> str:
    """Return the channel of that name, else whatever its case; else the first midline one there is, else the first."""
    names = list(names)
    if wanted in names:
        return wanted
    by_lower = {name.lower(): name for name in reversed(names)}
    midline = ("Cz", "CPz", "FCz", "Pz", "Fz", "POz", "Oz", "FPz")
    return next((by_lower[w.lower()] for w in (wanted, *midline) if w.lower() in by_lower), names[0])


def _with_booleans(trials: pd.DataFrame) -> pd.DataFrame:
    # A column of true, false and missing has the type object, on which "not" fails; missing counts as false.
    # A column without any value is nowhere equal to, above or below anything, so that no query on it selects a trial.
    empty = {str(name) for name, column in trials.items() if column.isna().all()}
    flags = {
        str(name)
        for name, column in trials.items()
        if column.dtype == object and str(name) not in empty and all(isinstance(v, bool) for v in column.dropna())
    }
    flags |= empty & FLAGS
    booleans = {name: trials[name].map(lambda v: v is True or v is np.True_).astype(bool) for name in flags}
    return trials.assign(**booleans, **dict.fromkeys(empty - FLAGS, np.nan))


def _matching(table: pd.DataFrame, name: str, query: str) -> NDArray[np.bool_]:
    try:
        result = np.asarray(table.eval(query, engine="python"))
    except Exception as error:  # pandas raises whatever the expression leads it to
        raise ValueError(f"{name} = {query!r} cannot be evaluated on the trial table: {error}") from error
    if result.dtype != bool or result.shape != (len(table),):
        raise ValueError(f"{name} = {query!r} gives {result.dtype} values, not true or false a trial")
    return result
