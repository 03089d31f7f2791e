"""Many analyses of the same data: which there are, what holds in how many, and which choice moves what.

Steegen et al. 2016, Perspect Psychol Sci 11:702, doi:10.1177/1745691616658637 (multiverse); Simonsohn et al. 2020, Nat
Hum Behav 4:1208, doi:10.1038/s41562-020-0912-z (specification curve).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

FITS, DIFFERS, OPEN = "fits", "differs", "cannot tell"
"""What a universe has to say on a finding, whatever its data are worth."""

Chosen = Mapping[str, str]
"""Choice -> the name of the value that was taken."""


def universes(crossed: Mapping[str, Sequence[str]], alone: Mapping[str, Sequence[str]]) -> list[dict[str, str]]:
    """Return every universe: all combinations of the crossed choices, then each other value alone.

    Args:
        crossed, alone: Choice -> names of its values, the study's own first.

    Returns:
        Choice -> value of each; the first has the study's own values throughout. Each universe once.
    """
    study = {name: values[0] for name, values in {**crossed, **alone}.items()}
    combined = [{**study, **dict(zip(crossed, one, strict=True))} for one in itertools.product(*crossed.values())]
    others = [{**study, name: value} for name, values in alone.items() for value in values[1:]]
    return [*combined, *others]


def differing(chosen: Chosen, study: Chosen) -> dict[str, str]:
    """Return what a universe chose otherwise than the study."""
    return {name: value for name, value in chosen.items() if value != study[name]}


def pairs(every: Sequence[Chosen]) -> dict[str, list[tuple[int, int]]]:
    """Return choice -> pairs of universes (their places) that differ in this choice alone.

    What a choice moves is seen in such pairs, in a full crossing as well as one at a time.
    """
    found: dict[str, list[tuple[int, int]]] = {name: [] for name in every[0]} if every else {}
    for name in found:
        alike: dict[tuple[str, ...], list[int]] = {}
        for place, one in enumerate(every):
            alike.setdefault(tuple(value for other, value in one.items() if other != name), []).append(place)
        for places in alike.values():
            found[name] += itertools.combinations(places, 2)
    return found


def influence(verdicts: pd.DataFrame, every: Sequence[Chosen]) -> pd.DataFrame:
    """Return how much each choice moves each finding.

    Args:
        verdicts: One row a universe and finding: ``universe`` (place in ``every``), ``analysis`` (of the first universe
            to whose analysis this finding owes the same), ``finding``, ``value`` (NaN: none), ``fits`` (:data:`FITS`,
            :data:`DIFFERS` or :data:`OPEN`).
        every: The universes.

    Returns:
        One row a finding and choice: ``pairs`` of analyses that this choice alone tells apart, both with the finding,
        ``flips``, the share of those pairs that are told apart by it (of pairs in which both fit or differ; NaN without
        any), ``moved``, the mean absolute difference of their values, and ``most``, the largest.
    """
    by_choice = {name: np.array(of, int).reshape(-1, 2) for name, of in pairs(every).items()}
    rows = []
    for finding, own in verdicts.groupby("finding", sort=False):
        values, fits = np.full(len(every), np.nan), np.full(len(every), np.nan)
        there, analysis = np.zeros(len(every), bool), np.arange(len(every))
        places = own["universe"].to_numpy(int)
        there[places] = True
        analysis[places] = own["analysis"].to_numpy(int)
        values[places] = own["value"].to_numpy(float)
        fits[places] = own["fits"].map({FITS: 1.0, DIFFERS: 0.0}).to_numpy(float)
        for choice, of in by_choice.items():
            kept = _distinct(analysis[of[there[of].all(axis=1)]])
            rows.append((finding, choice, len(kept), *_moved(values, fits, kept)))
    return pd.DataFrame(rows, columns=["finding", "choice", "pairs", "flips", "moved", "most"])


def _distinct(of: np.ndarray) -> np.ndarray:
    """Return pairs, shape (n_pairs, 2), each once, without those of an analysis with itself."""
    apart = np.sort(of[of[:, 0] != of[:, 1]], axis=1)
    return np.unique(apart, axis=0)


def _moved(values: np.ndarray, fits: np.ndarray, of: np.ndarray) -> tuple[float, float, float]:
    """Return the share of pairs, shape (n_pairs, 2), that flip, and the mean and largest difference of their values."""
    flips = np.abs(np.diff(fits[of], axis=1))
    apart = np.abs(np.diff(values[of], axis=1))
    flips, apart = flips[np.isfinite(flips)], apart[np.isfinite(apart)]
    mean, most = (float(apart.mean()), float(apart.max())) if len(apart) else (np.nan, np.nan)
    return float(flips.mean()) if len(flips) else np.nan, mean, most


def once(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Return the verdicts of each analysis of a finding once: those of the first universe that does it."""
    return verdicts[verdicts["universe"] == verdicts["analysis"]]


def held(verdicts: pd.DataFrame, moved: pd.DataFrame) -> pd.DataFrame:
    """Return what holds in how many analyses, and which choice moves it most.

    Universes that do the same for a finding, as they differ in what comes after it or stands beside it, are one
    analysis of it.

    Args:
        verdicts: As of :func:`influence`; universe 0 is the study's own.
        moved: What that function returns of them.

    Returns:
        One row a finding, in the order of ``verdicts``: ``study`` (what the study's own universe has to say),
        ``analyses`` (how many there are), ``fits``, ``differs``, ``open`` (how many of them), ``share`` (that fit, of
        those that fit or differ; NaN without any), ``value`` (the study's own), ``low``, ``high`` (range of the
        values), ``choice`` (that moves it most: flips it in the largest share of pairs, then moves its value farthest
        on average; empty where none does), ``flips``, ``moved``, ``pairs`` (of that choice).
    """
    rows = []
    for finding, own in verdicts.groupby("finding", sort=False):
        each = once(own)
        counts = each["fits"].value_counts()
        fits, differs, unknown = (int(counts.get(word, 0)) for word in (FITS, DIFFERS, OPEN))
        study = own[own["universe"] == 0]
        told = (str(study["fits"].iloc[0]), float(study["value"].iloc[0])) if len(study) else ("", np.nan)
        values = own["value"].dropna()
        span = (values.min(), values.max()) if len(values) else (np.nan, np.nan)
        share = fits / (fits + differs) if fits + differs else np.nan
        numbers = (len(each), fits, differs, unknown, share)
        rows.append((finding, told[0], *numbers, told[1], *span, *_most(moved, finding)))
    counted = ["analyses", "fits", "differs", "open", "share"]
    columns = ["finding", "study", *counted, "value", "low", "high", "choice", "flips", "moved", "pairs"]
    return pd.DataFrame(rows, columns=columns)


def _most(moved: pd.DataFrame, finding: object) -> tuple[str, float, float, int]:
    """Return the choice that moves a finding most, how often it flips it, how far it moves it, and its pairs."""
    own = moved[moved["finding"] == finding].fillna({"flips": 0.0, "moved": 0.0})
    own = own[(own["flips"] > 0) | (own["moved"] > 0)].sort_values(["flips", "moved"], ascending=False, kind="stable")
    if own.empty:
        return "", np.nan, np.nan, 0
    first = own.iloc[0]
    return str(first["choice"]), float(first["flips"]), float(first["moved"]), int(first["pairs"])


def in_words(chosen: Iterable[tuple[str, str]]) -> str:
    """Return choices and their values in a line; of none, that all is as in the study."""
    return "; ".join(f"{name}: {value}" for name, value in chosen) or "as in the study"
