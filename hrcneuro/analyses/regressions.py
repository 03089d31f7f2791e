"""Regression ERPs of one subject, scenario by scenario, and over subjects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses.group_tests import FlipOptions, group_contrast
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from hrcneuro.eeg.contrasts import GroupContrast
    from hrcneuro.eeg.formula import Predictors
    from hrcneuro.eeg.regression import OtherOnsets
    from hrcneuro.eeg.selection import LabelledEpochs
    from hrcneuro.tables.rerp import Part

    Floats = NDArray[np.float64]
    Maps = Mapping[tuple[str, str], Floats]
    Members = Sequence[tuple[str, NDArray[np.bool_]]]

INFLATED = 10.0
"""From here on a coefficient hangs so much on the others that its variance is ten times that of a free one."""


def fitted_together(table: pd.DataFrame, split: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return which trials are fitted together: those of each value of the column ``split``, or all of them.

    Raises:
        ConfigError: The split names no column.
    """
    import numpy as np

    from hrcneuro.analyses import conditions
    from hrcneuro.eeg.selection import ALL

    return conditions.scenarios(table, split) or [(ALL, np.ones(len(table), bool))]


def coefficients(
    trials: LabelledEpochs, members: NDArray[np.bool_], predictors: Predictors, others: OtherOnsets | None, whose: str
) -> Floats:
    """Return the coefficients of trials that are fitted together, neighbours' responses left in them or not.

    Args:
        trials: All epochs of the subject, without baseline correction.
        members: Which of them are fitted, ndarray, shape (n_epochs,).
        predictors: Of these.
        others: All other onsets of the recording; None: neighbours' responses are left in.
        whose: Named in errors.

    Returns:
        ndarray, shape (n_predictors, n_channels, n_times), µV a unit of the predictor.

    Raises:
        DataError: The responses cannot be told apart.
    """
    import numpy as np

    from hrcneuro.eeg.regression import APART, RegularOnsetsError, deconvolved, of_epochs

    if others is None:
        return of_epochs(trials.data[members], predictors.values)
    try:
        return deconvolved(trials.data[members], trials.onsets[members], predictors.values, others, apart=APART)
    except RegularOnsetsError as error:
        raise DataError(
            f"{whose}: onsets follow each other so regularly that the response of {predictors.names[error.column]} at "
            f"{1000 * trials.times[error.sample]:.0f} ms cannot be told from its neighbours'",
            cure="use rerp.overlap = 'keep', or shorten the epochs (epoch.tmin, epoch.tmax)",
        ) from error
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DataError(
            f"{whose}: the overlap of responses cannot be regressed out: {error}", cure="use rerp.overlap = 'keep'"
        ) from error


def around(
    trials: LabelledEpochs, members: NDArray[np.bool_], others: OtherOnsets, inside: NDArray[np.bool_], known: Floats
) -> OtherOnsets:
    """Return all onsets but those fitted: without an epoch, and with one that is fitted elsewhere.

    Args:
        trials: All epochs of the subject.
        members: Which of them are fitted, ndarray, shape (n_epochs,).
        others: The onsets without an epoch.
        inside: Of which of these the predictors are known, ndarray, shape (n_others,).
        known: Those, ndarray, shape (number inside, n_predictors).
    """
    import numpy as np

    from hrcneuro.eeg.regression import OtherOnsets

    rest = trials.onsets[~members]
    values = np.full((len(others.onsets) + len(rest), known.shape[1]), np.nan)
    values[: len(inside)][inside] = known
    whole = np.tile([0, len(trials.times)], (len(rest), 1))
    return OtherOnsets(np.concatenate([others.onsets, rest]), np.concatenate([others.spans, whole]), values)


def parts(
    averages: Mapping[str, Floats],
    means: Mapping[str, Floats],
    coefs: Mapping[str, Floats],
    contrasts: Mapping[str, Sequence[str]],
    scenario: str,
) -> list[Part]:
    """Return what the plain difference of each contrast's two averages is made of.

    A predictor's part is its coefficient times the difference of its means in the two conditions. So a difference
    between takeovers and continuations falls into what takeovers themselves change, and what comes from their following
    an error or preceding a turn more often.

    Args:
        averages: Condition -> its average, ndarray, shape (n_channels, n_times), µV.
        means: Condition -> mean of each predictor, ndarray, shape (n_predictors,).
        coefs: Coefficient -> ndarray, shape (n_channels, n_times), µV.
        contrasts: Name -> [plus, minus]; those that lack a condition are left out.
        scenario: Where.
    """
    from hrcneuro.tables.rerp import PLAIN, REST, Part

    made = []
    for contrast, (plus, minus) in contrasts.items():
        if plus not in averages or minus not in averages:
            continue
        plain = averages[plus] - averages[minus]
        shift = dict(zip(coefs, means[plus] - means[minus], strict=True))
        own = [Part(scenario, contrast, name, by, by * coefs[name]) for name, by in shift.items() if by]
        rest = plain - sum(part.map for part in own)
        nan = float("nan")
        made += [Part(scenario, contrast, PLAIN, nan, plain), *own, Part(scenario, contrast, REST, nan, rest)]
    return made


def chosen_contrasts(contrasts: Mapping[str, tuple[str, ...]], patterns: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the contrasts whose name fits a pattern."""
    return {name: pair for name, pair in contrasts.items() if any(fnmatchcase(name, one) for one in patterns)}


def over_subjects(maps: Mapping[str, Maps], config: FlipOptions, adjacency: Any) -> Iterator[GroupContrast]:
    """Yield each coefficient over the subjects whose trials have the predictor, tested against 0.

    Args:
        maps: Subject -> (scenario, coefficient) -> map, all of one shape.
        config: How they are tested.
        adjacency: For ``correction = "cluster"``: which points of a map are neighbours.
    """
    import numpy as np

    from hrcneuro.eeg.contrasts import GroupContrast

    for scenario, name in dict.fromkeys(key for own in maps.values() for key in own):
        units = tuple(unit for unit, own in maps.items() if (scenario, name) in own)
        stack = np.stack([maps[unit][scenario, name] for unit in units])
        result = group_contrast(stack, config, adjacency, stream=(scenario, name))
        yield GroupContrast(scenario, name, name, "0", units, result)


def inflated(fitted: Mapping[str, Predictors]) -> list[str]:
    """Return sentences on coefficients that hang much on the others, scenario -> predictors."""
    return [
        f"{scenario}: few trials tell {name} from the other predictors: they inflate its variance {factor:.0f} times"
        for scenario, one in fitted.items()
        for name, factor in zip(one.names, one.inflation, strict=True)
        if factor > INFLATED
    ]
