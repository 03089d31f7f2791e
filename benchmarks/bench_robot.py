"""How long the arm's parts take (limits: law 60 µs, cycle 200 µs at p99, session 60 s): run it as a script."""

from __future__ import annotations

import time
import timeit

import numpy as np

from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.limits import Limits
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.plan import plan, select
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.session import Pace, run_session
from hrcneuro.robot.sim import SimArm, VirtualClock
from hrcneuro.robot.tracking import ResolvedRate
from hrcneuro.robot.trajectory import BoundedPath, Bounds, TileMove
from hrcneuro.robot.workspace import DOWN, Workspace


def microseconds(call, n=20000) -> float:
    return min(timeit.repeat(call, number=n, repeat=3)) / n * 1e6


def main() -> None:
    start = time.perf_counter()
    workspace = Workspace(Cell())
    print(f"workspace: 49 tiles solved           {1e3 * (time.perf_counter() - start):9.1f} ms")
    law = ResolvedRate(tool=0.1, orientation=DOWN.tolist())
    limits = Limits(acceleration=12.0, box=workspace.box, tool=0.1)
    q = workspace.reach.q[2, 4].tolist()
    at, v = workspace.position(2, 4), (0.1, 0.05, 0.0)
    move = TileMove(at, workspace.position(2, 5), 0.9)
    approach = BoundedPath(at, workspace.position(6, 0), Bounds(0.25, 1.0, 10.0))
    qd, *_ = law(q, at, v)
    print(f"law: kinematics, J, damped solve     {microseconds(lambda: law(q, at, v)):9.1f} µs")
    print(f"limits and keep-inside box           {microseconds(lambda: limits(q, qd, qd)):9.1f} µs")
    print(f"Eq 1-2                               {microseconds(lambda: move.at(0.4)):9.1f} µs")
    print(f"ruckig, one instant                  {microseconds(lambda: approach.at(0.4)):9.1f} µs")

    trials = simulate_session(SessionParams(), rng=np.random.default_rng(1))
    chosen = select(trials, blocks=(), episodes=(), practice=False)
    moves = plan(chosen, t_f=None, t_f_range=(0.6, 1.2), default_t_f=0.9)
    clock = VirtualClock()
    loop = Loop(
        SimArm(clock, workspace.home().tolist()),
        clock,
        law=law,
        limits=limits,
        supervisor=Supervisor(),
        stop=Bounds(4.0, 8.0, 200.0),
    )
    cycles = np.zeros(1_000_000)
    wait, n, last = clock.wait_until, 0, time.perf_counter()

    def timed_wait(t: float) -> None:
        nonlocal n, last
        now = time.perf_counter()
        cycles[n], n, last = now - last, n + 1, now
        wait(t)

    clock.wait_until = timed_wait  # type: ignore[method-assign]
    pace = Pace(approach=Bounds(0.25, 1.0, 10.0), homing=Bounds(0.5, 1.0, 10.0))
    start = time.perf_counter()
    with loop:
        run_session(loop, workspace, moves, lead=None, pace=pace, on_done=lambda _: None)
    seconds = time.perf_counter() - start
    p50, p99 = 1e6 * np.percentile(cycles[1:n], (50, 99))
    print(f"session: {len(moves)} moves, {n} cycles      {seconds:9.1f} s, {clock.now() / seconds:.0f} × real time")
    print(f"cycle: median, p99                   {p50:9.1f} µs, {p99:.1f} µs")


if __name__ == "__main__":
    main()
