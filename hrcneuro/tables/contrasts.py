"""The tables of erp and ersp: averages, grand averages and tested contrasts, one list over time a row.

:mod:`hrcneuro.tables.maps` reads them as maps.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.contrasts import GrandAverage, GroupContrast
from hrcneuro.eeg.selection import TrialSet, split_label
from hrcneuro.io.tables import Column, Table, write_table

if TYPE_CHECKING:
    import mne

Maps = Mapping[tuple[str, str], NDArray[Any]]

SCENARIO = {"scenario": Column("category", "", "value of the split column, or all")}
_STRATUM = {"stratum": Column("category", "", "trial column and its value: the trials that were taken")}
_CONDITION = {**SCENARIO, "condition": Column("category", "", "name of the condition")}
_CONTRAST = {**SCENARIO, "contrast": Column("category", "", "name of the contrast, plus - minus")}
CHANNEL = {"channel": Column("category", "", "EEG channel")}
_FREQUENCY = {"frequency_hz": Column("float", "Hz", "centre of the wavelet")}
_TRIALS = {
    "n": Column("int", "", "trials in the average"),
    "gap_s": Column("float", "s", "shortest time to the next onset among them; beyond it responses overlap"),
}
SUBJECTS = {"n": Column("int", "", "subjects")}
TIME = {
    "start_s": Column("float", "s", "time of the first value of the lists, from the onset"),
    "step_s": Column("float", "s", "time from one value of the lists to the next"),
}
_GRAND = {
    "mean_uv": Column("float32[]", "uV", "mean over subjects"),
    "sd_uv": Column("float32[]", "uV", "SD over subjects (n - 1); NaN with one"),
}
TESTED = {
    "difference_uv": Column("float32[]", "uV", "mean over subjects of plus - minus"),
    "sd_uv": Column("float32[]", "uV", "SD of the differences (n - 1); NaN with one subject"),
    "t": Column("float32[]", "", "one-sample t of the differences; NaN with one subject"),
    "p": Column("float32[]", "", "two-sided p corrected over all points of the map; 1 with one subject"),
    "significant": Column("bool[]", "", "p at or below alpha"),
    "dz": Column("float32[]", "", "Cohen's dz, mean over SD of the differences; NaN with one subject"),
    "dz_low": Column("float32[]", "", "lower end of its confidence interval"),
    "dz_high": Column("float32[]", "", "upper end of its confidence interval"),
}
_COMPARED = {
    "plus": Column("category", "", "condition from which the other is subtracted"),
    "minus": Column("category", "", "condition that is subtracted"),
    "subjects": Column("int", "", "subjects of the group, with those that lack a condition"),
    "gap_s": Column("float", "s", "shortest time to the next onset, over all subjects; beyond it responses overlap"),
}
_OWN = {
    f"{sign}_{name}": Column("float32[]", "uV", f"{text} {sign}, over the subjects of the contrast{alone}")
    for sign in ("plus", "minus")
    for name, text, alone in (("uv", "mean of", ""), ("error_uv", "standard error of the mean of", "; NaN with one"))
}

AVERAGES = Table(
    1,
    "one row an average: what the evoked file was made of; a condition without a trial has no row",
    {**_CONDITION, **_TRIALS},
)
WAVEFORMS = Table(
    1,
    "one row a condition and channel, all scenarios together",
    {
        "condition": _CONDITION["condition"],
        **CHANNEL,
        **_TRIALS,
        **TIME,
        "mean_uv": Column("float32[]", "uV", "mean over trials"),
        "error_uv": Column(
            "float32[]", "uV", "its standard error; NaN with one trial, and where overlap is regressed out"
        ),
    },
)
ERP = Table(1, "one row a scenario, condition and channel", {**_CONDITION, **CHANNEL, **SUBJECTS, **TIME, **_GRAND})
ERP_STATS = Table(
    2,
    "one row a scenario, contrast and channel",
    {**_CONTRAST, **CHANNEL, **SUBJECTS, **TIME, **TESTED, **_COMPARED, **_OWN},
)
ERSP_SUBJECT = Table(
    1,
    "one row a scenario, condition, channel and frequency",
    {
        **_CONDITION,
        **CHANNEL,
        **_FREQUENCY,
        **_TRIALS,
        **TIME,
        "magnitude_uv": Column("float32[]", "uV", "mean over trials of twice the wavelet's magnitude, no baseline"),
    },
)
ERSP = Table(
    1,
    "one row a scenario, condition, channel and frequency",
    {**_CONDITION, **CHANNEL, **_FREQUENCY, **SUBJECTS, **TIME, **_GRAND},
)
ERSP_STATS = Table(
    2,
    "one row a scenario, contrast, channel and frequency",
    {**_CONTRAST, **CHANNEL, **_FREQUENCY, **SUBJECTS, **TIME, **TESTED, **_COMPARED},
)

# The same within strata: averages of erp and ersp, tests of erp and ersp.
STRATA = Table(1, "one row an average within a stratum", {**_STRATUM, **AVERAGES.columns})
ERP_STRATA = Table(2, "one row a stratum, contrast and channel", {**_STRATUM, **ERP_STATS.columns})
ERSP_STRATA_SUBJECT = Table(
    1, "one row a stratum, condition, channel and frequency", {**_STRATUM, **ERSP_SUBJECT.columns}
)
ERSP_STRATA = Table(2, "one row a stratum, contrast, channel and frequency", {**_STRATUM, **ERSP_STATS.columns})

CHANNELS = Table(
    1,
    "one row an EEG channel",
    {
        **CHANNEL,
        "x_m": Column("float", "m", "position in head coordinates; NaN where unknown"),
        "y_m": Column("float", "m", "as x_m"),
        "z_m": Column("float", "m", "as x_m"),
    },
)


def positions(info: mne.Info) -> pd.DataFrame:
    """Return the table :data:`CHANNELS` of a recording."""
    places = np.array([ch["loc"][:3] for ch in info["chs"]], float)
    places[~places.any(axis=1)] = np.nan  # an unset position may also be all zeros
    return pd.DataFrame(places, columns=["x_m", "y_m", "z_m"]).assign(channel=info["ch_names"])


def write_averages(sets: Sequence[TrialSet], gaps_s: Sequence[float], path: Path) -> None:
    """Write :data:`AVERAGES`: the number of trials and the shortest gap of every average."""
    rows = [(one.scenario, one.condition, one.n, gap) for one, gap in zip(sets, gaps_s, strict=True)]
    write_table(pd.DataFrame(rows, columns=list(AVERAGES.columns)), path, AVERAGES)


def write_strata(sets: Sequence[TrialSet], gaps_s: Sequence[float], path: Path) -> None:
    """Write :data:`STRATA`: the same of every average within a stratum."""
    rows = [
        (*reversed(split_label(one.scenario)), one.condition, one.n, gap) for one, gap in zip(sets, gaps_s, strict=True)
    ]
    write_table(pd.DataFrame(rows, columns=list(STRATA.columns)), path, STRATA)


def write_waveforms(
    sets: Sequence[TrialSet],
    gaps_s: Sequence[float],
    waves: tuple[NDArray[np.float64], NDArray[np.float64]],
    axes: Mapping[str, Any],
    path: Path,
) -> None:
    """Write :data:`WAVEFORMS`.

    Args:
        sets: What was averaged: conditions of one scenario.
        gaps_s: The shortest gap of each.
        waves: Means and their standard errors, ndarray, shape (n_conditions, n_channels, n_times) each, µV.
        axes: ``channel`` and ``times``, each with its labels.
        path: The file.
    """
    rows = [map_keys(axes, condition=one.condition, n=one.n, gap_s=gap) for one, gap in zip(sets, gaps_s, strict=True)]
    lists = {name: list(map(flat_lists, maps)) for name, maps in zip(("mean_uv", "error_uv"), waves, strict=True)}
    write_maps(rows, lists, path, WAVEFORMS)


def write_grand(grand: Sequence[GrandAverage], axes: Mapping[str, Any], path: Path, table: Table) -> None:
    """Write mean and SD over subjects of each scenario and condition.

    Args:
        grand: In the rows' order.
        axes: ``channel``, perhaps ``frequency_hz``, and last ``times``, each with its labels.
        path: The file.
        table: :data:`ERP` or :data:`ERSP`.
    """
    rows = [map_keys(axes, scenario=one.scenario, condition=one.condition, n=one.n) for one in grand]
    lists = {"mean_uv": [flat_lists(one.mean) for one in grand], "sd_uv": [flat_lists(one.sd) for one in grand]}
    write_maps(rows, lists, path, table)


def write_tested(
    tested: Iterable[GroupContrast],
    axes: Mapping[str, Any],
    path: Path,
    table: Table,
    *,
    subjects: int,
    gap_s: float,
    own: Sequence[tuple[GrandAverage, GrandAverage]] = (),
) -> None:
    """Write the contrasts: :data:`ERP_STATS`, :data:`ERSP_STATS` or those of strata; axes as in :func:`write_grand`.

    Args:
        tested: The contrasts.
        axes, path, table: Where they belong.
        subjects: Of the group.
        gap_s: The shortest time to the next onset over all subjects, s; NaN if unknown.
        own: The two conditions of each contrast, for the tables of erp.
    """
    rows: list[pd.DataFrame] = []
    lists: dict[str, list[NDArray[Any]]] = {name: [] for name, c in table.columns.items() if c.type.endswith("[]")}
    constant: dict[str, Any] = {"subjects": subjects, "gap_s": gap_s}
    for i, one in enumerate(tested):
        keys = {"scenario": one.scenario, "contrast": one.name, "plus": one.plus, "minus": one.minus}
        rows.append(map_keys(axes, **keys, n=one.result.n, **constant))
        values = tested_values(one)
        for sign, average in zip(("plus", "minus"), own[i], strict=True) if own else ():
            values |= {f"{sign}_uv": average.mean, f"{sign}_error_uv": average.error}
        for name, value in values.items():
            lists[name].append(flat_lists(value))
    write_maps(rows, lists, path, table)


def tested_values(one: GroupContrast) -> dict[str, NDArray[Any]]:
    """Return :data:`TESTED`'s columns of a map, each ndarray of the map's shape; without a test p is 1, t NaN."""
    result, shape = one.result, one.result.difference.shape
    test = result.test
    return {
        "difference_uv": result.difference,
        "sd_uv": result.sd,
        "t": np.full(shape, np.nan) if test is None else test.t,
        "p": np.ones(shape) if test is None else test.p,
        "significant": np.zeros(shape, bool) if test is None else test.significant,
        "dz": result.dz,
        "dz_low": result.dz_low,
        "dz_high": result.dz_high,
    }


def write_magnitudes(
    maps: Maps,
    trials: Mapping[tuple[str, str], tuple[int, float]],
    axes: Mapping[str, Any],
    path: Path,
    table: Table = ERSP_SUBJECT,
) -> None:
    """Write a subject's mean magnitudes with the number of trials and the shortest gap of each average.

    ``table`` is :data:`ERSP_SUBJECT` or :data:`ERSP_STRATA_SUBJECT`.
    """
    one = map_keys(axes)
    keys = pd.concat([one] * len(maps), ignore_index=True)
    rows = [(scenario, condition, *trials[scenario, condition]) for scenario, condition in maps]
    for name, values in zip(("scenario", "condition", "n", "gap_s"), zip(*rows, strict=True), strict=True):
        keys[name] = np.repeat(np.array(values), len(one))
    write_maps([keys], {"magnitude_uv": [flat_lists(value) for value in maps.values()]}, path, table)


def map_keys(axes: Mapping[str, Any], **constant: Any) -> pd.DataFrame:
    """Return the key columns of one map: every combination of its axes but time, in C order."""
    names = [name for name in axes if name != "times"]
    index = pd.MultiIndex.from_product([list(axes[name]) for name in names], names=names)
    times = axes["times"]
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 0.0
    return index.to_frame(index=False).assign(start_s=times[0], step_s=step, **constant)


def flat_lists(value: NDArray[Any]) -> NDArray[Any]:
    """Return a map as lists over time, ndarray, shape (n_rows, n_times), in single precision unless it is of truth."""
    flat = value.reshape(-1, value.shape[-1])
    return flat if flat.dtype == bool else flat.astype(np.float32)


def write_maps(rows: list[pd.DataFrame], lists: Mapping[str, list[NDArray[Any]]], path: Path, table: Table) -> None:
    """Write maps: their rows' key columns, and the lists of all rows, name -> one block a map."""
    keys = (
        pd.concat(rows, ignore_index=True)
        if rows
        else pd.DataFrame({name: [] for name in table.columns if name not in lists})
    )
    if "stratum" in table.columns and len(keys):
        keys["scenario"], keys["stratum"] = zip(*map(split_label, keys["scenario"]), strict=True)
    columns: dict[str, Any] = {str(name): keys[name] for name in keys}
    columns |= {name: np.concatenate(blocks) if blocks else [] for name, blocks in lists.items()}
    write_table(columns, path, table)
