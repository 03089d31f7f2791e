"""Closed sessions as a laboratory plays them: a decoder; amplifier, recorder, loop and experiment as processes."""

from __future__ import annotations

import contextlib
import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import experiment_lab
import psutil
from live_lab import COMMAND, Lab

from hrcneuro.sources import experiments

ARM = ["--backend", "ursim", "--patient", "--human", "simulated", "--no-screen", "--set", "experiment.truth=true"]
PATIENCE = 180.0


def wait_for(happened: Callable[[], bool]) -> None:
    """Wait until something has happened."""
    until = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.05)


class Closed:
    """Such a laboratory; the session is played by :meth:`go_on`."""

    def __init__(self, folder: Path, shape: list[str]) -> None:
        """Calibrate, and start all but the experiment; ``shape`` is what its session is set to."""
        self.lab, self.shape = Lab(folder), shape
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
        self.experiment = self.start("experiment", "s01", "--closed", *ARM, *self.shape, *wait, *resume)
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
                one.terminate()
                one.wait(60)
        self.recorder.terminate()
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
