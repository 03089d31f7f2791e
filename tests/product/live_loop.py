"""A closed loop in real time: ``python tests/product/live_loop.py [DECISIONS]``; ``make live``, half an hour.

Amplifier, recorder, loop and experiment run as processes over LSL, with a simulated person, synthetic EEG and the
simulated controller, until so many decisions were made. A line a claim: each in time, the log equal to the replay of
the recording, and what the loop needs of a core and of memory; before it the times from onset to each stage.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from closed_lab import COMMAND, Closed
from live_lab import Row

from hrcneuro.analyses.loop_rows import loop_tables
from hrcneuro.analyses.loop_sessions import STAGES, causes, deadlines, latencies

EPISODES, A_BLOCK = 13, 60  # decisions of a block, at least: an episode's last move has none
AMP_MS, PUBLISHED_MS = 30, 5
LIMIT_MS = 620 + AMP_MS  # the simulated amplifier sends so long after a sample is taken


class Usage:
    """What a process uses: seconds of a core, and memory at most, looked at once a second."""

    def __init__(self, pid: int) -> None:
        self._process, self._over = psutil.Process(pid), threading.Event()
        self.memory, self._begun = [], (sum(self._process.cpu_times()[:2]), time.monotonic())
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        while not self._over.wait(1.0):
            self.memory.append(self._process.memory_info().rss / 1e6)

    def end(self) -> float:
        """Return the share of a core since the beginning."""
        self._over.set()
        self._thread.join()
        spent, begun = self._begun
        return (sum(self._process.cpu_times()[:2]) - spent) / (time.monotonic() - begun)


def session(closed: Closed, decisions: int) -> Iterator[Row]:
    """Play a session and hold its log against what it must show."""
    usage = Usage(closed.online.pid)
    closed.go_on()
    code = closed.experiment.wait()
    share = usage.end()
    closed.end()
    said = (closed.lab.folder / "experiment.txt").read_text()
    yield f"the session ended with {code}", code == 0, said[-2000:]
    (log,) = closed.lab.folder.glob("recordings/s01/*-online/decisions.jsonl")
    lines = [[json.loads(line) for line in path.open()] for path in (closed.place / "experiment.jsonl", log)]
    steps, _ = loop_tables(*lines, subject="s01", session="live")
    times, counts = latencies(steps), deadlines(steps)
    for name, words in STAGES.items():
        print(f"     onset to {words:22} {summary(times[name])} ms")
    after = times["sent"] - times["received"]
    print(f"     last sample received to decision sent {summary(after)} ms")
    n, of = counts["decided"]
    yield f"{n} of {of} steps after a move decided; not taught by: {causes(steps)}", n >= decisions, ""
    p99 = np.percentile(times["sent"], 99)
    yield f"sent after {p99:.1f} ms at p99", p99 <= LIMIT_MS, f"{LIMIT_MS} ms, of which the amplifier takes {AMP_MS}"
    yield f"in time {counts['deadline_met'][0]} of {n}", True, ""
    p99 = np.percentile(after, 99)
    yield f"sent {p99:.2f} ms after the last sample was received at p99", p99 <= PUBLISHED_MS, "5 ms"
    yield f"the loop took {100 * share:.1f} % of a core", share <= 0.25, "25 % allowed"
    memory = usage.memory
    yield f"and {max(memory):.0f} MB at most", max(memory) <= 300, "300 MB allowed"
    yield from replayed(closed, decisions)


def replayed(closed: Closed, decisions: int) -> Iterator[Row]:
    """The recording, replayed, gives the session's decisions to the bit."""
    (recording,) = {path.parent for path in closed.lab.folder.glob("recordings/s01/*/part*.xdf")}
    words = ["online", "s01", "--json", "--mode", "closed", "--replay", str(recording)]
    place = {"cwd": closed.lab.folder, "env": closed.lab.environment}
    done = subprocess.run([*COMMAND, *words], **place, capture_output=True, text=True, check=False)
    against = json.loads(done.stdout or "{}").get("against_log", {})
    yield f"replayed: {against}", done.returncode == 0 and against.get("equal", 0) >= decisions, done.stderr[-1000:]


def summary(values: np.ndarray) -> str:
    """Return median, 99th percentile and the largest."""
    return f"median {np.median(values):.2f}, p99 {np.percentile(values, 99):.2f}, max {values.max():.2f}"


def main(decisions: int = 500) -> int:
    """Run; return 1 where a claim does not hold."""
    blocks = math.ceil(decisions / A_BLOCK)
    shape = [
        "--set", f"experiment.closed.blocks={blocks}", "--set", f"experiment.closed.episodes_per_block={EPISODES}",
        "--set", "experiment.break_s=1",
    ]  # fmt: skip
    bad = 0
    with tempfile.TemporaryDirectory(prefix="hrcneuro-live-loop-") as folder:
        closed = Closed(Path(folder), shape)
        try:
            for claim, holds, more in session(closed, decisions):
                bad += not holds
                print(
                    f"{'ok  ' if holds else 'BAD '} {claim}{f'   ({more})' if more and not holds else ''}", flush=True
                )
        finally:
            closed.close()
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
