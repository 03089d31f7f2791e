"""How late one event shows another: a constant delay, its uncertainty, the jitter about it, and what it hangs on.

The same numbers serve every link of a chain: command and motion, marker and trigger edge, sample and disk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

_Z95 = 1.959963984540054


@dataclass(frozen=True)
class Estimate:
    """A number with what is known of it.

    Attributes:
        value: The number.
        low, high: The ends of its 95 % confidence interval.
    """

    value: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half the interval."""
        return (self.high - self.low) / 2


@dataclass(frozen=True)
class Latency:
    """Latencies of one kind.

    Attributes:
        n: How many.
        delay: Their median, of the same unit, with its interval: the constant part.
        sd: Standard deviation about the mean.
        jitter: The same with its interval.
        p99: 99 % lie no farther than this from the median.
        worst: The largest distance from the median.
        low, high: The least and the greatest latency.
    """

    n: int
    delay: Estimate
    sd: float
    jitter: Estimate
    p99: float
    worst: float
    low: float
    high: float


def latency(values: np.ndarray) -> Latency:
    """Return what some latencies amount to; NaN are left out.

    The interval of the median is that of order statistics, by the binomial distribution (Conover 1999, Practical
    Nonparametric Statistics, section 3.2): it asks nothing of how the latencies are distributed.

    Args:
        values: ndarray, shape (n,), of one unit.
    """
    known = np.sort(np.asarray(values, float)[np.isfinite(values)])
    n = len(known)
    if not n:
        nothing = math.nan
        unknown = Estimate(nothing, nothing, nothing)
        return Latency(0, unknown, nothing, unknown, nothing, nothing, nothing, nothing)
    middle = float(np.median(known))
    reach = _Z95 * math.sqrt(n) / 2
    first, last = max(math.floor(n / 2 - reach), 0), min(math.ceil(n / 2 + reach), n - 1)
    away = np.abs(known - middle)
    return Latency(
        n=n,
        delay=Estimate(middle, float(known[first]), float(known[last])),
        sd=float(known.std(ddof=1)) if n > 1 else 0.0,
        jitter=_spread(known),
        p99=float(np.percentile(away, 99)),
        worst=float(away.max()),
        low=float(known[0]),
        high=float(known[-1]),
    )


def _spread(values: np.ndarray) -> Estimate:
    """Return the standard deviation with its interval, by the fourth moment: it asks for no normal distribution.

    The variance of a sample variance s² is (m4 - s⁴ (n - 3) / (n - 1)) / n, m4 the fourth central moment (Mood,
    Graybill, Boes 1974, Introduction to the Theory of Statistics, section VI.2); s has half of that over s.
    """
    n = len(values)
    if n < 4 or not (sd := float(values.std(ddof=1))):
        return Estimate(float(values.std(ddof=1)) if n > 1 else 0.0, math.nan, math.nan)
    fourth = float(((values - values.mean()) ** 4).mean())
    half = _Z95 * math.sqrt(max(0.0, fourth - sd**4 * (n - 3) / (n - 1)) / n) / (2 * sd)
    return Estimate(sd, max(0.0, sd - half), sd + half)


def slope(x: np.ndarray, y: np.ndarray, *, groups: int = 1) -> Estimate:
    """Return by how much ``y`` grows with ``x``, by least squares; NaN where fewer than three points are known.

    Args:
        x, y: ndarray, shape (n,).
        groups: Of how many groups the means were taken off before: each costs a degree of freedom.
    """
    keep = np.isfinite(x) & np.isfinite(y)
    a, b = np.asarray(x, float)[keep], np.asarray(y, float)[keep]
    n = len(a)
    freedom = n - 1 - groups
    if freedom < 1 or np.ptp(a) == 0:
        return Estimate(math.nan, math.nan, math.nan)
    from scipy.stats import linregress, t

    fit = linregress(a, b)
    reach = float(t.ppf(0.975, freedom)) * float(fit.stderr) * math.sqrt((n - 2) / freedom)
    return Estimate(float(fit.slope), float(fit.slope) - reach, float(fit.slope) + reach)


def drift_ppm(samples: np.ndarray, when_s: np.ndarray, sfreq: float, segment: np.ndarray | None = None) -> Estimate:
    """Return how much faster a clock that counts samples runs than one in seconds, parts in a million.

    Args:
        samples: ndarray, shape (n,), of the samples at which events were seen.
        when_s: ndarray, shape (n,), when they were, s of the other clock, as it stamped them.
        sfreq: Nominal sampling rate, Hz.
        segment: ndarray, shape (n,), number of the stretch that holds each event: between two, samples are missing,
            and how many is not asked. None for a single one.
    """
    known = np.isfinite(samples) & np.isfinite(when_s)
    if not known.any():
        return Estimate(math.nan, math.nan, math.nan)
    groups = np.zeros(known.sum(), int) if segment is None else np.unique(segment[known], return_inverse=True)[1]
    # From their means on, in each stretch: a slope common to all. And of numbers as large as LSL's stamps, little would
    # be left of a slope.
    about = [one - (np.bincount(groups, one) / np.bincount(groups))[groups] for one in (when_s[known], samples[known])]
    rate = slope(*about, groups=int(groups.max()) + 1)
    # Where events keep step with the samples, they may all lie anywhere within an interval, and no residual shows it.
    across = float(np.sqrt((about[0] ** 2).sum()))
    half = max(rate.half, _Z95 / math.sqrt(12) / across) if across else math.nan
    return Estimate(*(1e6 * (one / sfreq - 1) for one in (rate.value, rate.value - half, rate.value + half)))


def nearest(events: np.ndarray, others: np.ndarray, *, window: float, expected: float = 0.0) -> np.ndarray:
    """Return for each event the index of the other that lies nearest to it and ``expected``; -1 for none in the window.

    Args:
        events, others: ndarrays, shapes (n,) and (m,), s; ``others`` ascending.
        window: How far it may be, s.
        expected: How much later than an event the other is, s.
    """
    if not len(others):
        return np.full(len(events), -1)
    wanted = np.asarray(events, float) + expected
    right = np.clip(np.searchsorted(others, wanted), 0, len(others) - 1)
    left = np.maximum(right - 1, 0)
    best = np.where(np.abs(others[left] - wanted) <= np.abs(others[right] - wanted), left, right)
    return np.where(np.abs(others[best] - wanted) <= window, best, -1)
