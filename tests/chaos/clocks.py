"""A clock that goes back and forth under runs: ``python tests/chaos/clocks.py [TRIALS] [SEED]``.

libfaketime (apt-get install libfaketime) shows the run another time every few hundredths of a second: years ahead,
years back. Files keep the kernel's time, as those of a server whose clock is another. Waiting is by a clock that only
counts.
"""

import random
import shutil
import subprocess
import sys
import threading
from pathlib import Path

from study import COMMAND, RUN, around, call, complete, fresh, reference  # first: it makes the helpers importable
from table import Fault, Lost, tell

LIBRARIES = sorted(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"))
OFFSETS = ("-3650d", "-40d", "-1h", "-3s", "+0", "+3s", "+1h", "+40d", "+3650d")


def main(trials=10, seed=0):
    """Return 0 where nothing was lost."""
    faults = [Fault("clock back and forth, runs"), Fault("clock back and forth, gc")]
    if not LIBRARIES:
        return tell(one.skip("libfaketime is not installed (apt-get install libfaketime)") for one in faults)
    base, draw = fresh("clocks"), random.Random(seed)
    wanted = reference(base)
    for number in range(trials):
        study = base / f"study{number}"
        environment = _faked(base / "time")
        with _Clock(base / "time", draw):
            with faults[0].trial(f"trial {number + 1}"):
                _run(base, study, wanted, environment, ("serial", "processes")[number % 2])
            with faults[1].trial(f"trial {number + 1}"):
                for words in (("cache", "gc", "-q"), ("cache", "gc", "--now", "-q")):
                    done = call(base, *words, "--workdir", study, environment=environment)
                    if done.returncode != 0:
                        raise Lost(f"gc ends with {done.returncode}: {done.stderr[-500:]}")
                    complete(study, wanted)
        shutil.rmtree(study)
    shutil.rmtree(base)
    return tell(faults)


def _run(base, study, wanted, environment, executor):
    words = [*COMMAND, *RUN, "--workdir", study, "--executor", executor, "-j", "2", "-q"]
    runs = [
        subprocess.Popen([*map(str, words)], cwd=base, env=around(environment), stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    for run in runs:
        _, err = run.communicate(timeout=300)
        if run.returncode != 0:
            raise Lost(f"a run ends with {run.returncode}: {err[-700:]}")
    complete(study, wanted)


def _faked(place):
    return {
        "LD_PRELOAD": str(LIBRARIES[0]),
        "FAKETIME_TIMESTAMP_FILE": str(place),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        "DONT_FAKE_MONOTONIC": "1",
        "NO_FAKE_STAT": "1",
    }


class _Clock:
    """Sets the time anew, again and again, while the block lasts."""

    def __init__(self, place, draw):
        self.place, self.draw = place, draw
        self.end = threading.Event()
        self.thread = threading.Thread(target=self._turn)

    def __enter__(self):
        self._set()
        self.thread.start()

    def __exit__(self, *_):
        self.end.set()
        self.thread.join()

    def _turn(self):
        while not self.end.wait(self.draw.uniform(0.01, 0.1)):
            self._set()

    def _set(self):
        part = self.place.with_name("time.part")
        part.write_text(f"{self.draw.choice(OFFSETS)}\n")
        part.replace(self.place)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
