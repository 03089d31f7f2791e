"""The command ``experiment`` as a process with a simulated person: watched, killed and gone on with from outside."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import psutil
from tiny_study import wait_for
from ur10_robot import Stream

from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import protocol, simulate_session
from hrcneuro.robot.backend import PERIOD
from hrcneuro.sources import authors_log, experiments
from hrcneuro.sources.simulated import generator

ROOT = Path(__file__).parents[2]
__all__ = ["SessionParams", "wait_for"]
PATIENCE = 120.0  # s, of a busy machine
SUBJECT, SEED = "s01", 2023
SMALL = SessionParams(practice_episodes=0, blocks=4, episodes_per_block=1)
QUICK = ("--set", "experiment.break_s=0.2", "--set", "experiment.pause_s=0.2")
# On a busy machine the simulated controller, or who drives it, may be held up: not what is tested.
SIMULATED = ("--backend", "ursim", "--patient")
BORNE = [
    word
    for value in ("max_packet_age_s=0.5", "max_late_s=0.5", "max_path_error_mm=50", "lead_s=0.035")
    for word in ("--set", f"robot.{value}")
]
TIMES = ["onset_s", "t_f_s", "soa_s", "onset_sample"]


def sized(params):
    """Return the words that set a session's size."""
    names = ("practice_episodes", "blocks", "episodes_per_block")
    return [word for name in names for word in ("--set", f"acquire.session.{name}={getattr(params, name)}")]


class Experiment:
    """One run of the command, in a folder that may hold a session already."""

    def __init__(self, folder, *words, params=SMALL, environment=None, screen=False, lsl=False, **options):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.place = folder, folder / "recordings" / SUBJECT
        self.parts = parts_of(self.place)
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        env = {**os.environ, "PYTHONPATH": path, "NO_COLOR": "1", **(environment or {})}
        words = [*words, *QUICK, *sized(params), *([] if screen else ["--no-screen"]), *([] if lsl else ["--no-lsl"])]
        given = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "hrcneuro", "experiment", SUBJECT, "--human", "simulated", *words,
             "--workdir", str(folder)],
            env=env, cwd=folder, start_new_session=True, **(given | options),
        )  # fmt: skip

    def lines(self, kind):
        """Return what was written of a kind in this run."""
        with contextlib.suppress(OSError, IndexError):
            entries = experiments.read(self.place / experiments.FILE)[0]
            starts = [i for i, entry in enumerate(entries) if entry["kind"] == experiments.SESSION]
            return [entry for entry in entries[starts[self.parts] :] if entry["kind"] == kind]
        return []

    def newest(self):
        """Return the last lines that were written, for a message."""
        with contextlib.suppress(OSError):
            return entries(self.place)[-12:]
        return []

    def until(self, kind, n=1):
        """Wait until so many lines of a kind are written, and return the last; that the run ends before is an error."""
        until = time.monotonic() + PATIENCE
        while len(found := self.lines(kind)) < n:
            assert self.process.poll() is None, (self.process.returncode, self.process.communicate())
            assert time.monotonic() < until, f"{n} lines '{kind}' did not come; the last ones: {self.newest()}"
            time.sleep(0.02)
        return found[n - 1]

    def end(self, timeout=PATIENCE):
        """Wait for the end; return exit code, standard output and standard error."""
        out, err = self.process.communicate(timeout=timeout)
        return self.process.returncode, out, err

    def close(self):
        """End all that is left of it."""
        for process in (*self.others(), self.process):
            with contextlib.suppress(psutil.Error, ProcessLookupError):
                process.kill()
        with contextlib.suppress(ValueError):
            self.process.communicate()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def others(self):
        """Return the processes that it started."""
        with contextlib.suppress(psutil.NoSuchProcess):
            return psutil.Process(self.process.pid).children(recursive=True)
        return []

    @property
    def spawned(self):
        """The arm's side and the window, by Python's own module, oldest first; the window is opened first."""
        return [one for one in self.others() if "spawn_main" in " ".join(_words(one))]

    @property
    def controller(self):
        """The simulated controller's process and its address."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until and self.process.poll() is None:
            for one in self.others():
                words = _words(one)
                if "hrcneuro.ur10" in words:
                    return one, words[words.index("--address") + 1]
            time.sleep(0.05)
        raise AssertionError(f"no simulated controller; exit code {self.process.poll()}")


def _words(process):
    with contextlib.suppress(psutil.Error):
        return process.cmdline()
    return []


def stream_of(address):
    """Return a client of a controller's port of packets."""
    return Stream(SimpleNamespace(connect=lambda port: socket.create_connection((address, port), 5.0)))


def fastest(packet):
    return max(map(abs, packet[37:43]))


def rest_after(stream, deed):
    """Do something while the arm moves; return after how many seconds of the controller's clock it moved no more."""
    stream.until(lambda packet: fastest(packet) > 0.05, seconds=PATIENCE)
    begun = moving = stream.newest()[0]
    deed()
    packet, still = None, 0
    # The controller may end once the arm rests.
    with contextlib.suppress(AssertionError, OSError):
        while still < 40:
            packet = stream.packet()
            still = 0 if fastest(packet) > 5e-3 else still + 1
            moving = packet[0] if not still else moving
    stream.link.close()
    assert packet is not None
    assert fastest(packet) <= 5e-3, "the controller ended with an arm that moved"
    return moving + PERIOD - begun


def ended(processes, seconds=30.0):
    """Return those processes that still live after so many seconds at most."""
    return psutil.wait_procs(processes, timeout=seconds)[1]


def rows_of(place):
    """Return the moves in ``experiment.jsonl``, a dict each; that only its last line may be torn is asserted."""
    entries, _ = experiments.read(place / experiments.FILE)
    return [entry for entry in entries if entry["kind"] == experiments.MOVE]


def check_log(place, *, arm_moves=None):
    """Assert that the log is whole up to the last finished move.

    ``arm_moves``: what the arm did since the log's last part, as (block, episode, trial): the last one may have ended
    without anybody left to write it down.
    """
    rows = rows_of(place)
    pair = (place / f"subject{SUBJECT[1:]}.csv").read_text()
    expected = [authors_log.log_line(SimpleNamespace(**row)) for row in rows]
    lines = pair.splitlines(keepends=True)[1:]
    assert lines in (expected, expected[:-1])
    if arm_moves is not None:
        logged = [(row["block"], row["episode"], row["trial"]) for row in rows]
        n = len(arm_moves)
        tail = [] if not n else logged[-n:]
        assert arm_moves in (tail, [*logged[len(logged) - n + 1 :], arm_moves[-1]] if n else []), (arm_moves, logged)


def arm_moves(folder):
    """Return the moves in an arm's recording that came to their end, as (block, episode, trial)."""
    moves = pd.read_parquet(folder / "moves.parquet")
    return list(zip(moves["block"].tolist(), moves["episode"].tolist(), moves["trial"].tolist(), strict=True))


def parts_of(place):
    """Return how often a session was begun or gone on with."""
    with contextlib.suppress(OSError):
        entries, _ = experiments.read(place / experiments.FILE)
        return sum(entry["kind"] == experiments.SESSION for entry in entries)
    return 0


def expected(params, seed=SEED, subject=SUBJECT):
    """Return the simulated study's rows of a session, but for its times."""
    rows = simulate_session(params, rng=generator(seed, subject, "moves"))
    return rows[[name for name in rows if name not in TIMES]]


def check_session(place, params=SMALL):
    """Assert that a session is complete: each block once and in order, one that was broken off up to its break.

    Return how many blocks were broken off.
    """
    table = pd.read_parquet(place / "trials.parquet")
    whole = expected(params)
    keys = ["practice", "block"]
    order = [tuple(key) for key in table[keys].itertuples(index=False)]
    blocks = list(dict.fromkeys(order))
    assert sorted(order, key=blocks.index) == order, "a block comes back"
    assert blocks == [(block.practice, block.number) for block in protocol(params)]
    broken = 0
    for practice, number in blocks:
        got, want = (one[(one["practice"] == practice) & (one["block"] == number)] for one in (table, whole))
        broken += len(got) < len(want)
        same(got, want.iloc[: len(got)], broken=len(got) < len(want))
    assert (np.diff(table["onset_s"]) > 0).all()
    entries, _ = experiments.read(place / experiments.FILE)
    assert entries[-1]["kind"] == experiments.END
    assert entries[-1]["complete"]
    check_log(place)
    return broken


def same(got, want, *, broken=False):
    """Assert that rows are equal in every column that both have, but for the times.

    ``broken``: after the last row comes none, so that what it says of the next move is unknown.
    """
    names = [name for name in want if name in got and name not in TIMES]
    assert len(names) >= 15, names
    got, want = (one[names].reset_index(drop=True) for one in (got, want))
    for name in names:
        left, right = (one[name].astype(object).where(one[name].notna(), None).tolist() for one in (got, want))
        last = -1 if broken and name in ("condition_before", "turn") else None
        assert left[:last] == right[:last], name


def arm_moves_of(place):
    """Return the moves in the newest of the arm's recordings, as :func:`arm_moves` does."""
    folders = sorted(path.parent for path in place.glob("*/moves.parquet"))
    return arm_moves(folders[-1]) if folders else []


def entries(place):
    """Return the lines of ``experiment.jsonl``."""
    return experiments.read(place / experiments.FILE)[0]


def last(place):
    """Return the last line of ``experiment.jsonl``."""
    return entries(place)[-1]


def same_so_far(place, params):
    """Assert that the moves of a session that nothing has broken off before its end are the simulated study's first."""
    table = pd.read_parquet(place / "trials.parquet")
    same(table, expected(params).iloc[: len(table)], broken=True)
