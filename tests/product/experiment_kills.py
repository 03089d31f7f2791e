"""Kill -9 an experiment while its arm moves: ``python tests/product/experiment_kills.py [INSTANTS] [SEED]``.

A simulated person plays small sessions with the simulated controller. At instants drawn at random the process of the
experiment is killed; now and then that of the arm's side, or the window's. After each kill the arm must rest within a
quarter of a second of the controller's own clock, all processes must end, and the log must be whole up to the last
finished move; then ``--resume`` goes on. A session that comes to its end must have every block once. Where other work
on the machine holds up the simulated arm, so that it is stopped, that is counted, and the session goes on likewise.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import experiment_lab as lab
from ur10_robot import Served

BLOCKS = lab.SessionParams(practice_episodes=0, blocks=6, episodes_per_block=1)
REST_S = 0.25


Killed = tuple[str, float]
"""What came of a run: ``killed``, and how long the arm moved then; ``complete``; ``held up`` by other work."""


def main(instants: int = 20, seed: int = 0) -> int:
    """Kill so often, and return how often that was; an assertion fails where something does not hold."""
    draw = random.Random(seed)
    base = Path(tempfile.mkdtemp(prefix="hrcneuro-experiment-"))
    rests: dict[str, list[float]] = {"experiment": [], "arm": [], "window": []}
    kills = trips = broken = sessions = 0
    while kills < instants or lab.parts_of(base / str(sessions) / "recordings" / lab.SUBJECT):
        kill = kills < instants
        whom = ("window", "arm")[kills // 7 % 2] if kill and kills % 7 == 3 else "experiment"
        folder = base / str(sessions)
        what, rest = _run(folder, whom, draw.uniform(0.0, 20.0) if kill else None)
        if what == "held up":
            trips += 1
            print("the simulated arm was held up, and stopped", flush=True)
            continue
        if what == "killed":
            rests[whom].append(rest)
            kills += 1
            print(f"kill {kills:3} of the {whom}'s process: at rest after {1e3 * rest:.0f} ms", flush=True)
            continue
        n = lab.check_session(folder / "recordings" / lab.SUBJECT, BLOCKS)
        print(f"session {sessions + 1} complete, each block once; {n} of {BLOCKS.blocks} were broken off", flush=True)
        sessions, broken = sessions + 1, broken + n
    for whom, after in rests.items():
        if after:
            print(f"{whom}: {len(after)} kills, at rest after at most {1e3 * max(after):.0f} ms")
    print(f"{sessions} sessions complete, every block once, {broken} blocks broken off; {trips} stops by load")
    shutil.rmtree(base)
    return kills


def _run(folder: Path, whom: str, after_s: float | None) -> Killed:
    """Begin or go on with a session and kill once, if it does not end before."""
    place = folder / "recordings" / lab.SUBJECT
    words = ["--resume"] if lab.parts_of(place) else []
    served = Served() if whom == "arm" else None
    # The controller of a killed arm's side ends with it: what its arm does is seen on one that stays.
    arm = ["--backend", "ur", "--host", served.address, "--i-am-at-the-robot", *lab.BORNE] if served else lab.SIMULATED
    screen = {"SDL_VIDEODRIVER": "dummy"} if whom == "window" else {}
    sized = ["--set", "experiment.window.scale=0"] if screen else []
    with lab.Experiment(folder, *arm, *words, *sized, params=BLOCKS, environment=screen, screen=bool(screen)) as run:
        try:
            rest = _killed(run, whom, served, after_s)
            if rest is None:
                code, _, err = run.end(600)
                lab.check_log(place)
                if code == 4 and "beside this session ran" in err:
                    return "held up", 0.0
                assert code == 0, (code, err)
                return "complete", 0.0
            lab.check_log(place, arm_moves=lab.arm_moves_of(place) if whom != "arm" else None)
            return "killed", rest
        finally:
            if served is not None:
                served.end()


def _killed(run: lab.Experiment, whom: str, served: Served | None, after_s: float | None) -> float | None:
    """Return how long the arm moved after the kill; none where the run came to its end before."""
    run.until("arm ready")
    until = time.monotonic() + (1e9 if after_s is None else after_s)
    while time.monotonic() < until:
        if run.process.poll() is not None:
            return None
        time.sleep(0.01)
    try:
        stream = lab.stream_of(served.address if served else run.controller[1])
    except (AssertionError, OSError):
        if run.process.wait(60) in (0, 4):
            return None
        raise
    others = run.others()
    window, arm = (run.spawned * 2)[:2] if whom == "window" else (None, run.spawned[0])
    victim = {"experiment": run.process.pid, "arm": arm.pid, "window": window and window.pid}[whom]
    try:
        rest = lab.rest_after(stream, lambda: os.kill(victim, signal.SIGKILL))
    except AssertionError:
        # The session came to its end before the arm moved again.
        if run.process.wait(60) in (0, 4):
            return None
        raise
    # Without its window a session ends as if asked to: the move under way is made to its end.
    assert rest <= (1.5 if whom == "window" else REST_S), f"{whom}: the arm moved for {rest:.3f} s"
    code, _, err = run.end()
    assert code == {"experiment": -signal.SIGKILL, "arm": 4, "window": 4}[whom], (code, err)
    assert lab.ended(others) == []
    return rest


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
