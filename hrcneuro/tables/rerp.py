"""The tables of rerp: coefficients, what was known of the trials, tests, what plain differences are made of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.contrasts import GroupContrast
from hrcneuro.eeg.formula import Predictors
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.io.tables import Column, Table, read_lists, read_table, write_table
from hrcneuro.tables import contrasts as of_maps
from hrcneuro.tables.maps import times_of

Floats = NDArray[np.float64]

PLAIN, REST = "plain difference", "rest"
"""What parts add up to, and what of it no predictor explains: neighbours' responses, and misfit of the model."""

_COEFFICIENT = {
    **of_maps.SCENARIO,
    "coefficient": Column("category", "", "predictor, as the formula makes it; Intercept: all others 0"),
}
_GAP = {
    "gap_s": Column(
        "float", "s", "shortest time to the next onset; beyond it responses overlap; NaN where overlap is regressed out"
    )
}
_PART = {
    **of_maps.SCENARIO,
    "contrast": Column("category", "", "name of the contrast, plus - minus"),
    "part": Column("category", "", f"predictor; {PLAIN}: of the averages; {REST}: what no predictor explains"),
}

RERP = Table(
    1,
    "one row a scenario, coefficient and channel",
    {
        **_COEFFICIENT,
        **of_maps.CHANNEL,
        **_GAP,
        **of_maps.TIME,
        "coefficient_uv": Column("float32[]", "uV", "a unit of the predictor"),
    },
)
PREDICTORS = Table(
    1,
    "one row a scenario and coefficient: what was known of the trials",
    {
        **_COEFFICIENT,
        "trials": Column("int", "", "trials in the model"),
        "unknown": Column(
            "int", "", "trials of which something is unknown: they have one response more, which they share"
        ),
        "nonzero": Column("int", "", "trials whose value is not 0"),
        "mean": Column("float", "", "of the values"),
        "sd": Column("float", "", "of the values (n - 1)"),
        "inflation": Column(
            "float", "", "variance inflation by the other predictors; 1: unrelated to them; NaN of the intercept"
        ),
    },
)
PARTS = Table(
    1,
    "one row a scenario, contrast, part and channel: what a plain difference is made of",
    {
        **_PART,
        **of_maps.CHANNEL,
        **of_maps.TIME,
        "difference": Column("float", "", "mean of the predictor in plus, less that in minus; NaN of what is none"),
        "part_uv": Column("float32[]", "uV", "that difference times the coefficient"),
    },
)
RERP_STATS = Table(
    1,
    "one row a scenario, coefficient and channel",
    {
        **_COEFFICIENT,
        **of_maps.CHANNEL,
        **of_maps.SUBJECTS,
        **of_maps.TIME,
        **of_maps.TESTED,
        "subjects": Column("int", "", "subjects of the group, with those whose trials lack the predictor"),
        **_GAP,
    },
)
RERP_PARTS = Table(
    1,
    "one row a scenario, contrast, part and channel: what a plain difference is made of",
    {
        **_PART,
        **of_maps.CHANNEL,
        **of_maps.SUBJECTS,
        **of_maps.TIME,
        "difference": Column("float", "", "mean over subjects of the predictor in plus, less that in minus"),
        "part_uv": Column("float32[]", "uV", "mean over subjects of that difference times the coefficient"),
        "sd_uv": Column("float32[]", "uV", "SD over subjects (n - 1); NaN with one"),
    },
)

Key = tuple[str, str]
"""Scenario and coefficient."""


@dataclass(frozen=True)
class Part:
    """What one predictor adds to the plain difference of two conditions.

    Attributes:
        scenario, contrast, name: Of what; the name is a coefficient, :data:`PLAIN` or :data:`REST`.
        difference: How much the predictor's means differ between the conditions; NaN where it is no predictor.
        map: ndarray, shape (n_channels, n_times), µV.
    """

    scenario: str
    contrast: str
    name: str
    difference: float
    map: Floats


def write_coefficients(maps: Mapping[Key, Floats], axes: Mapping[str, Any], gap_s: float, path: Path) -> None:
    """Write :data:`RERP`: (scenario, coefficient) -> ndarray, shape (n_channels, n_times), µV."""
    rows = [of_maps.map_keys(axes, scenario=s, coefficient=name, gap_s=gap_s) for s, name in maps]
    of_maps.write_maps(rows, {"coefficient_uv": [of_maps.flat_lists(one) for one in maps.values()]}, path, RERP)


def write_predictors(fitted: Mapping[str, Predictors], path: Path) -> None:
    """Write :data:`PREDICTORS`: scenario -> what its trials were known for."""
    rows = []
    for scenario, one in fitted.items():
        values = one.values[one.known]
        for i, name in enumerate(one.names):
            column = values[:, i]
            sd = float(column.std(ddof=1)) if len(column) > 1 else float("nan")
            rows.append(
                (scenario, name, len(values), int((~one.known).sum()), int(np.count_nonzero(column)))
                + (float(column.mean()), sd, float(one.inflation[i]))
            )
    write_table(pd.DataFrame(rows, columns=list(PREDICTORS.columns)), path, PREDICTORS)


def write_parts(parts: Sequence[Part], axes: Mapping[str, Any], path: Path) -> None:
    """Write :data:`PARTS` of a subject."""
    rows = [
        of_maps.map_keys(axes, scenario=p.scenario, contrast=p.contrast, part=p.name, difference=p.difference)
        for p in parts
    ]
    of_maps.write_maps(rows, {"part_uv": [of_maps.flat_lists(p.map) for p in parts]}, path, PARTS)


def write_group_parts(of_subjects: Sequence[Sequence[Part]], axes: Mapping[str, Any], path: Path) -> None:
    """Write :data:`RERP_PARTS`: mean and SD over the subjects that have a part; axes as of all of them."""
    grouped: dict[tuple[str, str, str], list[Part]] = {}
    for parts in of_subjects:
        for part in parts:
            grouped.setdefault((part.scenario, part.contrast, part.name), []).append(part)
    rows, lists = [], {"part_uv": [], "sd_uv": []}  # type: tuple[list[pd.DataFrame], dict[str, list[NDArray[Any]]]]
    for (scenario, contrast, name), own in grouped.items():
        stack = np.stack([part.map for part in own])
        shift = float(np.mean([part.difference for part in own]))
        keys = dict(scenario=scenario, contrast=contrast, part=name, n=len(own), difference=shift)
        rows.append(of_maps.map_keys(axes, **keys))
        lists["part_uv"].append(of_maps.flat_lists(stack.mean(axis=0)))
        sd = stack.std(axis=0, ddof=1) if len(own) > 1 else np.full(stack.shape[1:], np.nan)
        lists["sd_uv"].append(of_maps.flat_lists(sd))
    of_maps.write_maps(rows, lists, path, RERP_PARTS)


def write_tested(
    tested: Iterable[GroupContrast], axes: Mapping[str, Any], path: Path, *, subjects: int, gap_s: float
) -> None:
    """Write :data:`RERP_STATS`; ``subjects`` of the group, ``gap_s`` as in :data:`RERP`."""
    rows: list[pd.DataFrame] = []
    lists: dict[str, list[NDArray[Any]]] = {name: [] for name in of_maps.TESTED}
    for one in tested:
        keys = dict(scenario=one.scenario, coefficient=one.name, n=one.result.n, subjects=subjects, gap_s=gap_s)
        rows.append(of_maps.map_keys(axes, **keys))
        for name, value in of_maps.tested_values(one).items():
            lists[name].append(of_maps.flat_lists(value))
    of_maps.write_maps(rows, lists, path, RERP_STATS)


@dataclass(frozen=True)
class Coefficients:
    """A subject's coefficients.

    Attributes:
        maps: (scenario, coefficient) -> ndarray, shape (n_channels, n_times), µV.
        channels: Their names.
        times: ndarray, shape (n_times,), s.
        gap_s: The shortest time to the next onset; NaN where overlap is regressed out.
    """

    maps: Mapping[Key, Floats]
    channels: list[str]
    times: Floats
    gap_s: float


def read_coefficients(path: Path) -> Coefficients:
    """Return what a subject's ``rerp.parquet`` holds."""
    keys = read_table(path, ["scenario", "coefficient", "channel", "gap_s", "start_s", "step_s"])
    lists = read_lists(path, "coefficient_uv").astype(float)
    channels = list(keys["channel"].unique())
    firsts = keys.iloc[:: len(channels)]
    blocks = lists.reshape(len(firsts), len(channels), -1)
    names = zip(firsts["scenario"].astype(str), firsts["coefficient"].astype(str), strict=True)
    times = times_of(keys, lists.shape[1])
    return Coefficients(dict(zip(names, blocks, strict=True)), channels, times, float(keys["gap_s"].min()))


def read_parts(path: Path, channels: Sequence[str] = ()) -> list[Part]:
    """Return the parts of a subject or of the group (means), with these channels in this order; all where none is."""
    keys = read_table(path, ["scenario", "contrast", "part", "channel", "difference"])
    if not len(keys):
        return []
    lists = read_lists(path, "part_uv").astype(float)
    own = list(keys["channel"].unique())
    firsts = keys.iloc[:: len(own)]
    rows = [own.index(name) for name in channels or own]
    blocks = lists.reshape(len(firsts), len(own), -1)[:, rows]
    names = (firsts[name].astype(str) for name in ("scenario", "contrast", "part"))
    return [Part(*place) for place in zip(*names, firsts["difference"].astype(float), blocks, strict=True)]


@dataclass(frozen=True)
class TestedCoefficients:
    """What ``rerp_stats.parquet`` holds.

    Attributes:
        maps: (scenario, coefficient) -> where the coefficient differs from 0.
        sd: (scenario, coefficient) -> SD over subjects, ndarray, shape (n_channels, n_times), µV.
        subjects: Of the group.
        gap_s: As of :class:`Coefficients`.
    """

    maps: Mapping[Key, SignificanceMap]
    sd: Mapping[Key, Floats]
    subjects: int
    gap_s: float


def read_tested(path: Path) -> TestedCoefficients:
    """Return the group's tested coefficients."""
    keys = read_table(path, ["scenario", "coefficient", "channel", "n", "subjects", "gap_s", "start_s", "step_s"])
    channels = list(keys["channel"].unique())
    firsts = keys.iloc[:: len(channels)]
    names = list(zip(firsts["scenario"].astype(str), firsts["coefficient"].astype(str), strict=True))
    difference, sd, significant = (
        read_lists(path, name).reshape(len(firsts), len(channels), -1)
        for name in ("difference_uv", "sd_uv", "significant")
    )
    times = times_of(keys, difference.shape[-1])
    maps = {
        key: SignificanceMap(int(n), channels, times, d.astype(float), s.astype(bool), np.zeros(0))
        for key, n, d, s in zip(names, firsts["n"], difference, significant, strict=True)
    }
    spread = {key: one.astype(float) for key, one in zip(names, sd, strict=True)}
    return TestedCoefficients(maps, spread, int(keys["subjects"].iloc[0]), float(keys["gap_s"].iloc[0]))
