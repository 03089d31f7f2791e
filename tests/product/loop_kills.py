"""Kill -9 the parts of a closed loop in mid-block: ``python tests/product/loop_kills.py [TIMES] [SEED]``.

Amplifier, recorder, loop and experiment run as processes over LSL, with a simulated person and the simulated
controller. In turn the experiment, the loop, the amplifier and the controller are killed, so often each. What must
hold: the arm rests within a quarter of a second of the experiment's end; without loop or EEG the session pauses at
rest, which, with nobody at the terminal, ends it; the recorder goes on, and what was recorded lacks at most a second;
and the session goes on until it is complete, the loop with what it had learned.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import experiment_lab
import pyxdf
from live_lab import COMMAND, Lab

from hrcneuro.sources import experiments

VICTIMS = ("experiment", "online", "amp", "controller")
BLOCKS = 8
CLOSED = ["--set", f"experiment.closed.blocks={BLOCKS}", "--set", "experiment.closed.episodes_per_block=2"]
QUICK = [*CLOSED, "--set", "experiment.break_s=0.2", "--set", "experiment.pause_s=0.3"]
ARM = ["--backend", "ursim", "--patient", "--human", "simulated", "--no-screen", "--set", "experiment.truth=true"]
REST_S, PATIENCE = 0.25, 180.0
BUSY = ("held up", "beside this session ran", "the recorder has lost")
"""What is said where other work on the machine holds up the simulated arm, or the simulated amplifier."""


def wait_for(happened: Callable[[], bool]) -> None:
    """Wait until something has happened."""
    until = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.05)


class Closed:
    """A laboratory with a decoder, in which a closed session is under way."""

    def __init__(self, folder: Path) -> None:
        self.lab = Lab(folder)
        self.place = folder / "recordings" / "s01" / "closed"
        self.run("calibrate", "s01", "--no-figures", "-q")
        self.amp = self.start("amp", "s01", "--sitting", "1")
        self.recorder = self.start("record", "s01", "--json", "--set", "record.wait_s=60")
        self.online = self.start("online", "s01", "--json", "--mode", "closed")
        self.experiment: subprocess.Popen[str] | None = None

    def start(self, *words: str) -> subprocess.Popen[str]:
        log = (self.lab.folder / f"{words[0]}.txt").open("a")
        return subprocess.Popen(
            [*COMMAND, *words], cwd=self.lab.folder, env=self.lab.environment, stdin=subprocess.DEVNULL, stdout=log,
            stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip

    def run(self, *words: str) -> None:
        subprocess.run([*COMMAND, *words], cwd=self.lab.folder, env=self.lab.environment, check=True)

    def moves(self) -> int:
        with contextlib.suppress(OSError, IndexError):
            return len(experiment_lab.rows_of(self.place))
        return 0

    def go_on(self) -> None:
        """Begin the session, or go on with it, and wait for its arm to move."""
        resume = ["--resume"] if self.place.is_dir() else []
        wait = ["--set", "experiment.loop_wait_s=60", "--set", "robot.recorder_wait_s=60"]
        before = self.moves()
        self.experiment = self.start("experiment", "s01", "--closed", *ARM, *QUICK, *wait, *resume)
        wait_for(lambda: self.moves() > before + 1 or self.experiment.poll() is not None)

    @property
    def complete(self) -> bool:
        with contextlib.suppress(OSError):
            return experiments.read(self.place / experiments.FILE)[0][-1].get("complete", False)
        return False

    @property
    def controller(self) -> tuple[psutil.Process, str]:
        for one in psutil.Process(self.experiment.pid).children(recursive=True):
            words = experiment_lab._words(one)
            if "hrcneuro.ur10" in words:
                return one, words[words.index("--address") + 1]
        raise AssertionError("no controller")

    def end(self) -> dict[str, object]:
        """End amplifier, loop and recorder; return what the recorder said."""
        for one in (self.experiment, self.online, self.amp):
            if one.poll() is None:
                one.send_signal(signal.SIGINT)
                one.wait(60)
        self.recorder.send_signal(signal.SIGINT)
        self.recorder.wait(120)
        text = (self.lab.folder / "record.txt").read_text()
        return json.loads(text[text.index("{") :])

    def close(self) -> None:
        for one in (self.experiment, self.online, self.amp, self.recorder):
            if one is not None and one.poll() is None:
                with contextlib.suppress(psutil.Error):
                    for child in psutil.Process(one.pid).children(recursive=True):
                        child.kill()
                one.kill()
                one.wait()


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
        if closed.online.poll() is not None:
            closed.online = closed.start("online", "s01", "--json", "--mode", "closed", "--go-on")
    return f"the session had ended {after:.1f} s later, code {code}"


def check(closed: Closed) -> str:
    """Assert that the session is complete, each block once, and that the recording holds all of its moves."""
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
    lost = [stamp for stamp in stamps if min(abs(stamp - one) for one in found) > 1e-3]
    assert len(lost) <= 1, f"{len(lost)} markers of {len(stamps)} are not in the recording"
    return (
        f"{len(rows)} moves, {len(stamps) - len(lost)} of {len(stamps)} markers recorded; whole: {ended.get('whole')}"
    )


def main(times: int = 10, seed: int = 0) -> None:
    """Kill so often each; an assertion fails where something does not hold."""
    draw, left = random.Random(seed), dict.fromkeys(VICTIMS, times)
    sessions = trips = 0
    while any(left.values()):
        folder = Path(tempfile.mkdtemp(prefix="hrcneuro-loop-"))
        closed = Closed(folder)
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
                    continue
                whom = next((one for one in VICTIMS if left[one]), "")
                if not whom:
                    closed.experiment.wait(600)
                    continue
                time.sleep(draw.uniform(0.0, 3.0))
                if closed.experiment.poll() is None:
                    print(f"{whom}: {killed(closed, whom)}", flush=True)
                    left[whom] -= 1
            print(f"session {(sessions := sessions + 1)} complete: {check(closed)}", flush=True)
        finally:
            closed.close()
    print(f"{sessions} sessions complete, every block once; {trips} stops by load")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
