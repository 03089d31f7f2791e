"""How good must a decoder be? Learning over a grid of decoders, tasks and parameters."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np

from hrcneuro.learning.analytic import answer_probabilities, expected_curves
from hrcneuro.learning.decoder import Answers, CoinFlips
from hrcneuro.learning.grid import AXES, GridPoint
from hrcneuro.learning.learner import PaperLearner, learn
from hrcneuro.learning.learners import Kind
from hrcneuro.learning.milestones import LEVELS, first_at
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.simulations import BLOCK, Z95
from hrcneuro.learning.task import Draws, JointTask, draw

_COLUMNS = 2000
LEVEL = LEVELS[-1]  # how good a robot must become
TRIALS_S = (1.0, 2.0)  # how long a trial takes: the two readings of the paper's minutes
GOAL_MIN = 10.0  # so long may it take to become that good


def task_of(point: GridPoint, episodes: int, *, carry_over: bool = False) -> JointTask:
    """Return a point's task."""
    task = JointTask(
        subtasks=point.subtasks,
        chosen=point.chosen,
        episodes=episodes,
        events=point.events,
        carry_over=carry_over,
    )
    return replace(task, reassign="every", period=point.period) if point.period else task


@dataclass(frozen=True)
class Reached:
    """What learning came to in one point.

    Attributes:
        episode: First episode whose mean accuracy reaches the level, None where none does.
        expected_episode: The same of the analytic expectation; None too where tasks change or no closure is known.
        final: Mean accuracy after the last episode, with half the width of its 95 % band.
        in_time: The same after the last episode that ends within :data:`GOAL_MIN`, for each of :data:`TRIALS_S`.
    """

    point: GridPoint
    episode: int | None
    expected_episode: int | None
    final: float
    final_half_width: float
    in_time: tuple[tuple[float, float], ...]


def episodes_in_time(events: int, trial_s: float, episodes: int) -> int:
    """Return how many episodes end within :data:`GOAL_MIN`, 1 at least and no more than are learned."""
    return max(1, min(episodes, int(60.0 * GOAL_MIN / (events * trial_s))))


def run_points(
    points: Sequence[GridPoint],
    kind: Kind | None,
    *,
    episodes: int,
    repetitions: int,
    seed: int,
    level: float = LEVEL,
    ddof: int = 0,
    carry_over: bool = False,
) -> list[Reached]:
    """Return what learning comes to in each point.

    GridPoints with the same n and episode length share subtasks, assignments and decoder draws, so that the surface is
    smooth; the draws depend on the seed and on these two alone.

    Args:
        points: Points of the grid, best sorted.
        kind: A learner; None: the paper's, with each point's α.
        episodes: Episodes to learn.
        repetitions: Restarts a point.
        seed: Seed of the draws.
        level: Accuracy to reach.
        ddof: As in Eq 6's SD, for the paper's learner; a ``kind`` has its own.
        carry_over: As in :class:`~hrcneuro.learning.task.JointTask`.
    """
    looked_at = [[episodes_in_time(p.events, s, episodes) for s in TRIALS_S] + [episodes] for p in points]
    curves = _Curves(np.array(looked_at, int).reshape(len(points), len(TRIALS_S) + 1), episodes)
    for _, group in itertools.groupby(enumerate(points), key=lambda item: (item[1].events, item[1].subtasks)):
        members = list(group)
        for block in range(-(-repetitions // BLOCK)):
            keep = min(BLOCK, repetitions - block * BLOCK)
            store = _Draws(episodes, seed, block, keep, carry_over)
            for start in range(0, len(members), _COLUMNS // BLOCK):
                some = members[start : start + _COLUMNS // BLOCK]
                curves.add([i for i, _ in some], _learn([c for _, c in some], kind, store, ddof), keep)
    tasks = [task_of(point, episodes, carry_over=carry_over) for point in points]
    expected = [None] * len(points) if kind is not None else _expected(points, tasks, level, ddof)
    reached = []
    for i, point in enumerate(points):
        mean, ends = curves.of(i)
        reached.append(Reached(point, first_at(mean, level), expected[i], *ends[-1], tuple(ends[:-1])))
    return reached


class _Curves:
    """Sums over repetitions, a row a point.

    Args:
        looked_at: ndarray, shape (n_points, n_ends): episodes, counted from 1, whose accuracy is given a band.
        episodes: How many are learned.
    """

    def __init__(self, looked_at: np.ndarray, episodes: int) -> None:
        self.at = looked_at - 1
        self.total = np.zeros((len(looked_at), episodes))
        self.square, self.n = np.zeros(looked_at.shape), np.zeros(len(looked_at), int)

    def add(self, rows: list[int], soft: np.ndarray, keep: int) -> None:
        for k, row in enumerate(rows):
            part = np.ascontiguousarray(soft[:, k * keep : (k + 1) * keep])
            self.total[row] += part.sum(axis=1)
            self.square[row] += [float(part[end] @ part[end]) for end in self.at[row]]
            self.n[row] += keep

    def of(self, row: int) -> tuple[np.ndarray, list[tuple[float, float]]]:
        """Return the mean curve, and mean and half the width of its 95 % band at each episode looked at."""
        n = int(self.n[row])
        mean = self.total[row] / n
        ends = mean[self.at[row]]
        variance = np.maximum(self.square[row] / n - ends**2, 0.0) * n / max(n - 1, 1)
        return mean, list(zip(ends.tolist(), (Z95 * np.sqrt(variance / n)).tolist(), strict=True))


class _Draws:
    """The draws of one block for each task, and what a decoder of some rate makes of them."""

    def __init__(self, episodes: int, seed: int, block: int, keep: int, carry_over: bool) -> None:
        self.episodes, self.seed, self.block, self.keep, self.carry_over = episodes, seed, block, keep, carry_over
        self.tasks: dict[JointTask, Draws] = {}

    def of(self, point: GridPoint, evidence: bool) -> tuple[Draws, Answers]:
        task = task_of(point, self.episodes, carry_over=self.carry_over)
        if task not in self.tasks:
            if len(self.tasks) > 8:  # points come sorted: old tasks do not come back
                self.tasks.clear()
            rng = np.random.default_rng([self.seed, *b"sweep", point.events, point.subtasks, self.block])
            self.tasks[task] = draw(task, BLOCK, rng).first(self.keep)
        draws = self.tasks[task]
        # Coin flips need no generator: all their chance is in the draws.
        answers = CoinFlips(Rates.level(point.accuracy)).answer(draws, np.random.default_rng(0), evidence=evidence)
        return draws, answers


def _learn(points: list[GridPoint], kind: Kind | None, store: _Draws, ddof: int) -> np.ndarray:
    both = [store.of(c, kind is not None) for c in points]
    alpha, tau = (np.repeat([getattr(c, name) for c in points], store.keep) for name in ("alpha", "tau"))
    evidence = None if kind is None else [h.log_odds(kind.evidence) for _, h in both]

    def paper(subtasks: int, columns: int) -> PaperLearner:
        return PaperLearner(subtasks, columns, alpha=np.resize(alpha, columns), ddof=ddof)

    make = paper if kind is None else kind.make
    predicted = [h.predicted for _, h in both]
    return learn(make, [d for d, _ in both], predicted, tau=tau if len(tau) > 1 else float(tau[0]), evidence=evidence)[
        0
    ]


def _expected(points: Sequence[GridPoint], tasks: Sequence[JointTask], level: float, ddof: int) -> list[int | None]:
    episodes: list[int | None] = [None] * len(points)
    still = [(i, c) for i, c in enumerate(points) if not c.period]
    for _, group in itertools.groupby(still, key=lambda item: (item[1].events, item[1].subtasks)):
        members = list(group)
        for start in range(0, len(members), 200):
            some = members[start : start + 200]
            human = np.array([np.arange(c.subtasks) < c.chosen for _, c in some])
            p = np.array(
                [answer_probabilities(h, Rates.level(c.accuracy)) for h, (_, c) in zip(human, some, strict=True)]
            )
            alpha, tau = (np.array([getattr(c, name) for _, c in some]) for name in ("alpha", "tau"))
            curves = expected_curves(tasks[some[0][0]], human, p, alpha=alpha, tau=tau, ddof=ddof)
            for (i, _), curve in zip(some, curves, strict=True):
                episodes[i] = first_at(curve, level)
    return episodes


def columns(reached: Sequence[Reached]) -> dict[str, np.ndarray]:
    """Return the points and what they reached as columns; a level that is not reached is nan."""
    axes = np.array([astuple(r.point) for r in reached], float).reshape(-1, len(AXES)).T
    table = dict(zip(AXES, axes, strict=True))
    for name in ("episode", "expected_episode"):
        values = [getattr(r, name) for r in reached]
        table[name] = np.array([np.nan if v is None else v for v in values], float)
    ends = {"final": [(r.final, r.final_half_width) for r in reached]}
    ends |= {f"in_time_{s:g}s": [r.in_time[i] for r in reached] for i, s in enumerate(TRIALS_S)}
    for name, pairs in ends.items():
        table[name], table[f"{name}_half_width"] = np.array(pairs, float).reshape(-1, 2).T
    return table


@dataclass(frozen=True)
class Needed:
    """The smallest accuracy of a decoder with which a level is reached.

    Attributes:
        accuracy: Interpolated between two swept values, %; nan where none of them is enough.
        low, high: Edges of its 95 % Monte-Carlo band, %, inside what was swept; ``high`` is nan where the band of no
            swept value lies above the level.
        below: The largest swept value that is not enough, %; nan where already the smallest one is.
        above: The swept value that is enough, %; nan where none is.
    """

    accuracy: float
    low: float
    high: float
    below: float
    above: float


def needed(accuracy: np.ndarray, reached: np.ndarray, half_width: np.ndarray, level: float = LEVEL) -> Needed:
    """Return how good a decoder must be, from what a robot has learned with decoders of several accuracies.

    Args:
        accuracy: ndarray, shape (n_values,), %, rising.
        reached: ndarray, shape (n_values,), choice accuracy.
        half_width: ndarray, shape (n_values,), half the width of its 95 % band.
        level: Choice accuracy to reach.
    """
    at = first_at(reached, level)
    return Needed(
        _crossing(accuracy, reached, level),
        _crossing(accuracy, reached + half_width, level),
        _crossing(accuracy, reached - half_width, level),
        float("nan") if at == 1 else float(accuracy[len(accuracy) - 1 if at is None else at - 2]),
        float("nan") if at is None else float(accuracy[at - 1]),
    )


def _crossing(x: np.ndarray, y: np.ndarray, level: float) -> float:
    """Return where y first reaches the level, on straight lines between its points; nan where it does not."""
    at = first_at(y, level)
    if at is None:
        return float("nan")
    if at == 1:
        return float(x[0])
    share = (level - y[at - 2]) / (y[at - 1] - y[at - 2])
    return float(x[at - 2] + share * (x[at - 1] - x[at - 2]))
