"""How often a robot's gaze went from where to where: the integers that turn one logged policy into the next.

The counts are not logged. A row of the policy before and after a trial gives them back: n_j = ±(s p'_j - p_j) / 0.1 for
the one sum s of the row before it was normalised. Every s that an integer solution allows is tried. Counts whose
probability was truncated leave a lower bound alone; s then follows from the number to which it was truncated.

That a policy comes out again of counts made from it proves nothing. Two things do, which the search does not know: the
number of transitions that the log has beside it, and that the counts of one trial must form one path of the gaze.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hrcneuro.learning.gaze import EDGE, FLOOR, STATES, STEP

MOST_WAYS = 5000  # in which truncated counts may be made up; more are taken for unknown
MOST = 200  # transitions from one state in one trial; the logs have up to 157 in all
_WHOLE = 1e-9  # how far a count may be from an integer: the logs have twelve digits
_SAME = 1e-8  # relative: whether a probability is the one to which it was truncated


@dataclass(frozen=True)
class RowCounts:
    """One solution of a row.

    Attributes:
        least: The counts, 4; of a truncated one the least that it can be.
        truncated: Which of them were truncated.
    """

    least: tuple[int, ...]
    truncated: tuple[bool, ...]


def row_solutions(before: np.ndarray, after: np.ndarray, *, error: bool) -> list[RowCounts]:
    """Return every solution of one row, those without truncated counts first, then by their sum.

    Args:
        before, after: ndarray, shape (4,): the row of the policy before and after the trial.
        error: Whether an error was decoded.
    """
    return _solutions(before[None], after[None], error=error)[0]


def follows(before: np.ndarray, after: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return whether any transitions lead from each trial's policy before it to the one after it, bool, (n_trials,).

    Args:
        before, after: ndarray, shape (n_trials, 4, 4).
        error: ndarray, shape (n_trials,), bool: whether an error was decoded.
    """
    found = np.zeros(len(error), bool)
    for wrong in (False, True):
        of = error == wrong
        solved, _, _ = _tried(before[of].reshape(-1, STATES), after[of].reshape(-1, STATES), error=wrong)
        found[of] = solved.any(axis=1).reshape(-1, STATES).all(axis=1)
    return found


def _solutions(before: np.ndarray, after: np.ndarray, *, error: bool) -> list[list[RowCounts]]:
    """Return the solutions of each of several rows, shape (n_rows, 4)."""
    sign, edge = (-1.0, 0.0) if error else (1.0, 1.0)
    solved, nearest, truncated = _tried(before, after, error=error)
    least = np.maximum(np.ceil(sign * (edge - before) / STEP - _WHOLE), 1).astype(int)
    rows = []
    for row, tried in enumerate(solved):
        found = {
            RowCounts(tuple(np.where(cut, least[row], n).tolist()), tuple(cut.tolist()))
            for n, cut in zip(nearest[row, tried], truncated[row, tried], strict=True)
        }
        rows.append(sorted(found, key=lambda one: (sum(one.truncated), sum(one.least), one.least)))
    return rows


def _tried(before: np.ndarray, after: np.ndarray, *, error: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, for each row and each sum that it may have had, whether it is a solution; its counts; which were cut.

    Args:
        before, after: ndarray, shape (n_rows, 4).
        error: Whether an error was decoded.

    Returns:
        ndarrays of shapes (n_rows, n_sums), (n_rows, n_sums, 4) and (n_rows, n_sums, 4).
    """
    sign = -1.0 if error else 1.0
    bound = FLOOR if error else 1.0 - FLOOR
    edge = 0.0 if error else 1.0
    sums = 1.0 + sign * STEP * np.arange(MOST + 1)
    sums = sums[sums > 0.5 * FLOOR]
    # A sum of 0 stands where a probability of 0 gives none; no row is solved by it.
    of_bound = np.divide(bound, after, out=np.zeros(after.shape), where=after > 0.0)
    scales = np.concatenate([np.broadcast_to(sums, (len(after), len(sums))), of_bound], axis=1)
    scaled = scales[..., None] * after[:, None]
    counts = sign * (scaled - before[:, None]) / STEP
    nearest = np.rint(counts).astype(int)
    at_bound = np.abs(scaled - bound) <= _SAME * bound
    inside = (nearest == 0) | (sign * (edge - scaled) > EDGE)
    whole = (np.abs(counts - nearest) < _WHOLE) & (nearest >= 0) & inside
    free = np.arange(scales.shape[1]) < len(sums)
    truncated = ~whole & at_bound & ~free[:, None]
    solved = (whole | truncated).all(axis=2) & (truncated.any(axis=2) != free)
    return solved, nearest, truncated


@dataclass(frozen=True)
class TrialCounts:
    """What the policies before and after a trial say of its transitions.

    Attributes:
        rows: The solutions of each of the four rows.
    """

    rows: tuple[tuple[RowCounts, ...], ...]

    @property
    def unique(self) -> bool:
        """Whether each row has exactly one solution."""
        return all(len(row) == 1 for row in self.rows)

    @property
    def solved(self) -> bool:
        """Whether each row has a solution."""
        return all(self.rows)

    @property
    def truncated(self) -> int:
        """How many counts were truncated, in the first solution of each row."""
        return sum(sum(row[0].truncated) for row in self.rows if row)

    @property
    def least(self) -> np.ndarray:
        """The first solution of each row: ndarray, shape (4, 4), int."""
        return np.array([row[0].least for row in self.rows])

    def matrices(self, transitions: int) -> np.ndarray:
        """Return all counts that have so many transitions in all, whether or not they are one path.

        Returns:
            ndarray, shape (n_ways, 4, 4), int; none where there are none, or more than ``MOST_WAYS``.
        """
        ways, left = [], MOST_WAYS
        for choice in itertools.product(*self.rows):
            least = np.array([row.least for row in choice])
            cut = np.array([row.truncated for row in choice])
            missing = transitions - int(least.sum())
            if missing < 0 or (missing and not cut.any()):
                continue
            if (more := _ways(missing, int(cut.sum()))) > left:
                return np.empty((0, STATES, STATES), int)
            left -= more
            for shares in _shared(missing, int(cut.sum())):
                ways.append(least.copy())
                ways[-1][cut] += np.array(shares, int)
        return np.array(ways, int).reshape(-1, STATES, STATES)

    def allows(self, transitions: int) -> bool:
        """Return whether some choice of solutions has that many transitions in all."""
        exact, least = {0}, None
        for row in self.rows:
            exact, least = _sums(exact, least, row)
        return transitions in exact or (least is not None and transitions >= least)


def _sums(exact: set[int], least: int | None, row: tuple[RowCounts, ...]) -> tuple[set[int], int | None]:
    """Return the sums that are possible with a row more: single ones, and the least from which on all are."""
    whole = {sum(one.least) for one in row if not any(one.truncated)}
    open_ended = [sum(one.least) for one in row if any(one.truncated)]
    from_here = [min(exact) + n for n in open_ended if exact]
    from_before = [least + n for n in (*whole, *open_ended)] if least is not None else []
    both = from_here + from_before
    return {a + b for a in exact for b in whole}, min(both) if both else None


def trial_counts(before: np.ndarray, after: np.ndarray, *, error: bool) -> TrialCounts:
    """Return what two successive policies, shape (4, 4) each, say of the transitions between them."""
    return TrialCounts(tuple(tuple(row) for row in _solutions(before, after, error=error)))


def _ways(missing: int, among: int) -> int:
    """Return in how many ways transitions can be shared out."""
    return math.comb(missing + among - 1, missing) if among else 1


def _shared(missing: int, among: int) -> Iterator[tuple[int, ...]]:
    """Yield each way in which transitions can be shared out: integers from 0, ``among`` of them."""
    for bars in itertools.combinations(range(missing + among - 1), among - 1) if among else ((),):
        edges = (-1, *bars, missing + among - 1)
        yield tuple(b - a - 1 for a, b in itertools.pairwise(edges)) if among else ()


def is_path(counts: np.ndarray) -> np.ndarray:
    """Return whether transitions can be walked in one go.

    Every state is left as often as it is come to, but for the first and the last, and all of them hang together.

    Args:
        counts: ndarray, shape (..., 4, 4), int.
    """
    leaving, coming = counts.sum(axis=-1), counts.sum(axis=-2)
    linked = (counts + np.swapaxes(counts, -1, -2) > 0) | np.eye(STATES, dtype=bool)
    within_reach = np.linalg.matrix_power(linked.astype(int), STATES - 1) > 0
    used = leaving + coming > 0
    apart = used[..., :, None] & used[..., None, :] & ~within_reach
    return (np.abs(leaving - coming).sum(axis=-1) <= 2) & ~apart.any(axis=(-1, -2))


def looks(counts: np.ndarray) -> np.ndarray:
    """Return the share of its looks at objects that went to each: chosen, others; shape (..., 3); zeros without any."""
    at = counts.sum(axis=-2)[..., : STATES - 1].astype(float)
    total = at.sum(axis=-1, keepdims=True)
    return np.divide(at, total, out=np.zeros_like(at), where=total > 0)
