"""What decoders teach by their rates or rules alone: in the study's blocks as logged, and in the simulated closed loop.

``python FILE [--sessions N] [--logs FOLDER] [-j N]`` prints Markdown tables. Accuracies are means with half their 95 %
intervals, over sessions, or over the logged subjects; the same people, paths and draws meet every decoder.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.learning import loop_scores as scores
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop import STEPS, LoopModel, LoopSessions, simulate_loop
from hrcneuro.learning.loop_decoders import (
    LoopDecoder,
    anticipation,
    independent,
    of_errors,
    of_rule,
    of_turns,
)
from hrcneuro.learning.open_blocks import learn_open
from hrcneuro.learning.rates import PAPER, Rates
from hrcneuro.paradigm.grid import displacement
from hrcneuro.paradigm.owners import DIRECTION_PAIRS
from hrcneuro.paradigm.paths import PAIRS, trace
from hrcneuro.sources.logs import read_log

KINDS = kinds(alpha=0.05, ddof=0, horizon=40.0)
PART = 50  # sessions that a process simulates at once
SUBJECTS = [f"s{k:02d}" for k in range(1, 13) if k != 7]
BETTER = Rates.level(65)
DECODERS: dict[str, LoopDecoder] = {
    "anticipation, published rates": anticipation(PAPER),
    "errors, published rates": of_errors(PAPER),
    "turns, published rates": of_turns(PAPER),
    "nothing, says both alike": independent(after_human=0.5, after_robot=0.5),
    "nothing, says stays in 60 %": independent(after_human=0.4, after_robot=0.4),
    "nothing, says stays in 80 %": independent(after_human=0.2, after_robot=0.2),
    "rule: the actor stays": of_rule("stays"),
    "rule: after an error, takeover": of_rule("prev_error"),
    "rule: before a turn, takeover": of_rule("turn"),
    "anticipation, 65 %": anticipation(BETTER),
    "errors, 65 %": of_errors(BETTER),
    "turns, 65 %": of_turns(BETTER),
}
BASE = LoopModel(KINDS["paper"], tau=0.1)
WAYS: dict[str, LoopModel] = {
    "closed": BASE,
    "semi": replace(BASE, mode="semi"),
    "shadow": replace(BASE, mode="shadow"),
    "direct (§4.2)": replace(BASE, mode="direct"),
    "closed, a person who adapts": replace(BASE, closed=replace(BASE.closed, adapts=True)),
    "closed, floor 0.05": replace(BASE, floor=0.05),
    "closed, floor 0.1": replace(BASE, floor=0.1),
    "closed, in time in 27 %": replace(BASE, in_time=0.27),
    "closed, never in time": replace(BASE, in_time=0.0),
    "closed, with ErrP at 65 % (§4.4)": replace(BASE, errp=(65.0, 65.0)),
    "closed, with ErrP at 75 % (§4.4)": replace(BASE, errp=(75.0, 75.0)),
    **{f"closed, {name}": replace(BASE, kind=KINDS[name]) for name in ("votes", "bayes_graded", "adaptive")},
}


def simulated(
    pool: ProcessPoolExecutor, model: LoopModel, decoder: LoopDecoder, sessions: int, seed: int
) -> LoopSessions:
    """Return sessions that several processes have simulated."""
    starts = range(0, sessions, PART)
    work = partial(_part, model, decoder, sessions, seed)
    return LoopSessions.joined(list(pool.map(work, starts)))


def _part(model: LoopModel, decoder: LoopDecoder, sessions: int, seed: int, first: int) -> LoopSessions:
    return simulate_loop(model, decoder, sessions=min(PART, sessions - first), seed=seed, first=first)


def percent(value: scores.Mean, at: object = ()) -> str:
    """Return a mean and half its interval, in percent."""
    mean, half = 100 * value.mean[at], 100 * value.half_width[at]  # type: ignore[index]
    return f"{mean:.1f} ± {half:.1f}"


def at(sessions: LoopSessions, rows: str, episode: int) -> str:
    """Return the accuracy after an episode."""
    return percent(scores.mean_over_sessions(scores.accuracy(sessions, rows)[:, episode - 1]))


def wrong_steps(sessions: LoopSessions, episodes: slice) -> scores.Mean:
    """Return the share of straight steps that were taken from the person or left lying."""
    steps = sessions.steps[:, episodes].sum(axis=1)
    wrong = steps[:, [STEPS.index("taken"), STEPS.index("left")]].sum(axis=1)
    return scores.mean_over_sessions(wrong / (steps.sum(axis=1) - steps[:, STEPS.index("diagonal")]))


def staying_on_paths() -> tuple[float, float]:
    """Return how often a step is made by who made the one before, over all paths and owners, and how often it turns."""
    stays, turns = [], []
    for (start, goal), count, axis, *picks in product(PAIRS, (1, 2, 3), (0, 1), (0, 1), (0, 1)):
        path = trace(start, goal, turns=count, first_axis=axis, picks=(picks[0], picks[1]))
        ways = [displacement(a, b) for a, b in pairwise(path)]
        for one, other in pairwise(ways):
            turns.append(one != other)
            stays += [(one in human) == (other in human) for human in DIRECTION_PAIRS]
    return float(np.mean(stays)), float(np.mean(turns))


def logged(moves: dict[str, pd.DataFrame], decoder: LoopDecoder, repetitions: int, seed: int) -> Iterator[str]:
    """Yield the accuracies after episode 13 of a block, as logged: all, the human's rows, the robot's."""
    rng = [np.random.default_rng([seed, k]) for k in range(len(moves))]
    found = [
        learn_open(trials, decoder, KINDS["paper"], tau=0.1, rng=one, repetitions=repetitions)
        for trials, one in zip(moves.values(), rng, strict=True)
    ]
    for rows in scores.ROWS:
        yield percent(scores.mean_over_sessions(np.array([np.nanmean(scores.accuracy(s, rows)[:, 12]) for s in found])))


def row(*cells: str) -> None:
    """Print a row of a table."""
    print("| " + " | ".join(cells) + " |", flush=True)


def head(*cells: str) -> None:
    """Print the head of a table."""
    print()
    row(*cells)
    print("|---" * len(cells) + "|")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=500)
    parser.add_argument("--seed", type=int, default=2023)
    parser.add_argument("--repetitions", type=int, default=4, help="of each logged block")
    parser.add_argument("--logs", type=Path, help="the authors' repository; without it, no logged blocks")
    parser.add_argument("-j", type=int, default=2)
    chosen = parser.parse_args()
    begun = time.perf_counter()
    stays, turns = staying_on_paths()
    print(
        f"paths without errors: {100 * stays:.1f} % of steps by the actor of the one before, {100 * turns:.1f} % turns"
    )
    moves = {unit: read_log(chosen.logs, unit) for unit in SUBJECTS} if chosen.logs else {}
    for scenario in ("iC", "sC") if moves else ():
        counted = [m[(m["scenario"] == scenario) & m["condition_before"].notna()] for m in moves.values()]
        share = np.array([m["condition_before"].isin(["HH", "RR"]).mean() for m in counted])
        print(
            f"the logs, {scenario}: {percent(scores.mean_over_sessions(share))} % of the pairs, {len(moves)} subjects"
        )
    with ProcessPoolExecutor(chosen.j) as pool:
        head("decoder", "logs, ep. 13", "its human / robot", "shadow, ep. 78", "closed, ep. 78", "its human / robot",
             "says stays, after R / H", "stays, after R / H", "taken of the human's")  # fmt: skip
        for name, decoder in DECODERS.items():
            shadow = simulated(pool, replace(BASE, mode="shadow"), decoder, chosen.sessions, chosen.seed)
            closed = simulated(pool, BASE, decoder, chosen.sessions, chosen.seed)
            said, true = scores.continuing(closed), scores.staying(closed)
            open_blocks = list(logged(moves, decoder, chosen.repetitions, chosen.seed)) if moves else ["–"] * 3
            row(
                name, open_blocks[0], " / ".join(open_blocks[1:]), at(shadow, "all", 78), at(closed, "all", 78),
                f"{at(closed, 'human', 78)} / {at(closed, 'robot', 78)}",
                f"{percent(said, 0)} / {percent(said, 1)}", f"{percent(true, 0)} / {percent(true, 1)}",
                percent(scores.step_share(closed, "taken", ("human", "taken"))),
            )  # fmt: skip
        head(
            "anticipation at the published rates",
            "ep. 13",
            "ep. 78",
            "its human / robot",
            "wrong steps, block 1",
            "block 6",
        )
        for name, model in WAYS.items():
            found = simulated(pool, model, anticipation(PAPER), chosen.sessions, chosen.seed)
            row(
                name, at(found, "all", 13), at(found, "all", 78),
                f"{at(found, 'human', 78)} / {at(found, 'robot', 78)}",
                percent(wrong_steps(found, slice(0, 13))), percent(wrong_steps(found, slice(65, 78))),
            )  # fmt: skip
    print(f"\n{chosen.sessions} sessions, seed {chosen.seed}: {time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
