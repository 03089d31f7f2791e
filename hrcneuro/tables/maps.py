"""The tables of erp and ersp read as maps: of one subject, and of the group's tested contrasts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.selection import ALL, stratum_label
from hrcneuro.eeg.significance import ContrastWaves, SignificanceMap
from hrcneuro.errors import DataError
from hrcneuro.io.tables import describe, read_lists, read_table

Key = tuple[str, str]
"""Scenario, or a stratum's label, and condition or contrast."""

_AXES = ["channel", "start_s", "step_s"]


@dataclass(frozen=True)
class SubjectMaps:
    """A subject's averages.

    Attributes:
        maps: (scenario, condition) -> ndarray, shape (n_channels, n_frequencies, n_times), µV.
        axes: ``channel``, ``frequency_hz`` and ``times``, each with its labels.
        gap_s: The shortest time to the next onset among all averages, s; NaN if unknown.
    """

    maps: Mapping[Key, NDArray[np.float32]]
    axes: Mapping[str, Any]
    gap_s: float

    def on_channels(self, names: Sequence[str]) -> dict[Key, NDArray[np.float32]]:
        """Return the maps of these channels, in this order."""
        picked = [self.axes["channel"].index(name) for name in names]
        return {key: value[picked] for key, value in self.maps.items()}


def read_magnitudes(path: Path) -> SubjectMaps:
    """Return what ``ersp.parquet`` or ``ersp_strata.parquet`` of a subject holds.

    Raises:
        DataError: The rows are not complete.
    """
    keys = _read_keys(path, "condition", "frequency_hz", "gap_s", *_AXES)
    values = read_lists(path, "magnitude_uv")
    channels, frequencies = list(keys["channel"].unique()), [float(f) for f in keys["frequency_hz"].unique()]
    firsts = keys.iloc[:: len(channels) * len(frequencies)]
    expected = [(c, f) for c in channels for f in frequencies] * len(firsts)
    if expected != list(zip(keys["channel"], keys["frequency_hz"], strict=True)):
        raise DataError(f"{path.name}: its rows are not complete", cure="rerun the stage ersp with --force")
    blocks = values.reshape(len(firsts), len(channels), len(frequencies), -1)
    axes = {"channel": channels, "frequency_hz": frequencies, "times": times_of(firsts, values.shape[1])}
    labels = zip(_labels(firsts), firsts["condition"], strict=True)
    return SubjectMaps(dict(zip(labels, blocks, strict=True)), axes, float(firsts["gap_s"].min()))


@dataclass(frozen=True)
class Waveforms:
    """A subject's averages of all scenarios together.

    Attributes:
        channels: Their names.
        times: ndarray, shape (n_times,), s.
        counts: Condition -> trials.
        means, errors: Condition -> mean and its standard error, ndarray, shape (n_channels, n_times), µV.
        gap_s: The shortest time to the next onset among them, s; NaN if unknown.
    """

    channels: list[str]
    times: NDArray[np.float64]
    counts: Mapping[str, int]
    means: Mapping[str, NDArray[np.float64]]
    errors: Mapping[str, NDArray[np.float64]]
    gap_s: float


def read_waveforms(path: Path) -> Waveforms:
    """Return what ``waveforms.parquet`` of a subject holds."""
    keys = read_table(path, ["condition", "n", "gap_s", *_AXES])
    channels = list(keys["channel"].unique())
    firsts = keys.iloc[:: len(channels)]
    means, errors = (
        read_lists(path, name).astype(float).reshape(len(firsts), len(channels), -1) for name in ("mean_uv", "error_uv")
    )
    names = list(firsts["condition"])
    return Waveforms(
        channels,
        times_of(firsts, means.shape[-1]),
        dict(zip(names, map(int, firsts["n"]), strict=True)),
        dict(zip(names, means, strict=True)),
        dict(zip(names, errors, strict=True)),
        float(firsts["gap_s"].min()),
    )


@dataclass(frozen=True)
class GroupMaps:
    """What ``erp_stats``, ``ersp_stats`` or their strata hold.

    Attributes:
        maps: (scenario, contrast) -> where the two conditions differ.
        conditions: (scenario, contrast) -> the two conditions, plus first.
        subjects: Of the group, with those that lack a condition.
        gap_s: The shortest time to the next onset over all subjects, s; NaN if unknown.
    """

    maps: Mapping[Key, SignificanceMap]
    conditions: Mapping[Key, tuple[str, str]]
    subjects: int
    gap_s: float

    @property
    def whole(self) -> list[Key]:
        """The contrasts over all trials, in the order of the configuration."""
        return [key for key in self.maps if key[0] == ALL]

    @property
    def by_scenario(self) -> list[Key]:
        """The contrasts within scenarios: the first contrast of each scenario, then the second."""
        order = [name for _, name in self.whole]
        return sorted((key for key in self.maps if key[0] != ALL), key=lambda key: order.index(key[1]))

    @property
    def of_half_the_group(self) -> list[Key]:
        """The contrasts that at least half of the subjects have: fewer say nothing of the group."""
        return [key for key, one in self.maps.items() if 2 * one.n >= self.subjects]


def read_tested(path: Path) -> GroupMaps:
    """Return the group's tested contrasts; none of anything where the study has no contrast."""
    keys = _read_keys(path, "contrast", "n", "plus", "minus", "subjects", "gap_s", *_AXES)
    if not len(keys):
        return GroupMaps({}, {}, 0, float("nan"))
    difference, significant = (read_lists(path, name) for name in ("difference_uv", "significant"))
    times = times_of(keys, difference.shape[1])
    maps: dict[Key, SignificanceMap] = {}
    conditions: dict[Key, tuple[str, str]] = {}
    for (scenario, contrast), part in keys.groupby([_labels(keys), keys["contrast"]], sort=False):
        key = (str(scenario), str(contrast))
        rows = part.index.to_numpy()
        channels = list(part["channel"].unique())
        frequencies = np.unique(part["frequency_hz"]) if "frequency_hz" in part else np.zeros(0)
        shape = (len(channels), *([len(frequencies)] if len(frequencies) else []), len(times))
        maps[key] = SignificanceMap(
            int(part["n"].iloc[0]),
            channels,
            times,
            difference[rows].astype(float).reshape(shape),
            significant[rows].astype(bool).reshape(shape),
            frequencies,
        )
        conditions[key] = (part["plus"].iloc[0], part["minus"].iloc[0])
    return GroupMaps(maps, conditions, int(keys["subjects"].iloc[0]), float(keys["gap_s"].iloc[0]))


def read_contrast_waves(path: Path, channel: str) -> dict[Key, ContrastWaves]:
    """Return (scenario, contrast) -> one channel's waveforms, of ``erp_stats`` or ``erp_strata``."""
    keys = _read_keys(path, "contrast", "channel")
    rows = np.flatnonzero(keys["channel"] == channel)
    labels = zip(_labels(keys.iloc[rows]), keys["contrast"].iloc[rows], strict=True)
    columns = ("plus_uv", "plus_error_uv", "minus_uv", "minus_error_uv", "difference_uv", "sd_uv")
    lists = [read_lists(path, name)[rows].astype(float) for name in columns]
    return {key: ContrastWaves(*waves) for key, waves in zip(labels, zip(*lists, strict=True), strict=True)}


def read_positions(path: Path, channels: Sequence[str]) -> NDArray[np.float64]:
    """Return where channels are in head coordinates, ndarray, shape (n_channels, 3), m; NaN where that is not known."""
    table = read_table(path).set_index("channel")
    return table.reindex(list(channels))[["x_m", "y_m", "z_m"]].to_numpy(float)


def _read_keys(path: Path, *names: str) -> pd.DataFrame:
    """Return these columns, the scenario, and stratum and frequency where the table has them."""
    there = [name for name in ("stratum", "frequency_hz") if name in describe(path).columns and name not in names]
    return read_table(path, ["scenario", *there, *names])


def _labels(keys: pd.DataFrame) -> pd.Series:
    if "stratum" not in keys:
        return keys["scenario"]
    labels = [stratum_label(*pair) for pair in zip(keys["scenario"], keys["stratum"], strict=True)]
    return pd.Series(labels, index=keys.index, dtype=object)


def times_of(keys: pd.DataFrame, count: int) -> NDArray[np.float64]:
    """Return the times of a table's lists, all of which begin alike, ndarray, shape (count,), s."""
    first = keys.iloc[0]
    return np.asarray(first["start_s"] + first["step_s"] * np.arange(count))
