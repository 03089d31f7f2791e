"""Sign-flip tests over subjects, corrected over all channels, times and frequencies (paper appendix S2).

Without an effect a subject's difference is as likely to have the other sign. All sign patterns (or many random ones)
give the distribution of the smallest and of the largest t of a map; the observed map is held against both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Equal statistics that differ by rounding count as ties, for a tie counts against significance.
_TIE = 1e-10
# Columns and flips a block of the matrix product: a quarter of a megabyte, which stays in the second-level cache.
_COLUMNS, _ROWS = 2048, 32


@dataclass(frozen=True)
class FlipTest:
    """The result of a sign-flip test; arrays have the shape of one subject's map.

    ``low`` and ``high`` are the thresholds on t: those of the extreme statistics, infinite where so few subjects can
    never reach significance; for clusters, the threshold that forms them.
    """

    t: Floats
    p: Floats
    significant: NDArray[np.bool_]
    low: float
    high: float
    flips: int
    exact: bool


def sign_patterns(n: int, rng: np.random.Generator, *, exact_to: int, count: int) -> tuple[Floats, bool]:
    """Return sign patterns, shape (n_patterns, n), one of each pair of opposite patterns, and whether they are all.

    The first pattern flips nobody. The opposite half need not be computed: its t maps are the negatives.

    Args:
        n: Number of subjects.
        rng: Draws the patterns where ``n`` is greater than ``exact_to``.
        exact_to: Up to this number of subjects every pattern is taken: 2ⁿ with their opposites.
        count: Otherwise this number, opposites included.
    """
    if n <= exact_to:
        rest = all_signs(n - 1)
        return np.hstack([np.ones((len(rest), 1)), rest]), True
    return random_signs(n, rng, count=max(count // 2, 1)), False


def all_signs(n: int) -> Floats:
    """Return every sign pattern of ``n`` subjects, ndarray, shape (2ⁿ, n); the first flips nobody."""
    bits = np.arange(2**n)[:, None] >> np.arange(n) & 1
    return np.asarray(1.0 - 2.0 * bits, dtype=np.float64)


def random_signs(n: int, rng: np.random.Generator, *, count: int) -> Floats:
    """Return random sign patterns of ``n`` subjects, ndarray, shape (count, n); the first flips nobody."""
    signs = rng.choice([-1.0, 1.0], size=(count, n))
    signs[0] = 1
    return signs


def t_values(x: Floats) -> Floats:
    """Return Student's one-sample t over the first axis; 0 where every value is 0, infinite where all are equal."""
    return _to_t(_share(x), len(x))


def extremes_plain(x: Floats, signs: Floats) -> tuple[Floats, Floats]:
    """Return the smallest and the largest t of the map under each sign pattern, shape (n_patterns,) each.

    This is the readable reference of :func:`extremes`.

    Args:
        x: Differences, ndarray, shape (n_subjects, ...).
        signs: Sign patterns, ndarray, shape (n_patterns, n_subjects).
    """
    flat = x.reshape(len(x), -1)
    root = np.sqrt(len(x))
    lows, highs = np.empty(len(signs)), np.empty(len(signs))
    for i, sign in enumerate(signs):
        flipped = sign[:, None] * flat
        t = flipped.mean(axis=0) / (flipped.std(axis=0, ddof=1) / root)
        lows[i], highs[i] = t.min(), t.max()
    return lows, highs


def extremes(x: Floats, signs: Floats) -> tuple[Floats, Floats]:
    """Return the same as :func:`extremes_plain`, from matrix products and the extremes of their rows.

    Flips leave the sum of squares alone, so t is a rising function of the signed sum s / √(n Σx²).
    """
    lows, highs = _share_extremes(x, signs)
    return _to_t(lows, len(x)), _to_t(highs, len(x))


def sign_flip_test(
    x: Floats, rng: np.random.Generator, *, alpha: float = 0.05, exact_to: int = 16, count: int = 10_000
) -> FlipTest:
    """Return the two-sided test of zero mean at every point, with p corrected by the extreme statistics.

    A point is significant where its t lies beyond the α/2 tail of the largest, or of the smallest, t of the flipped
    maps; its p is twice the smaller tail. That holds the family-wise error at α or below.

    Args:
        x: Differences, ndarray, shape (n_subjects, ...), finite.
        rng: See :func:`sign_patterns`, as for ``exact_to`` and ``count``.
        alpha: Family-wise error of both tails together.

    Raises:
        ValueError: Fewer than two subjects, or values that are not finite.

    Sources: Cohen, Analyzing Neural Time Series Data (2014), ch. 34; Nichols & Holmes 2002, doi:10.1002/hbm.1058.
    """
    _check(x)
    n = len(x)
    signs, exact = sign_patterns(n, rng, exact_to=exact_to, count=count)
    lows, highs = _share_extremes(x, signs)
    # An opposite pattern turns the map round, so its largest value is minus the smallest of the pattern itself; and
    # over both halves the smallest values are just the negatives of the largest.
    highs = np.sort(np.concatenate([highs, -lows]))
    total, share = len(highs), _share(x)
    reached = total - np.searchsorted(highs, np.abs(share) - _TIE)
    p = np.minimum(2.0 * reached / total, 1.0)
    allowed = int(np.floor(alpha / 2 * total + 1e-9))
    threshold = float(_to_t(highs[total - 1 - allowed], n)) if allowed else np.inf
    return FlipTest(_to_t(share, n), p, reached <= allowed, -threshold, threshold, total, exact)


def cluster_test(
    x: Floats,
    adjacency: Any,
    *,
    alpha: float = 0.05,
    cluster_alpha: float = 0.05,
    exact_to: int = 16,
    count: int = 10_000,
    seed: int = 0,
) -> FlipTest:
    """Return MNE's cluster test: neighbours beyond a t threshold form clusters, tested by their summed t.

    A point's p is that of its cluster, 1 outside of any.

    Args:
        x: Differences, ndarray, shape (n_subjects, ...), finite.
        adjacency: Sparse matrix over the points of a map in C order (``mne.stats.combine_adjacency``).
        alpha: Family-wise error.
        cluster_alpha: Two-sided level of the t threshold that forms clusters.
        exact_to, count: See :func:`sign_patterns`.
        seed: Seed of random flips.

    Raises:
        ValueError: Fewer than two subjects, or values that are not finite.

    Source: Maris & Oostenveld 2007, doi:10.1016/j.jneumeth.2007.03.024.
    """
    import mne
    from scipy import stats

    _check(x)
    n = len(x)
    threshold = float(stats.t.ppf(1 - cluster_alpha / 2, n - 1))
    exact = n <= exact_to
    t = t_values(x)
    p = np.ones(t.size)
    if (np.abs(t) > threshold).any():
        _, clusters, cluster_p, _ = mne.stats.permutation_cluster_1samp_test(
            x.reshape(n, -1),
            threshold=threshold,
            # MNE's "all" asks for one too few and so draws at random; the full number gives every pattern.
            n_permutations=2 ** (n - 1) if exact else count,
            tail=0,
            adjacency=adjacency,
            out_type="indices",
            verbose="error",
            **{_mne_seed_name(): seed},
        )
        for (members, *_), value in zip(clusters, cluster_p, strict=True):
            p[members] = value
    corrected = p.reshape(x.shape[1:])
    return FlipTest(t, corrected, corrected <= alpha, -threshold, threshold, 2**n if exact else count, exact)


def _mne_seed_name() -> str:
    # MNE 1.13 renamed the argument and asks for the new name.
    import inspect

    from mne.stats import permutation_cluster_1samp_test

    return "rng" if "rng" in inspect.signature(permutation_cluster_1samp_test).parameters else "seed"


def smallest_p(n: int) -> float:
    """Return the smallest two-sided p that the sign flips of ``n`` subjects can give."""
    return min(1.0, 2.0 ** (1 - n))


def _check(x: Floats) -> None:
    if len(x) < 2:
        raise ValueError(f"a sign-flip test needs at least 2 subjects, got {len(x)}")
    if not np.isfinite(x).all():
        raise ValueError("a sign-flip test needs finite values; the differences hold NaN or infinity")


def _share(x: Floats) -> Floats:
    """Return s / √(n Σx²) over the first axis, between -1 and 1."""
    norm = np.sqrt(len(x) * np.einsum("i...,i...->...", x, x))
    return np.clip(x.sum(axis=0) / np.where(norm > 0, norm, 1), -1, 1)


def _to_t(share: Floats, n: int) -> Floats:
    with np.errstate(divide="ignore"):
        t: Floats = share * np.sqrt((n - 1) / (1 - share * share))
    return t


def _share_extremes(x: Floats, signs: Floats) -> tuple[Floats, Floats]:
    """Return the smallest and the largest share of the map under each sign pattern.

    Single precision finds, at half the cost, the few blocks of columns that can hold an extreme; only those are summed
    in double precision. A share's terms sum to at most 1 in size, so what single precision rounds away has a bound.
    """
    n = len(x)
    flat = x.reshape(n, -1)
    norm = np.sqrt(n * np.einsum("ij,ij->j", flat, flat))
    scale = 1 / np.where(norm > 0, norm, 1)
    blocks = [slice(start, start + _COLUMNS) for start in range(0, flat.shape[1], _COLUMNS)]
    rough = np.empty((2, len(blocks), len(signs)), np.float32)
    signs_single = signs.astype(np.float32)
    for ends, block in zip(rough.swapaxes(0, 1), blocks, strict=True):
        ends[:] = _of_sums(signs_single, (flat[:, block] * scale[block]).astype(np.float32))
    slack = 2 * (n + 2) * np.finfo(np.float32).eps
    may_hold = (rough[0] <= rough[0].min(axis=0) + slack) | (rough[1] >= rough[1].max(axis=0) - slack)
    lows, highs = np.full(len(signs), np.inf), np.full(len(signs), -np.inf)
    for block, candidates in zip(blocks, may_hold, strict=True):
        rows = np.flatnonzero(candidates)
        low, high = _of_sums(signs[rows], flat[:, block] * scale[block])
        lows[rows] = np.minimum(lows[rows], low)
        highs[rows] = np.maximum(highs[rows], high)
    return np.clip(lows, -1, 1), np.clip(highs, -1, 1)


def _of_sums(signs: NDArray[np.floating], terms: NDArray[np.floating]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the smallest and the largest signed sum over the columns of ``terms``, one of each a sign pattern."""
    lows, highs = np.empty((2, len(signs)), terms.dtype)
    room = np.empty((min(_ROWS, len(signs)), terms.shape[1]), terms.dtype)
    for first in range(0, len(signs), _ROWS):
        rows = slice(first, first + _ROWS)
        sums = np.matmul(signs[rows], terms, out=room[: len(signs[rows])])
        sums.min(axis=1, out=lows[rows])
        sums.max(axis=1, out=highs[rows])
    return lows, highs
