"""A session on a simulated controller as bench_faults.py sees it from outside: motion, words, and what is kept."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from hrcneuro.io.recordings import read_stream


class Watch(threading.Thread):
    """Reads port 30003 and keeps what it shows, with the time at which it came; connects anew where it was cut."""

    def __init__(self, host: str) -> None:
        super().__init__(daemon=True)
        self.host, self.ended = host, False
        self.seen: list[tuple[float, float, float]] = []  # came, made, fastest joint
        self.start()

    def run(self) -> None:
        punctual()
        while not self.ended:
            with contextlib.suppress(OSError), socket.create_connection((self.host, 30003), 1.0) as link:
                link.settimeout(1.0)
                with link.makefile("rb") as stream:
                    while not self.ended and len(data := stream.read(1108)) == 1108:
                        values = struct.unpack_from(">138d", data, 4)
                        self.seen.append((time.monotonic(), values[0], max(map(abs, values[37:43]))))
            time.sleep(0.005)

    def speed(self) -> float:
        """Return the newest packet's fastest joint, rad/s."""
        return self.seen[-1][2] if self.seen else 0.0

    def rest_after(self, event: float) -> float:
        """Return when the arm came to its last rest after ``event``, seconds from it; 0 where it rested all the time.

        By the controller's own clock from the last packet before the event on: a controller that is held up itself
        has not moved its arm meanwhile.
        """
        before = [made for came, made, _ in self.seen if came <= event]
        moving = [made for came, made, speed in self.seen if came > event and speed > 5e-3]
        return moving[-1] + 0.008 - before[-1] if moving and before else 0.0


@dataclass
class Run:
    """One session under a fault."""

    process: subprocess.Popen[str]
    watch: Watch
    controller: int
    folder: Path
    lines: list[tuple[float, str]] = field(default_factory=list)

    def child(self, word: str) -> int:
        """Return the number of the session's child whose command line has ``word``."""
        return children(self.process.pid)[word]


def punctual(thread: int = 0, priority: int = 30) -> None:
    """Let a thread, this one unless named, run before whatever else the machine does, the sessions included."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))


def ahead(process: subprocess.Popen[str]) -> None:
    """Let what begins run before other work, but after all that drives and measures."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(10))


def favour(controller: int) -> None:
    """Let a controller run before the session: a robot's does not wait for the computer that drives it."""
    for thread in Path(f"/proc/{controller}/task").iterdir():
        punctual(int(thread.name))


def children(parent: int) -> dict[str, int]:
    """Return the children of a process that matter here, by name."""
    found = {}
    for place in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError, IndexError):
            if int((place / "stat").read_text().rpartition(")")[2].split()[1]) == parent:
                line = (place / "cmdline").read_bytes().decode().split("\0")
                for word in ("hrcneuro.ur10", "hrcneuro.arms.ur_process"):
                    if word in line:
                        found[word] = int(place.name)
                        found[f"{word} at"] = next((line[i + 1] for i, w in enumerate(line) if w == "--address"), "")  # type: ignore[assignment]
    return found


def wait(condition: Callable[[], object], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.002)
    return False


def listen(run: Run) -> None:
    assert run.process.stderr is not None
    punctual()
    for line in run.process.stderr:
        run.lines.append((time.monotonic(), line.strip()))
    run.process.stderr.close()


def under_way(run: Run, *, at_rest: bool) -> bool:
    """Return once the arm is in a move of the session, or rests between two; False where it never is."""

    def over() -> bool:
        # One that was stopped by something else is writing its record.
        return any("told to stop" in line for _, line in run.lines) or run.process.poll() is not None

    def rests() -> bool:
        recent = [speed for came, _, speed in run.watch.seen[-100:] if came > time.monotonic() - 0.8]
        return len(recent) > 60 and max(recent) < 5e-3

    if not wait(lambda: over() or run.watch.speed() > 0.05, 60.0) or over():
        return False
    if not wait(lambda: over() or rests(), 30.0) or over():
        return False
    return at_rest or (wait(lambda: over() or run.watch.speed() > 0.15, 20.0) and not over())


def what_is_kept(folder: Path, elapsed: float) -> tuple[str, bool]:
    """Return what the recording holds, and whether more than a second before the fault is missing.

    Args:
        folder: Where recordings lie.
        elapsed: From the arm's first motion to the fault, seconds.
    """
    places = list(folder.glob("s01/*"))
    if len(places) != 1:
        return f"{len(places)} recordings", True
    table = places[0] / "telemetry.parquet"
    rows = pd.read_parquet(table) if table.exists() else read_stream(places[0] / "telemetry.arrows")
    commands = rows.filter(like="qd_command").to_numpy()
    first = rows["time_s"].to_numpy()[abs(commands).max(axis=1) > 0][0]
    missing = elapsed - float(rows["time_s"].iloc[-1] - first)
    whole = len(list(places[0].glob("*.parquet"))) == 4
    return ("tables, to the stop" if whole else f"telemetry, to {max(missing, 0):.2f} s before it"), missing > 1.0
