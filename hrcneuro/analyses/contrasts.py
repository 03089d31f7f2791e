"""What erp and ersp share: conditions and contrasts, and testing contrasts over subjects."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses.group_tests import FlipOptions, group_contrast, size_warnings
from hrcneuro.contract import option
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.paradigm import design

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from hrcneuro.eeg.contrasts import Averages, GrandAverage, GroupContrast
    from hrcneuro.eeg.selection import LabelledEpochs, TrialSet


@dataclass(frozen=True)
class ContrastOptions(FlipOptions):
    """What the Configs of erp and ersp share: whose averages are compared, and how."""

    conditions: dict[str, str] = option(
        design.CONDITIONS, "condition -> pandas query on the trial table", shared="conditions"
    )
    contrasts: dict[str, tuple[str, ...]] = option(
        design.CONTRASTS, "contrast -> [plus, minus], names of conditions", shared="contrasts"
    )
    split: str = option("scenario", "trial column whose values are averaged apart too; empty for none", shared="split")
    strata: tuple[str, ...] = option(
        design.CUES,
        "trial columns whose values are the strata in which contrasts are computed again; empty for none",
    )
    stratified: tuple[str, ...] = option(("*_before",), "which contrasts that are, as patterns of their names")
    min_stratum: int = option(5, "trials a condition below which a subject's stratum is left out", low=1)


def filled_sets(trials: LabelledEpochs, config: ContrastOptions, unit: str) -> tuple[list[TrialSet], list[str]]:
    """Return the conditions' sets that hold trials, and a sentence on those that do not.

    Raises:
        DataError: No set holds a trial.
        ConfigError: A condition or the split does not fit the trial table.
    """
    from hrcneuro.analyses.conditions import trial_sets

    sets = trial_sets(trials.table, config.conditions, config.split)
    filled = [one for one in sets if one.n]
    if not filled:
        events = ", ".join(sorted({str(e) for e in trials.table["event"]})) if "event" in trials.table else "unknown"
        raise DataError(
            f"{unit}: none of the {len(trials.table)} epochs belongs to a condition ({', '.join(config.conditions)})",
            cure=f"correct the queries in [conditions]; the epochs' events are: {events}",
        )
    empty = [one.label for one in sets if not one.n]
    notes = [f"no trials, so left out: {', '.join(empty)}"] if empty else []
    return filled, notes + [
        f"no trial is of {text}" for text in absent(trials, config).values() if "did you mean" in text
    ]


def absent(trials: LabelledEpochs, config: ContrastOptions) -> dict[str, str]:
    """Return the conditions without an epoch, as :func:`.conditions.absent` does."""
    from hrcneuro.analyses import conditions

    members = conditions.matching(trials.table, config.conditions)
    return conditions.absent(trials.table, config.conditions, members)


def trial_counts(sets: Iterable[TrialSet]) -> dict[str, dict[str, int]]:
    """Return scenario -> condition -> number of trials."""
    counts: dict[str, dict[str, int]] = {}
    for one in sets:
        counts.setdefault(one.scenario, {})[one.condition] = one.n
    return counts


def in_order(pairs: Iterable[tuple[str, str]], conditions: Iterable[str]) -> list[tuple[str, str]]:
    """Return (scenario, condition) pairs once each: ``all`` first, then by scenario, conditions as configured."""
    from hrcneuro.eeg.selection import ALL

    rank = {name: i for i, name in enumerate(conditions)}
    return sorted(set(pairs), key=lambda p: (p[0] != ALL, p[0], rank.get(p[1], len(rank)), p[1]))


def grand_averages(averages: Mapping[str, Averages], config: ContrastOptions) -> list[GrandAverage]:
    """Return each condition's mean and SD over the subjects that have it, in the order of :func:`in_order`.

    Args:
        averages: Subject -> its maps, all of one shape.
        config: A Config with conditions.
    """
    from hrcneuro.eeg.contrasts import GrandAverage

    pairs = in_order((pair for maps in averages.values() for pair in maps), config.conditions)
    return [GrandAverage.of(*pair, [maps[pair] for maps in averages.values() if pair in maps]) for pair in pairs]


def own_averages(averages: Mapping[str, Averages], contrast: GroupContrast) -> tuple[GrandAverage, GrandAverage]:
    """Return the grand averages of a contrast's two conditions, over the subjects that have both."""
    from hrcneuro.eeg.contrasts import GrandAverage

    scenario = contrast.scenario
    plus, minus = (
        GrandAverage.of(scenario, condition, [averages[unit][scenario, condition] for unit in contrast.units])
        for condition in (contrast.plus, contrast.minus)
    )
    return plus, minus


def over_subjects(averages: Mapping[str, Averages], config: ContrastOptions, adjacency: Any) -> Iterator[GroupContrast]:
    """Yield each contrast of each scenario over the subjects that have both conditions; at least one has.

    Args:
        averages: Subject -> its maps, all of one shape.
        config: A Config with contrasts and test options.
        adjacency: For ``correction = "cluster"``: which points of a map are neighbours.
    """
    import numpy as np

    from hrcneuro.eeg.contrasts import GroupContrast

    pairs = in_order((pair for maps in averages.values() for pair in maps), config.conditions)
    for scenario in dict.fromkeys(scenario for scenario, _ in pairs):
        for name, (plus, minus) in config.contrasts.items():
            units = [u for u, maps in averages.items() if (scenario, plus) in maps and (scenario, minus) in maps]
            if not units:
                continue
            differences = np.stack(
                [np.subtract(averages[u][scenario, plus], averages[u][scenario, minus], dtype=float) for u in units]
            )
            result = group_contrast(differences, config, adjacency, stream=(scenario, name))
            yield GroupContrast(scenario, name, plus, minus, tuple(units), result)


def shortest_gap(trials: pd.DataFrame, sets: Sequence[TrialSet]) -> float | None:
    """Return the shortest time to the next onset among the trials of any set, s; None if unknown."""
    from hrcneuro.eeg.selection import shortest_gap_s

    return min(filter(math.isfinite, (shortest_gap_s(trials[one.mask]) for one in sets)), default=None)


def subject_peaks(
    averages: Averages, config: ContrastOptions, axes: Mapping[str, Iterable[Any]]
) -> dict[str, dict[str, Any]]:
    """Return scenario -> contrast -> where one subject's difference is largest; axes as in :func:`contrast_summary`."""
    peaks: dict[str, dict[str, Any]] = {}
    for scenario in dict.fromkeys(scenario for scenario, _ in in_order(averages, config.conditions)):
        for name, (plus, minus) in config.contrasts.items():
            if (scenario, plus) in averages and (scenario, minus) in averages:
                peak, _ = peak_of(averages[scenario, plus] - averages[scenario, minus], axes)
                peaks.setdefault(scenario, {})[name] = {"peak": peak}
    return peaks


def group_summary(
    averages: Mapping[str, Averages],
    tested: list[GroupContrast],
    axes: Mapping[str, Iterable[Any]],
    config: ContrastOptions,
    gap_s: float,
) -> dict[str, Any]:
    """Return the group's JSON summary; axes as in :func:`contrast_summary`, ``gap_s`` the shortest between onsets."""
    contrasts: dict[str, dict[str, Any]] = {}
    for one in tested:
        contrasts.setdefault(one.scenario, {})[one.name] = contrast_summary(one, axes)
    return {
        "subjects": list(averages),
        "correction": config.correction,
        "alpha": config.alpha,
        "contrasts": contrasts,
        "shortest_gap_s": jsonable(gap_s),
        "warnings": group_warnings(averages, tested, config),
    }


def group_warnings(
    averages: Mapping[str, Averages], tested: Iterable[GroupContrast], config: ContrastOptions
) -> list[str]:
    """Return sentences on contrasts that lack subjects and on tests that can never reach significance."""
    warnings, tested = [], list(tested)
    for t in tested:
        missing = sorted(set(averages) - set(t.units))
        if missing:
            warnings.append(
                f"{t.scenario}, {t.name}: without {', '.join(missing)}, who lack a condition (n = {len(t.units)})"
            )
    of_one = "a contrast of one subject cannot be tested: its difference is descriptive"
    warnings += size_warnings((t.result.n for t in tested), config.alpha, of_one=of_one)
    lost = [name for name in config.contrasts if name not in {t.name for t in tested}]
    if lost:
        warnings.append(f"no subject has both conditions of {', '.join(lost)}")
    return warnings


def contrast_summary(tested: GroupContrast, axes: Mapping[str, Iterable[Any]]) -> dict[str, Any]:
    """Return a contrast as JSON: subjects, significant points, thresholds, and where the difference is largest.

    There, at ``peak``, are the difference, its t and corrected p, and Cohen's dz with its confidence interval. The
    place was chosen for its size, so the effect there is larger than it would be at a place named beforehand.

    Args:
        tested: The contrast.
        axes: Name -> labels of each axis of the map, in their order.
    """
    result = tested.result
    peak, at = peak_of(result.difference, axes)
    summary: dict[str, Any] = {"n": result.n, "significant": 0, "p_min": None, "peak": peak}
    if result.test is not None:
        test = result.test
        peak |= {"t": jsonable(test.t[at]), "p": float(test.p[at])}
        peak |= {name: jsonable(getattr(result, name)[at]) for name in ("dz", "dz_low", "dz_high")}
        summary |= {"significant": int(test.significant.sum()), "p_min": float(test.p.min())}
        summary |= {
            "t_low": jsonable(test.low),
            "t_high": jsonable(test.high),
            "flips": test.flips,
            "exact": test.exact,
        }
    return summary


def peak_of(difference: NDArray[np.floating], axes: Mapping[str, Iterable[Any]]) -> tuple[dict[str, Any], Any]:
    """Return where a map is farthest from 0, as labels of its axes with the value there, and as an index."""
    from hrcneuro.eeg.evoked import farthest_from_zero

    labels = [list(values) for values in axes.values()]
    at = farthest_from_zero(difference)
    place = {name: jsonable(values[i]) for name, values, i in zip(axes, labels, at, strict=True)}
    return place | {"difference_uv": float(difference[at])}, at


def channel_adjacency(positions: pd.DataFrame) -> Any:
    """Return which channels are neighbours (Delaunay triangles on the scalp), as a sparse matrix.

    Args:
        positions: Channel -> x, y, z, m; NaN where unknown.

    Raises:
        ConfigError: A channel has no position.
    """
    import mne

    lost = positions.index[positions.isna().any(axis=1)]
    if len(lost):
        raise ConfigError(
            f"correction = 'cluster' needs the position of every channel; unknown: {', '.join(lost)}",
            cure="name the channels as in the 10-05 system, or use correction = 'max'",
        )
    info = mne.create_info(list(positions.index), 1.0, "eeg")
    places = dict(zip(positions.index, positions.to_numpy(), strict=True))
    info.set_montage(mne.channels.make_dig_montage(places, coord_frame="head"), verbose="error")
    # It tells at length that it found no template of the cap; it has no argument that keeps it quiet.
    with mne.use_log_level("error"):
        adjacency, _ = mne.channels.find_ch_adjacency(info, "eeg")
    return adjacency


def jsonable(value: Any) -> Any:
    """Return a number, or None for one that is not finite; words as they are."""
    if isinstance(value, str):
        return value
    number = float(value)
    return number if math.isfinite(number) else None
