"""Differences between two conditions over subjects: how large, how sure, and corrected for all the points looked at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrcneuro.eeg.permutation import FlipTest

Floats = NDArray[np.float64]

Averages = Mapping[tuple[str, str], NDArray[np.floating]]
"""(scenario, condition) -> a subject's map."""

# Nobody's brain gives such a t; the noncentral distribution becomes slow to invert beyond.
_LARGEST = 1e3
_GRID = 2001


@dataclass(frozen=True)
class Contrast:
    """A paired contrast; arrays have the shape of one subject's map and the unit of the data.

    With one subject there is no test: ``test`` is None, ``sd`` and the effect sizes are NaN.

    Attributes:
        n: Subjects.
        difference, sd: Mean and SD (n - 1) of their differences.
        test: Whether the mean may be 0.
        dz, dz_low, dz_high: Cohen's dz and its confidence interval.
    """

    n: int
    difference: Floats
    sd: Floats
    test: FlipTest | None
    dz: Floats
    dz_low: Floats
    dz_high: Floats


@dataclass(frozen=True)
class GrandAverage:
    """A condition over subjects in one scenario; arrays have the shape and unit of a subject's map.

    Attributes:
        scenario, condition: What was averaged.
        n: Subjects.
        mean, sd: Over subjects; the SD (n - 1) is NaN with one.
    """

    scenario: str
    condition: str
    n: int
    mean: Floats
    sd: Floats

    @classmethod
    def of(cls, scenario: str, condition: str, maps: Sequence[NDArray[np.floating]]) -> GrandAverage:
        """Return the grand average of subjects' maps, summed in double precision whatever theirs is."""
        stack = np.stack(maps)
        unknown = np.full(stack.shape[1:], np.nan)
        sd = stack.std(axis=0, ddof=1, dtype=float) if len(stack) > 1 else unknown
        return cls(scenario, condition, len(stack), stack.mean(axis=0, dtype=float), sd)

    @property
    def error(self) -> Floats:
        """Standard error of the mean; NaN with one subject."""
        return self.sd / np.sqrt(self.n)


@dataclass(frozen=True)
class GroupContrast:
    """A contrast over subjects in one scenario.

    Attributes:
        scenario: ``all``, a scenario, or a stratum's label.
        name: Of the contrast.
        plus, minus: The conditions: the first less the second.
        units: The subjects that have both.
        result: What came out.
    """

    scenario: str
    name: str
    plus: str
    minus: str
    units: tuple[str, ...]
    result: Contrast


def summarise(differences: Floats, test: FlipTest | None, *, confidence: float = 0.95) -> Contrast:
    """Return the mean difference, its SD (n - 1), the test and Cohen's dz with its confidence interval.

    Args:
        differences: One map a subject, ndarray, shape (n_subjects, ...).
        test: The test of these differences; None with one subject.
        confidence: Level of the interval.
    """
    n = len(differences)
    mean = differences.mean(axis=0)
    if test is None:
        unknown = np.full(mean.shape, np.nan)
        return Contrast(n, mean, unknown, None, unknown, unknown, unknown)
    dz, low, high = effect_sizes(test.t, n, confidence=confidence)
    return Contrast(n, mean, differences.std(axis=0, ddof=1), test, dz, low, high)


def effect_sizes(t: Floats, n: int, *, confidence: float = 0.95) -> tuple[Floats, Floats, Floats]:
    """Return Cohen's dz = t / √n and the exact interval of the effect in the population.

    The interval holds every effect under which the observed t would not be surprising: t follows a noncentral t
    distribution with noncentrality √n δ. For large maps it is solved on a fine grid of t and interpolated, to a
    thousandth of its width.

    Args:
        t: One-sample t values; those beyond 1000, such as the infinite ones, are treated as 1000.
        n: Number of subjects, at least 2.
        confidence: Level of the interval.

    Source: Cumming & Finch 2001, doi:10.1177/0013164401614002; Lakens 2013, doi:10.3389/fpsyg.2013.00863.
    """
    from scipy.special import nctdtrinc

    finite = np.clip(t, -_LARGEST, _LARGEST)
    # Evenly spaced in arsinh: fine near 0, where the maps live, and wide enough for the largest value.
    grid = np.sinh(np.linspace(np.arcsinh(finite.min()), np.arcsinh(finite.max()), _GRID))
    if finite.size < _GRID:
        grid = np.unique(finite)
    tail = (1 - confidence) / 2
    low = np.interp(finite, grid, nctdtrinc(n - 1, 1 - tail, grid))
    high = np.interp(finite, grid, nctdtrinc(n - 1, tail, grid))
    root = np.sqrt(n)
    return finite / root, low / root, high / root
