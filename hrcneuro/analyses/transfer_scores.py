"""Leave-one-subject-out decoding of a group: everyone's trials in, a row a subject, way and size of calibration out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses import shared_axes
from hrcneuro.decoding import calibration, chance, metrics, transfer
from hrcneuro.decoding.frozen_refusals import FewTrialsError
from hrcneuro.decoding.generators import named
from hrcneuro.decoding.transfer import Person, Scored
from hrcneuro.decoding.transfer_scheme import TransferScheme
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.tables.transfer import EVERY, NONE, SCORES

Place = tuple[str, str, str]
"""Signal, scenario and problem."""


@dataclass(frozen=True)
class GroupTrials:
    """Everyone's trials.

    Attributes:
        people: Signal, scenario and problem -> subject -> trials; of whom there are too few, not.
        warnings: Sentences on channels and trials that are left out.
    """

    people: Mapping[Place, Mapping[str, Person]]
    warnings: list[str]


def read(trials: Mapping[str, Path], channels: Mapping[str, Path]) -> GroupTrials:
    """Return everyone's trials with the channels that all have.

    Args:
        trials: Subject -> its trials.parquet.
        channels: Subject -> its channels.parquet.

    Raises:
        DataError: The subjects have no channel in common.
    """
    names = {unit: list(read_table(path)["channel"]) for unit, path in channels.items()}
    shared, warnings = shared_axes.shared_channels(names)
    people: dict[Place, dict[str, Person]] = {}
    for unit, path in trials.items():
        table = read_table(path, ["signal", "scenario", "problem", "onset_s", "block", "label"])
        values = read_lists(path, "features_uv").astype(float)
        picks = [names[unit].index(name) for name in shared]
        for (signal, scenario, problem), rows in _by_place(table):
            own = values[rows.index].reshape(len(rows), len(names[unit]), -1)[:, picks]
            one = _person(rows, own)
            if isinstance(one, Person):
                people.setdefault((signal, scenario, problem), {})[unit] = one
            else:
                warnings.append(f"{unit}, {signal}, {scenario}, {problem}: left out: {one}")
    return GroupTrials(dict(sorted(people.items())), warnings)


def _by_place(table: pd.DataFrame) -> Any:
    return table.groupby(["signal", "scenario", "problem"], sort=True)


def _person(rows: pd.DataFrame, features: np.ndarray) -> Person | str:
    """Return a subject's trials, or why there are too few."""
    labels, blocks = rows["label"].to_numpy(bool), rows["block"]
    known = blocks.to_numpy(int) if blocks.notna().all() else None
    try:
        parts, _ = calibration.held_out(labels, known, np.zeros(len(labels), int))
    except FewTrialsError as error:
        return str(error)
    return Person(features, labels, rows["onset_s"].to_numpy(float), parts)


def shuffled(people: Mapping[str, Person], rng: np.random.Generator) -> dict[str, Person]:
    """Return the same trials with each subject's labels shuffled within its held-out parts: nothing can be learned."""
    return {
        unit: Person(one.features, chance.permute_within(one.labels, one.parts, rng), one.onsets_s, one.parts)
        for unit, one in people.items()
    }


def scores(group: GroupTrials, scheme: TransferScheme) -> pd.DataFrame:
    """Return the rows of ``SCORES``; a place where fewer than two subjects are has none.

    Raises:
        MissingLibraryError: A way needs pyRiemann, which is not installed.
    """
    rows: list[dict[str, Any]] = []
    for place, people in group.people.items():
        if len(people) < 2:
            continue
        if scheme.shuffled:
            people = shuffled(people, named(scheme.seed, *place))
        for unit in people:
            rows += _of_target(place, people, unit, scheme)
    return pd.DataFrame(rows, columns=list(SCORES.columns))


def _of_target(
    place: Place, people: Mapping[str, Person], unit: str, scheme: TransferScheme
) -> Iterator[dict[str, Any]]:
    own = people[unit]
    n2 = int(np.count_nonzero(own.labels))
    counts = {"n1": len(own.labels) - n2, "n2": n2, "folds": len(np.unique(own.parts))}
    where = dict(zip(("signal", "scenario", "problem"), place, strict=True))
    for one in transfer.scored(people, unit, scheme, named(scheme.seed, *place, unit)):
        rates = dict(zip(metrics.RATES, metrics.rates(own.labels, one.scores), strict=True))
        yield {
            **where,
            **{"way": one.way, "calibration": _size(one), "subject": unit, **counts},
            **{"pairs": one.pairs, "minutes": one.minutes},
            **{name: 100 * value for name, value in rates.items()},
        }


def _size(one: Scored) -> str:
    if one.size is None:
        return EVERY
    return str(one.size) if one.size else NONE
