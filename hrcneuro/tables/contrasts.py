"""The tables of erp and ersp: averages, grand averages and tested contrasts, one list over time a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.contrasts import Tested
from hrcneuro.eeg.selection import Cell, shortest_gap_s, split_label
from hrcneuro.errors import DataError
from hrcneuro.io.tables import Column, Table, read_lists, read_table, write_table

if TYPE_CHECKING:
    import mne

Maps = Mapping[tuple[str, str], NDArray[Any]]

_SCENARIO = {"scenario": Column("category", "", "value of the split column, or all")}
_STRATUM = {"stratum": Column("category", "", "trial column and its value: the trials that were taken")}
_CONDITION = {**_SCENARIO, "condition": Column("category", "", "name of the condition")}
_CONTRAST = {**_SCENARIO, "contrast": Column("category", "", "name of the contrast, plus - minus")}
_CHANNEL = {"channel": Column("category", "", "EEG channel")}
_FREQUENCY = {"frequency_hz": Column("float", "Hz", "centre of the wavelet")}
_TRIALS = {
    "n": Column("int", "", "trials in the average"),
    "gap_s": Column("float", "s", "shortest time to the next onset among them; beyond it responses overlap"),
}
_SUBJECTS = {"n": Column("int", "", "subjects")}
_TIME = {
    "start_s": Column("float", "s", "time of the first value of the lists, from the onset"),
    "step_s": Column("float", "s", "time from one value of the lists to the next"),
}
_GRAND = {
    "mean_uv": Column("float32[]", "uV", "mean over subjects"),
    "sd_uv": Column("float32[]", "uV", "SD over subjects (n - 1); NaN with one"),
}
_TESTED = {
    "difference_uv": Column("float32[]", "uV", "mean over subjects of plus - minus"),
    "sd_uv": Column("float32[]", "uV", "SD of the differences (n - 1); NaN with one subject"),
    "t": Column("float32[]", "", "one-sample t of the differences; NaN with one subject"),
    "p": Column("float32[]", "", "two-sided p corrected over all points of the map; 1 with one subject"),
    "significant": Column("bool[]", "", "p at or below alpha"),
    "dz": Column("float32[]", "", "Cohen's dz, mean over SD of the differences; NaN with one subject"),
    "dz_low": Column("float32[]", "", "lower end of its confidence interval"),
    "dz_high": Column("float32[]", "", "upper end of its confidence interval"),
}

AVERAGES = Table(
    1,
    "one row an average: what the evoked file was made of; a condition without a trial has no row",
    {**_CONDITION, **_TRIALS},
)
ERP = Table(1, "one row a scenario, condition and channel", {**_CONDITION, **_CHANNEL, **_SUBJECTS, **_TIME, **_GRAND})
ERP_STATS = Table(
    1, "one row a scenario, contrast and channel", {**_CONTRAST, **_CHANNEL, **_SUBJECTS, **_TIME, **_TESTED}
)
ERSP_SUBJECT = Table(
    1,
    "one row a scenario, condition, channel and frequency",
    {
        **_CONDITION,
        **_CHANNEL,
        **_FREQUENCY,
        **_TRIALS,
        **_TIME,
        "magnitude_uv": Column("float32[]", "uV", "mean over trials of twice the wavelet's magnitude, no baseline"),
    },
)
ERSP = Table(
    1,
    "one row a scenario, condition, channel and frequency",
    {**_CONDITION, **_CHANNEL, **_FREQUENCY, **_SUBJECTS, **_TIME, **_GRAND},
)
ERSP_STATS = Table(
    1,
    "one row a scenario, contrast, channel and frequency",
    {**_CONTRAST, **_CHANNEL, **_FREQUENCY, **_SUBJECTS, **_TIME, **_TESTED},
)

# The same within strata: averages of erp and ersp, tests of erp and ersp.
STRATA = Table(1, "one row an average within a stratum", {**_STRATUM, **AVERAGES.columns})
ERP_STRATA = Table(1, "one row a stratum, contrast and channel", {**_STRATUM, **ERP_STATS.columns})
ERSP_STRATA_SUBJECT = Table(
    1, "one row a stratum, condition, channel and frequency", {**_STRATUM, **ERSP_SUBJECT.columns}
)
ERSP_STRATA = Table(1, "one row a stratum, contrast, channel and frequency", {**_STRATUM, **ERSP_STATS.columns})

CHANNELS = Table(
    1,
    "one row an EEG channel",
    {
        **_CHANNEL,
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


def write_grand(
    averages: Mapping[str, Maps], pairs: Sequence[tuple[str, str]], axes: Mapping[str, Any], path: Path, table: Table
) -> None:
    """Write the mean and SD over the subjects that have each (scenario, condition).

    Args:
        averages: Subject -> its maps.
        pairs: The rows' order.
        axes: ``channel``, perhaps ``frequency_hz``, and last ``times``, each with its labels.
        path: The file.
        table: :data:`ERP` or :data:`ERSP`.
    """
    rows, means, sds = [], [], []
    for scenario, condition in pairs:
        stack = np.stack([maps[scenario, condition] for maps in averages.values() if (scenario, condition) in maps])
        rows.append(_keys(axes, scenario=scenario, condition=condition, n=len(stack)))
        means.append(_flat(stack.mean(axis=0, dtype=float)))
        sds.append(
            _flat(stack.std(axis=0, ddof=1, dtype=float) if len(stack) > 1 else np.full(stack.shape[1:], np.nan))
        )
    _write(rows, {"mean_uv": means, "sd_uv": sds}, path, table)


def write_tested(tested: Iterable[Tested], axes: Mapping[str, Any], path: Path, table: Table) -> None:
    """Write the contrasts: :data:`ERP_STATS`, :data:`ERSP_STATS` or those of strata; axes as in :func:`write_grand`."""
    rows: list[pd.DataFrame] = []
    lists: dict[str, list[NDArray[Any]]] = {name: [] for name in _TESTED}
    for one in tested:
        result, shape = one.result, one.result.difference.shape
        rows.append(_keys(axes, scenario=one.scenario, contrast=one.name, n=result.n))
        test = result.test
        values = {
            "difference_uv": result.difference,
            "sd_uv": result.sd,
            "t": np.full(shape, np.nan) if test is None else test.t,
            "p": np.ones(shape) if test is None else test.p,
            "significant": np.zeros(shape, bool) if test is None else test.significant,
            "dz": result.dz,
            "dz_low": result.dz_low,
            "dz_high": result.dz_high,
        }
        for name, value in values.items():
            lists[name].append(_flat(value))
    _write(rows, lists, path, table)


def write_strata(cells: Sequence[Cell], trials: pd.DataFrame, path: Path) -> None:
    """Write :data:`STRATA`: the number of trials and the shortest gap of every average within a stratum."""
    rows = [
        (*reversed(split_label(cell.scenario)), cell.condition, cell.n, shortest_gap_s(trials[cell.mask]))
        for cell in cells
    ]
    write_table(pd.DataFrame(rows, columns=list(STRATA.columns)), path, STRATA)


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
    one = _keys(axes)
    keys = pd.concat([one] * len(maps), ignore_index=True)
    told = [(scenario, condition, *trials[scenario, condition]) for scenario, condition in maps]
    for name, values in zip(("scenario", "condition", "n", "gap_s"), zip(*told, strict=True), strict=True):
        keys[name] = np.repeat(np.array(values), len(one))
    _write([keys], {"magnitude_uv": [_flat(value) for value in maps.values()]}, path, table)


def read_magnitudes(path: Path) -> tuple[dict[tuple[str, str], NDArray[np.float32]], dict[str, Any], float]:
    """Return a subject's maps (channels × frequencies × times), their axes, and the shortest gap in seconds.

    Raises:
        DataError: The rows are not complete.
    """
    table = read_table(path).drop(columns="magnitude_uv")
    values = read_lists(path, "magnitude_uv")
    channels, frequencies = list(table["channel"].unique()), [float(f) for f in table["frequency_hz"].unique()]
    size = len(channels) * len(frequencies)
    firsts = table.iloc[::size]
    expected = [(c, f) for c in channels for f in frequencies] * len(firsts)
    if expected != list(zip(table["channel"], table["frequency_hz"], strict=True)):
        raise DataError(f"{path.name}: its rows are not complete", cure="rerun the stage ersp with --force")
    blocks = values.reshape(len(firsts), len(channels), len(frequencies), -1)
    scenarios = firsts["scenario"].astype(str)
    if "stratum" in firsts:
        scenarios = scenarios + ", " + firsts["stratum"].astype(str)
    keys = zip(scenarios, firsts["condition"], strict=True)
    times = firsts["start_s"].iloc[0] + firsts["step_s"].iloc[0] * np.arange(values.shape[1])
    gap = float(firsts["gap_s"].min())
    return dict(zip(keys, blocks, strict=True)), {"channel": channels, "frequency_hz": frequencies, "times": times}, gap


def _keys(axes: Mapping[str, Any], **constant: Any) -> pd.DataFrame:
    """Return the key columns of one map: every combination of its axes but time, in C order."""
    names = [name for name in axes if name != "times"]
    index = pd.MultiIndex.from_product([list(axes[name]) for name in names], names=names)
    times = axes["times"]
    step = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 0.0
    return index.to_frame(index=False).assign(start_s=times[0], step_s=step, **constant)


def _flat(value: NDArray[Any]) -> NDArray[Any]:
    flat = value.reshape(-1, value.shape[-1])
    return flat if flat.dtype == bool else flat.astype(np.float32)


def _write(rows: list[pd.DataFrame], lists: Mapping[str, list[NDArray[Any]]], path: Path, table: Table) -> None:
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
