"""SIM1–4 of §3.2, and the machine that runs many simulations in one sweep over the events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hrcneuro.learning.decoder import Answers, CoinFlips, Decoder
from hrcneuro.learning.learner import Make, learn
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.task import Draws, JointTask, draw

BLOCK = 100  # repetitions that share a generator: part of what a seed means, so not an option
Z95 = 1.959964  # half the width of a 95 % interval, in standard errors
COLUMNS = 2000  # repetitions advanced together: fits a core's cache, and decides no result


@dataclass(frozen=True)
class Variant:
    """One curve: a simulation, the name of its condition, the task and what the robot listens to."""

    simulation: str
    name: str
    task: JointTask
    decoder: Decoder


@dataclass(frozen=True)
class Curve:
    """Choice accuracy after each episode over the repetitions.

    Attributes:
        mean, sd: ndarray, shape (n_episodes,): mean and sample SD; the SD of one repetition is nan.
        greedy: ndarray, shape (n_episodes,): the mean share of subtasks whose better-valued action is correct.
        n: Number of repetitions.
    """

    mean: np.ndarray
    sd: np.ndarray
    greedy: np.ndarray
    n: int

    @property
    def half_width(self) -> np.ndarray:
        """Half the width of the mean's 95 % Monte-Carlo band, shape (n_episodes,)."""
        return Z95 * self.sd / np.sqrt(self.n)


def paper_simulations(
    base: JointTask,
    *,
    empirical: Decoder,
    levels: Sequence[float],
    reassign: str,
    cases: Sequence[tuple[int, int]],
) -> list[Variant]:
    """Return SIM1–4: 26 curves with the paper's four levels and three test cases (n, m).

    SIM1 is the empirical decoder; SIM2 sets the levels beside it; SIM3 is SIM2 with assignments redrawn; SIM4 is SIM2
    for each test case.
    """
    decoders: dict[str, Decoder] = {"emp": empirical} | {
        f"{level:g}": CoinFlips(Rates.level(level)) for level in levels
    }
    still, moving = replace(base, reassign="never"), replace(base, reassign=reassign)
    return (
        [Variant("SIM1", "emp", still, empirical)]
        + [Variant("SIM2", name, still, decoder) for name, decoder in decoders.items()]
        + [Variant("SIM3", name, moving, decoder) for name, decoder in decoders.items()]
        + [
            Variant("SIM4", f"{n}/{m} {name}", replace(still, subtasks=n, chosen=m), decoder)
            for n, m in cases
            for name, decoder in decoders.items()
        ]
    )


@dataclass(frozen=True)
class RepetitionBlock:
    """Up to ``BLOCK`` repetitions of one variant, with their draws and the decoder's answers."""

    variant: int
    draws: Draws
    answers: Answers


def blocks(
    variants: Sequence[Variant], *, repetitions: int, seed: int, evidence: bool = False, columns: int = COLUMNS
) -> Iterator[list[RepetitionBlock]]:
    """Yield lists of blocks that can be learned together, each list of about ``columns`` repetitions.

    A block's generator is seeded with (seed, simulation, variant, block): results depend neither on how blocks are
    put together nor on who computes them, and the first repetitions of a long run are those of a short one.
    """
    frames: dict[tuple, list[tuple[int, int]]] = {}
    for index, variant in enumerate(variants):
        task = variant.task
        frame = (task.subtasks, task.episodes, task.events, task.carry_over)
        frames.setdefault(frame, []).extend((index, block) for block in range(-(-repetitions // BLOCK)))
    at_once = max(1, columns // BLOCK)
    for work in frames.values():
        for start in range(0, len(work), at_once):
            yield [
                _block(variants[index], index, block, min(BLOCK, repetitions - block * BLOCK), seed, evidence)
                for index, block in work[start : start + at_once]
            ]


def _block(variant: Variant, index: int, block: int, keep: int, seed: int, evidence: bool) -> RepetitionBlock:
    rng = np.random.default_rng([seed, *f"{variant.simulation}/{variant.name}".encode(), block])
    draws = draw(variant.task, BLOCK, rng)
    answers = variant.decoder.answer(draws, rng, evidence=evidence)
    if keep < BLOCK:
        draws, answers = draws.first(keep), answers.first(keep)
    return RepetitionBlock(index, draws, answers)


def run_curves(
    variants: Sequence[Variant],
    make: Make,
    *,
    repetitions: int,
    seed: int,
    tau: float,
    columns: int = COLUMNS,
    evidence: str = "",
) -> list[Curve]:
    """Return the learning curve of each variant; time grows linearly with the repetitions, memory does not.

    ``evidence`` names the log-odds that the learner listens to, ``decision`` or ``graded``; empty for none.
    """
    shape = (len(variants), variants[0].task.episodes)
    sums, squares, greedy = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for work in blocks(variants, repetitions=repetitions, seed=seed, evidence=bool(evidence), columns=columns):
        soft, hard = learn(
            make,
            [b.draws for b in work],
            [b.answers.predicted for b in work],
            tau=tau,
            evidence=[b.answers.log_odds(evidence) for b in work] if evidence else None,
        )
        start = 0
        for block in work:
            part = slice(start, start := start + block.draws.repetitions)
            # Sums about one half keep their digits; block by block, in order, they do not depend on ``columns``.
            away = np.ascontiguousarray(soft[:, part]) - 0.5
            sums[block.variant] += away.sum(axis=1)
            squares[block.variant] += (away * away).sum(axis=1)
            greedy[block.variant] += np.ascontiguousarray(hard[:, part]).sum(axis=1)
    return [_curve(*parts, repetitions) for parts in zip(sums, squares, greedy, strict=True)]


def _curve(total: np.ndarray, square: np.ndarray, greedy: np.ndarray, n: int) -> Curve:
    spread = np.maximum(square - total * total / n, 0.0)
    sd = np.sqrt(spread / (n - 1)) if n > 1 else np.full(len(total), np.nan)
    return Curve(0.5 + total / n, sd, greedy / n, n)
