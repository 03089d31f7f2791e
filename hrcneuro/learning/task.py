"""The joint task of §3.1–3.2: subtasks, who takes them, and every random draw of a repetition."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrcneuro.learning.params import MOST_SUBTASKS, TaskParams

REASSIGN = ("never", "once", "every")


@dataclass(frozen=True)
class JointTask(TaskParams):
    """A task of ``subtasks`` (the paper's n) of which the human takes ``chosen`` (m), in episodes of ``events`` (o).

    Attributes:
        reassign: ``never``; ``once`` after ``period`` episodes; ``every`` ``period`` episodes. An independent redraw.
        carry_over: The event before an episode's first is the last of the episode before; otherwise there is none,
            and the first event teaches nothing.

    Raises:
        ValueError: A number is outside its limits, or the human takes none or all of the subtasks.
    """

    reassign: str = "never"

    def __post_init__(self) -> None:
        if not 2 <= self.subtasks <= MOST_SUBTASKS:
            raise ValueError(f"subtasks is {self.subtasks}; allowed are 2 to {MOST_SUBTASKS}")
        if not 1 <= self.chosen < self.subtasks:
            raise ValueError(f"the human's subtasks are {self.chosen} of {self.subtasks}; allowed are 1 to n - 1")
        if self.episodes < 1 or self.events < 1 or self.period < 1:
            raise ValueError(
                f"episodes, events and period are {self.episodes}, {self.events}, {self.period}; each must be 1 or more"
            )
        if self.reassign not in REASSIGN:
            raise ValueError(f"reassign is {self.reassign!r}; allowed are {', '.join(REASSIGN)}")

    @property
    def segment(self) -> np.ndarray:
        """Which assignment holds in each episode, shape (n_episodes,)."""
        segment = np.arange(self.episodes) // self.period
        return np.minimum(segment, {"never": 0, "once": 1, "every": len(segment)}[self.reassign])


@dataclass(frozen=True)
class Draws:
    """All that chance decides, for some repetitions at once.

    Attributes:
        subtask: ndarray, shape (n_episodes, n_events, n_repetitions), uint8: the subtask of each event.
        human: ndarray, shape (n_assignments, n_subtasks, n_repetitions), bool: which subtasks are the human's.
        epsilon: ndarray, shape (n_episodes, n_events, n_repetitions), float64: Eq 4's draw from U(0, 100).
    """

    task: JointTask
    subtask: np.ndarray
    human: np.ndarray
    epsilon: np.ndarray

    @property
    def repetitions(self) -> int:
        """The number of repetitions."""
        return int(self.subtask.shape[2])

    def first(self, repetitions: int) -> Draws:
        """Return the first repetitions only."""
        keep = slice(repetitions)
        return Draws(self.task, self.subtask[..., keep], self.human[..., keep], self.epsilon[..., keep])


def draw(task: JointTask, repetitions: int, rng: np.random.Generator) -> Draws:
    """Return fresh episodes, assignments and decoder draws (§3.2); the sequences are new in every episode."""
    shape = (task.episodes, task.events, repetitions)
    subtask = rng.integers(0, task.subtasks, size=shape, dtype=np.uint8)
    epsilon = rng.random(shape) * 100.0
    # Last, and as an order of subtasks: tasks that differ in m or in reassignment alone share every other draw.
    order = rng.random((int(task.segment[-1]) + 1, task.subtasks, repetitions)).argsort(axis=1)
    return Draws(task, subtask, order < task.chosen, epsilon)


def actors(draws: Draws) -> np.ndarray:
    """Return whether the human acts: ndarray, shape (n_episodes, n_events, n_repetitions), bool."""
    # A bit a subtask: one shift beats a gather from the table by a factor of three.
    task = draws.task
    bits = np.uint32(1) << np.arange(task.subtasks, dtype=np.uint32)
    mask = (draws.human * bits[:, None]).sum(axis=1, dtype=np.uint32)
    return (mask[task.segment][:, None] >> draws.subtask) & np.uint32(1) != 0


def previous_actors(acting: np.ndarray, *, carry_over: bool) -> np.ndarray:
    """Return whether the human did the event before, same shape as ``acting``.

    An episode's first event has no event before it unless ``carry_over``; its value then means nothing, and
    :func:`taught` says so.
    """
    before = np.empty_like(acting)
    before[:, 1:] = acting[:, :-1]
    before[1:, 0] = acting[:-1, -1] if carry_over else False
    before[0, 0] = False
    return before


def taught(task: JointTask) -> np.ndarray:
    """Return which events lead to an update: ndarray, shape (n_episodes, n_events), bool; an event is before them."""
    has_before = np.ones((task.episodes, task.events), bool)
    has_before[:, 0] = task.carry_over
    has_before[0, 0] = False
    return has_before
