"""What a control cycle costs where moves are asked for one at a time, beside a log's replay; a script.

Both drive the simulated arm through the same two blocks on a virtual clock, in turns, so that other work of the machine
hits both; the least of the turns counts. The exit code is 1 where the ratio is above its limit.
"""

from __future__ import annotations

import dataclasses
import sys
import time

import numpy as np

from hrcneuro.experiment import arm_side, messages
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.arm_side import ArmSettings
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.robot.assembly import make_loop
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.parameters import Durations, Selection
from hrcneuro.robot.plan import PlannedMove, grid_moves, plan, select
from hrcneuro.robot.session import run_session
from hrcneuro.robot.sim import SimArm, VirtualClock
from hrcneuro.stages.robot import Config

LIMIT = 1.3
TURNS = 5


def replayed(config: Config, ahead: Ahead, moves: list[PlannedMove]) -> float:
    """Return seconds a cycle."""
    clock = VirtualClock()
    arm = SimArm(clock, ahead.workspace.home().tolist())
    loop = make_loop(arm, clock, ahead.workspace, tracking=config, safety=config)
    began = time.thread_time()
    run_session(
        loop, ahead.workspace, moves, lead=None, most_lead=config.max_lead_s, pace=config, on_executed=lambda _: None
    )
    return (time.thread_time() - began) / len(loop.record)


class Flow:
    """Asks for the moves, each once the one before has ended."""

    def __init__(self, moves: list[PlannedMove], pause_s: float) -> None:
        self.requests: list[messages.Request] = []
        for index, move in enumerate(moves):
            if move.first:
                self.requests.append(messages.Approach(move.start))
            text = move.marker("s01")
            self.requests.append(messages.Go(index, move.start, move.end, move.t_f, text))
        self.requests.append(messages.Finish())
        self.requests.reverse()
        self.pause_s, self.free, self.ended = pause_s, False, 0.0
        self.due = 0.0

    def send(self, report: messages.Report) -> None:
        if isinstance(report, messages.Ready | messages.Arrived | messages.Executed):
            self.free = True
            self.due = report.when + self.pause_s if isinstance(report, messages.Arrived) else 0.0
        elif isinstance(report, messages.Ended):
            self.ended = report.when

    def ask(self, now: float) -> messages.Request | None:
        if not self.free:
            return None
        self.free = False
        request = self.requests.pop()
        return dataclasses.replace(request, not_before=self.due) if isinstance(request, messages.Go) else request


def one_at_a_time(config: Config, ahead: Ahead, moves: list[PlannedMove]) -> float:
    """Return seconds a cycle; the look-ahead has seen every way before."""
    ahead.restart()
    flow = Flow(moves, config.pause_s)
    began = time.thread_time()
    arm_side.run(ArmSettings(config, "s01", real_time=False), flow.send, flow.ask, ahead=ahead)
    assert not flow.requests
    return (time.thread_time() - began) / (flow.ended / PERIOD)


def main() -> int:
    config = Config()
    trials = simulate_session(SessionParams(), rng=np.random.default_rng(1))
    moves = plan(select(grid_moves(trials), Selection(blocks=(1, 2))), Durations())
    began = time.perf_counter()
    ahead = Ahead(config, shortest_s=0.6)
    print(f"look ahead to the whole grid         {time.perf_counter() - began:9.2f} s")
    one_at_a_time(config, ahead, moves)
    costs = np.array([[f(config, ahead, moves) for f in (replayed, one_at_a_time)] for _ in range(TURNS)])
    replay, asked = 1e6 * costs.min(axis=0)
    ratio = asked / replay
    print(f"replay of a log                      {replay:9.1f} µs a cycle")
    print(f"one request at a time                {asked:9.1f} µs a cycle")
    print(f"ratio                                {ratio:9.2f}    (limit {LIMIT})")
    return int(ratio > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
