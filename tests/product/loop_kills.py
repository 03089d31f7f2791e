"""Kill -9 the parts of a closed loop in mid-block: ``python tests/product/loop_kills.py [TIMES] [SEED]``.

Amplifier, recorder, loop and experiment run as processes over LSL, with a simulated person and the simulated
controller. In turn the experiment, the loop, the amplifier and the controller are killed, so often each. What must
hold: the arm rests within a quarter of a second of the experiment's end; without loop or EEG the session pauses at
rest, which, with nobody at the terminal, ends it; the recorder goes on, and what was recorded lacks at most a second;
and the session goes on until it is complete, the loop with what it had learned.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import sys
import tempfile
import threading
import time
from datetime import datetime
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import experiment_lab
import numpy as np
import pyxdf
from closed_lab import PATIENCE, Closed

from hrcneuro.sources import experiments

VICTIMS = ("experiment", "online", "amp", "controller")
BLOCKS = 8
CLOSED = ["--set", f"experiment.closed.blocks={BLOCKS}", "--set", "experiment.closed.episodes_per_block=2"]
QUICK = [*CLOSED, "--set", "experiment.break_s=0.2", "--set", "experiment.pause_s=0.3"]
REST_S = 0.25
LONGEST_MOVE_S = 1.2
MOVING = 5e-3  # rad/s
GAP_S = 1.0
BUSY = ("held up", "beside this session ran", "the recorder has lost")
"""What is said where other work on the machine holds up the simulated arm, or the simulated amplifier."""


def killed(closed: Closed, whom: str) -> str:
    """Kill a part while the arm moves, mend it, and return what was seen."""
    controller, address = closed.controller
    session = closed.experiment
    if whom == "experiment":
        stream = experiment_lab.stream_of(address)
        rest = experiment_lab.rest_after(stream, lambda: os.kill(session.pid, signal.SIGKILL))
        assert rest <= REST_S, f"the arm moved for {rest:.3f} s"
        session.wait(60)
        return f"at rest after {1e3 * rest:.0f} ms"
    rest = Rest(experiment_lab.stream_of(address)) if whom != "controller" else None
    victim = {"online": closed.online.pid, "amp": closed.amp.pid, "controller": controller.pid}[whom]
    os.kill(victim, signal.SIGKILL)
    begun = time.monotonic()
    code = session.wait(PATIENCE)
    after = time.monotonic() - begun
    # The block may have come to its end, and with it the session, before anybody noticed.
    assert code == 4 or (code == 0 and closed.complete), (whom, code)
    if whom == "online":
        closed.online.wait()
        closed.online = closed.start("online", "s01", "--json", "--mode", "closed", "--go-on")
    elif whom == "amp":
        closed.amp.wait()
        closed.amp = closed.start("amp", "s01", "--sitting", "1")
        again(closed)
    at_rest = ""
    if rest is not None and code:
        moved = rest.moved_after_pause(closed)
        assert moved <= LONGEST_MOVE_S + REST_S, f"the arm moved for {moved:.3f} s after the pause"
        at_rest = f", the arm at rest {max(moved, 0):.2f} s after the pause"
    return f"the session had ended {after:.1f} s later, code {code}{at_rest}"


class Rest:
    """Sees when an arm moved last, until its controller ends."""

    def __init__(self, stream) -> None:
        self.stream, self.moved = stream, 0.0
        self.thread = threading.Thread(target=self._look, daemon=True)
        self.thread.start()

    def _look(self) -> None:
        with contextlib.suppress(AssertionError, OSError):
            while True:
                if experiment_lab.fastest(self.stream.packet()) > MOVING:
                    self.moved = time.time()

    def moved_after_pause(self, closed: Closed) -> float:
        """Return for how long it moved after the session's log says that it pauses, s: to the end of its move."""
        self.thread.join(60)
        entries = experiments.read(closed.place / experiments.FILE)[0]
        paused = [one["at"] for one in entries if one["kind"] == "pause"][-1]
        return self.moved - datetime.fromisoformat(paused).timestamp()


def again(closed: Closed) -> None:
    """Begin the loop anew where it has ended: that a session has ended in trouble tells it that no move comes."""
    if closed.online.poll() is not None:
        closed.online = closed.start("online", "s01", "--json", "--mode", "closed", "--go-on")


def eeg_gaps(parts: list[Path]) -> list[float]:
    """Return how long EEG is missing in a recording, where that is more than a second."""
    found: list[np.ndarray] = []
    for part in parts:
        streams = pyxdf.load_xdf(part, verbose=False, synchronize_clocks=False, dejitter_timestamps=False)[0]
        found += [np.asarray(one["time_stamps"], float) for one in streams if one["info"]["type"][0] == "EEG"]
    steps = np.diff(np.sort(np.concatenate(found)))
    return np.round(steps[steps > GAP_S], 2).tolist()


def check(closed: Closed, amps: int) -> str:
    """Assert that the session is complete, each block once, and that the recording holds its moves and its EEG.

    ``amps`` is how often the amplifier was killed: of EEG, only what was not sent may be missing.
    """
    entries = experiments.read(closed.place / experiments.FILE)[0]
    rows = [one for one in entries if one["kind"] == experiments.MOVE]
    blocks = [row["block"] for row in rows]
    assert blocks == sorted(blocks), "a block comes back"
    assert set(blocks) == set(range(1, BLOCKS + 1))
    ended = closed.end()
    stamps = [row["marker_stamp"] for row in rows if "marker_stamp" in row]
    found: list[float] = []
    parts = sorted(closed.lab.folder.glob("recordings/s01/*/part*.xdf"))
    for part in parts:
        for stream in pyxdf.load_xdf(part, verbose=False, synchronize_clocks=False, dejitter_timestamps=False)[0]:
            if stream["info"]["name"][0] == "hrcneuro-moves":
                found += [float(stamp) for stamp in stream["time_stamps"]]
    gaps = eeg_gaps(parts)
    assert len(gaps) <= amps, f"{len(gaps)} gaps of EEG, {amps} dead amplifiers: {gaps}"
    lost = [stamp for stamp in stamps if min(abs(stamp - one) for one in found) > 1e-3]
    assert len(lost) <= 1, f"{len(lost)} markers of {len(stamps)} are not in the recording"
    return (
        f"{len(rows)} moves, {len(stamps) - len(lost)} of {len(stamps)} markers recorded, "
        f"{len(gaps)} gaps of EEG for {amps} dead amplifiers; whole: {ended.get('whole')}"
    )


def main(times: int = 10, seed: int = 0) -> int:
    """Kill so often each, and return how often in all; an assertion fails where something does not hold."""
    draw, left = random.Random(seed), dict.fromkeys(VICTIMS, times)
    sessions = trips = 0
    while any(left.values()):
        folder = Path(tempfile.mkdtemp(prefix="hrcneuro-loop-"))
        closed, amps = Closed(folder, QUICK), 0
        try:
            while not closed.complete:
                closed.go_on()
                if closed.experiment.poll() is not None:
                    if closed.complete:
                        break
                    text = (folder / "experiment.txt").read_text()
                    assert any(why in text for why in BUSY), text[-2000:]
                    trips += 1
                    print("the machine was busy: arm or amplifier was held up", flush=True)
                    again(closed)
                    continue
                whom = next((one for one in VICTIMS if left[one]), "")
                if not whom:
                    closed.experiment.wait(600)
                    continue
                time.sleep(draw.uniform(0.0, 3.0))
                if closed.experiment.poll() is None:
                    print(f"{whom}: {killed(closed, whom)}", flush=True)
                    left[whom] -= 1
                    amps += whom == "amp"
            print(f"session {(sessions := sessions + 1)} complete: {check(closed, amps)}", flush=True)
        finally:
            closed.close()
    print(f"{sessions} sessions complete, every block once; {trips} stops by load")
    return times * len(VICTIMS)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
