"""Group statistics: exact sign flips over subjects, Holm's correction, and what a test could have found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.eeg.permutation import all_signs, random_signs

# Up to here all flips are computed; beyond, as many are drawn at random.
_EXACT_SUBJECTS = 16


@dataclass(frozen=True)
class Spread:
    """Mean and SD (n − 1) over the subjects that have a value, in percent, and what the test could have found.

    Attributes:
        mean, sd: NaN without subjects, and with one.
        n: Subjects with a value.
        half_width: Half the width of the mean's 95 % interval (t distribution); NaN below two subjects.
        detectable: As :func:`spread` says.
    """

    mean: float
    sd: float
    n: int
    half_width: float
    detectable: float


def spread(values: np.ndarray) -> Spread:
    """Return mean, SD, n and interval of the finite values, and the smallest mean detected with 80 % power.

    ``detectable`` is 50 plus the effect, in percent, at which a one-sided test at 5 % of the mean against 50 finds the
    effect in four of five studies with this SD and n (noncentral t). NaN below three subjects, and where not even 100
    would be detected.
    """
    finite = values[np.isfinite(values)]
    n = len(finite)
    mean = float(finite.mean()) if n else float("nan")
    sd = float(finite.std(ddof=1)) if n > 1 else float("nan")
    half_width = _t_quantile(0.975, n - 1) * sd / np.sqrt(n) if n > 1 else float("nan")
    detectable = 50 + sd * _effect_for_power(n) if n > 2 else float("nan")
    return Spread(mean, sd, n, float(half_width), detectable if detectable <= 100 else float("nan"))


def sign_flip_p(values: np.ndarray, rng: np.random.Generator, *, two_sided: bool = False) -> float:
    """Return the p value of the mean against 0 under sign flips of the subjects; NaN without subjects.

    All 2ⁿ flips up to 16 subjects, above that 2¹⁶ − 1 random ones and the identity. One-sided: mean > 0.

    Args:
        values: ndarray, shape (n_subjects,), e.g. balanced accuracy − 50; values that are not finite are left out.
        rng: Used above 16 subjects only.
    """
    finite = values[np.isfinite(values)]
    n = len(finite)
    if not n:
        return float("nan")
    flips = all_signs(n) if n <= _EXACT_SUBJECTS else random_signs(n, rng, count=2**_EXACT_SUBJECTS)
    sums = flips @ finite
    if two_sided:
        sums = np.abs(sums)
    # The tolerance keeps equal sums equal, whatever order they were added in.
    return float(np.mean(sums >= sums[0] - 1e-9 * np.abs(finite).sum()))


def holm(p_values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return Holm's adjusted p values (Scand. J. Stat. 6:65, 1979); NaN stays NaN and does not count as a test."""
    p = np.asarray(p_values, dtype=float)
    adjusted = np.full(len(p), np.nan)
    order = [i for i in np.argsort(p, kind="stable") if np.isfinite(p[i])]
    steps = [p[i] * (len(order) - rank) for rank, i in enumerate(order)]
    for i, value in zip(order, np.maximum.accumulate(steps) if steps else (), strict=True):
        adjusted[i] = min(1.0, value)
    return adjusted


def _t_quantile(quantile: float, df: int) -> float:
    from scipy.stats import t

    return float(t.ppf(quantile, df))


def _effect_for_power(n: int, *, alpha: float = 0.05, power: float = 0.8) -> float:
    """Return the effect, in SD, that a one-sided one-sample t test of n subjects detects with ``power``."""
    from scipy.optimize import brentq
    from scipy.stats import nct

    critical = _t_quantile(1 - alpha, n - 1)
    return float(brentq(lambda d: nct.sf(critical, n - 1, d * np.sqrt(n)) - power, 0.01, 20.0))
