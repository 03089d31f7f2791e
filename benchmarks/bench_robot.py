"""How fast the arm's parts are, and how well the arm follows all 84 tile moves, both ways, at t_f = 0.6 s; a script.

``--backend ursim`` follows them through the sockets of the simulated controller, in real time (two and a half minutes a
driver): it means something on an idle machine only. The exit code is 1 where a limit is broken.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import timeit
from pathlib import Path

import _measure
import numpy as np
import pandas as pd

from hrcneuro.arms import connect
from hrcneuro.figures.robot import LIMIT, LIMIT_END, LIMIT_SOCKETS
from hrcneuro.figures.robot import robot as draw
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.grid import CENTRE, SIZE, Tile, neighbours
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.robot.backend import ArmError
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.limits import Limits
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.measure import commanded_angles, marker_timing, measure_moves, timing, tip
from hrcneuro.robot.parameters import Durations, Pace, Safety, Selection
from hrcneuro.robot.plan import PlannedMove, grid_moves, plan, select
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.session import run_session
from hrcneuro.robot.sim import SimArm, VirtualClock
from hrcneuro.robot.tracking import ResolvedRate, Tracking
from hrcneuro.robot.trajectory import BoundedPath, TileMove
from hrcneuro.robot.workspace import DOWN, Workspace
from hrcneuro.tables import robot as tables


def microseconds(call, n=20000) -> float:
    return min(timeit.repeat(call, number=n, repeat=3)) / n * 1e6


def looped(workspace: Workspace, arm, clock, *, age: float = 0.02) -> Loop:
    safety = Safety(max_packet_age_s=age)
    return Loop(
        arm,
        clock,
        law=ResolvedRate(Tracking(), tool=0.1, orientation=DOWN.tolist()),
        limits=Limits(safety, box=workspace.box, tool=0.1),
        supervisor=Supervisor(safety),
        stop=safety.stop,
    )


def parts(workspace: Workspace) -> None:
    law = ResolvedRate(Tracking(), tool=0.1, orientation=DOWN.tolist())
    limits = Limits(Safety(), box=workspace.box, tool=0.1)
    q = workspace.reach.q[2, 4].tolist()
    at, v = workspace.position(2, 4), (0.1, 0.05, 0.0)
    move = TileMove(at, workspace.position(2, 5), 0.9)
    approach = BoundedPath(at, workspace.position(6, 0), Pace().approach)
    qd, *_ = law(q, at, v)
    print(f"law: kinematics, J, damped solve     {microseconds(lambda: law(q, at, v)):9.1f} µs   (limit 60)")
    print(f"limits and keep-inside box           {microseconds(lambda: limits(q, qd, qd)):9.1f} µs")
    print(f"Eq 1-2                               {microseconds(lambda: move.at(0.4)):9.1f} µs")
    print(f"ruckig, one instant                  {microseconds(lambda: approach.at(0.4)):9.1f} µs")


def session(workspace: Workspace) -> bool:
    """Time a whole session of one subject and its cycles."""
    trials = simulate_session(SessionParams(), rng=np.random.default_rng(1))
    moves = plan(select(grid_moves(trials), Selection()), Durations())
    clock = VirtualClock()
    loop = looped(workspace, SimArm(clock, workspace.home().tolist()), clock)
    cycles, busy = np.zeros(1_000_000), np.zeros(1_000_000)
    wait, n, last, spent = clock.wait_until, 0, time.perf_counter(), time.thread_time()

    def timed_wait(t: float) -> None:
        nonlocal n, last, spent
        now, used = time.perf_counter(), time.thread_time()
        cycles[n], busy[n], n, last, spent = now - last, used - spent, n + 1, now, used
        wait(t)

    clock.wait_until = timed_wait  # type: ignore[method-assign]
    start = time.perf_counter()
    with loop:
        run_session(loop, workspace, moves, lead=None, most_lead=0.2, pace=Pace(), on_executed=lambda _: None)
    seconds = time.perf_counter() - start
    p50, p99 = 1e6 * np.percentile(cycles[1:n], (50, 99))
    used = 1e6 * np.percentile(busy[1:n], 99)
    speed = f"{clock.now() / seconds:.0f} × real time"
    print(f"session: {len(moves)} moves, {n} cycles      {seconds:9.1f} s    (limit 60) {speed}")
    print(f"cycle: median, p99                   {p50:9.1f} µs, {p99:.1f} µs (limit 200), processor p99 {used:.1f} µs")
    return p99 <= 200.0 and seconds <= 60.0


def round_trip(start: Tile) -> list[Tile]:
    """Return tiles along which each of the grid's 84 edges is gone once in either direction (Hierholzer)."""
    left = {tile: list(neighbours(tile)) for tile in np.ndindex(SIZE, SIZE)}
    stack, way = [start], []
    while stack:
        if left[stack[-1]]:
            stack.append(left[stack[-1]].pop())
        else:
            way.append(stack.pop())
    return way[::-1]


def tracking(workspace: Workspace, backend: str, driver: str, age: float, figure: Path | None) -> bool:
    """Follow all tile moves at the shortest duration, print the figures of the tip, and return whether they hold."""
    tiles = round_trip(CENTRE)
    moves = [
        PlannedMove("iC", False, 1, 1, i, a, b, i == 0, T_F_S[0], np.nan)
        for i, (a, b) in enumerate(itertools.pairwise(tiles))
    ]
    if backend == "sim":
        clock = VirtualClock()
        arm = SimArm(clock, workspace.home().tolist())
    else:
        arm, clock = connect(backend, driver=driver)
    loop, executed = looped(workspace, arm, clock, age=age), []
    try:
        with loop:
            run_session(loop, workspace, moves, lead=None, most_lead=0.2, pace=Pace(), on_executed=executed.append)
    except ArmError as error:
        print(f"{backend}: stopped after {len(executed)} of {len(moves)} moves: {error}")
        return False
    telemetry = loop.record.telemetry()
    at = tip(telemetry, tool=0.1)
    measures = measure_moves(executed, telemetry, at, workspace) | marker_timing(executed, rate=1000.0)
    table = tables.moves(executed, measures, {})
    limit = LIMIT if backend == "sim" else LIMIT_SOCKETS
    if figure is not None:
        cycles = pd.DataFrame(tables.telemetry(telemetry, at, commanded_angles(telemetry)))
        draw(cycles, table, workspace.cell, figure, limit=limit)
    ways = len({frozenset((m.start, m.end)) for m in moves})
    print(f"{backend}{'' if backend == 'sim' else f' ({driver})'}: {len(moves)} moves, all {ways} ways both ways, "
          f"t_f {T_F_S[0]:g} s, lead {1e3 * loop.lead:.1f} ms")  # fmt: skip
    entry = (table["t_2mm_s"] / table["t_f_s"]).max()
    good = True
    for name, value, allowed, unit in (
        ("greatest error on the way", table["max_error_mm"].max(), limit, "mm"),
        ("error on arrival", table["end_error_mm"].max(), LIMIT_END, "mm"),
        ("height", table["height_error_mm"].max(), 0.8, "mm"),
        ("orientation", table["tilt_deg"].max(), 0.2, "°"),
        ("2 mm radius entered after", entry, 1.0, "t_f"),
    ):
        good &= bool(value <= allowed)
        print(f"  {name:<35}{value:9.3f} {unit:<4} (limit {allowed:g}){'' if value <= allowed else '  BROKEN'}")
    late = np.flatnonzero(np.diff(telemetry.time) > 0.012)
    smooth = [not any(one.track.first <= i < one.track.last for i in late) for one in executed]
    print(f"  {'the same but for late cycles':<35}{table['max_error_mm'][smooth].max():9.3f} mm   "
          f"({len(late)} cycles over 12 ms, {sum(smooth)} of {len(moves)} moves without one)")  # fmt: skip
    latencies = {name: table[f"{name}_latency_ms"].to_numpy(float) for name in ("trigger", "marker")}
    spread = timing(telemetry, latencies, np.zeros(0))
    for name in ("trigger_latency", "marker_latency", "cycle", "cycle_jitter"):
        of = spread[name]
        print(f"  {name:<35}{of['mean']:9.3f} ± {of['sd']:.3f} ms, p99 {of['p99']:.3f}, most {of['high']:.3f}")
    return good


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--backend", choices=("sim", "ursim"), default="sim")
    options.add_argument("--driver", choices=("rtde", "script"), default="rtde")
    options.add_argument("--max-age", type=float, default=0.020, help="of a packet, s; raise it on a busy machine")
    options.add_argument("--figure", type=Path, help="where to draw the path and its error (PNG)")
    given = options.parse_args()
    print(_measure.machine())
    start = time.perf_counter()
    workspace = Workspace(Cell())
    good = True
    if given.backend == "sim":
        print(f"workspace: 49 tiles solved           {1e3 * (time.perf_counter() - start):9.1f} ms")
        parts(workspace)
        good = session(workspace)
    good &= tracking(workspace, given.backend, given.driver, given.max_age, given.figure)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
