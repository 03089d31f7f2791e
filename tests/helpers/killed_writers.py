"""Play a session into a log again and again, each time in a process that is killed; run by a test, in a process."""

import os
import signal
import sys
import time
from pathlib import Path

from experiment_log import begun, play, simulated

from hrcneuro.sources import experiments

_DEADLINE_S = 30


def main(folder, sizes):
    trials = simulated()
    for number, size in enumerate(sizes):
        place = folder / str(number)
        process = os.fork()
        if not process:
            play(begun(place, real_time=True), trials)
            os._exit(0)
        kill_at(process, place / "s01" / experiments.FILE, size)


def kill_at(process, path, size):
    """Kill a process once its file is so long, or it has come to its end."""
    until = time.monotonic() + _DEADLINE_S
    while (path.stat().st_size if path.exists() else -1) < size and time.monotonic() < until:
        if os.waitpid(process, os.WNOHANG)[0]:
            return
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [int(word) for word in sys.argv[2:]])
