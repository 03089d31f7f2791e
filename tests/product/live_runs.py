"""Streams in real time, as a laboratory has them: ``python tests/product/live_runs.py [--brief] [NAME …]``.

Each run starts the simulated amplifier and the recorder as processes, on loopback alone, and says what came of it, a
line a claim. They take real time: an hour in all, half of it ``load``; ``--brief`` takes some minutes. ``make live``.
What needs programs of others (``LABRECORDER``, ``LIBXDF``: see live_foreign) is skipped, and says so, without them.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import psutil

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))
from live_clocks import clocks, other_units, timing
from live_foreign import labrecorder, libxdf
from live_hosts import pulled_cable
from live_lab import Lab, Row, foreign

from hrcneuro.paradigm.markers import move_in

EEG_ONLY = ["--set", 'record.streams={eeg={type="EEG",sfreq=1000}}']


def load(lab: Lab) -> Iterator[Row]:
    """30 channels at 1000 Hz and a marker a second: nothing is lost, and little is needed."""
    seconds = 60 if lab.brief else 1800
    markers = subprocess.Popen([sys.executable, "-c", _MARKERS], env=lab.environment, cwd=lab.folder)
    try:
        with lab.amplifier():
            recorder = lab.start("record", "s01", "--json", "--seconds", str(seconds))
            seen = list(_usage(recorder, seconds + 6))
            out, _ = recorder.communicate(timeout=600)
    finally:
        markers.kill()
        markers.wait()
    checked = {one["stream"]: one for one in json.loads(out)["check"]}
    eeg, marks = checked["eeg"], checked["markers"]
    yield f"{eeg['samples']:,} samples, {eeg['missing']} missing", eeg["missing"] == 0 and eeg["whole"], ""
    stream = lab.streams()
    texts = [int(row[0].rpartition("=")[2]) for row in stream["hrcneuro-moves"]["time_series"]]
    yield f"{marks['samples']} markers, all of them", texts == list(range(texts[0], texts[0] + len(texts))), ""
    cpu = sum(one for one, _ in seen[5:]) / max(len(seen[5:]), 1)
    memory = [one for _, one in seen[10:]]
    yield f"recorder: {cpu:.1f} % of a core", cpu <= 15, "15 % allowed"
    yield f"recorder: {max(memory):.0f} MB at most", max(memory) <= 150, "150 MB allowed"
    grown = np.median(memory[-20:]) - np.median(memory[:20])
    yield f"recorder: grows by {grown:.1f} MB from beginning to end", grown < 10, ""


_MARKERS = """
import itertools, time
from hrcneuro.live.lsl import LslOutlet
outlet = LslOutlet("hrcneuro-moves", "Markers", ["marker"], sfreq=0, source_id="live")
for i in itertools.count():
    outlet.send(f"move/subject=s01/scenario=iC/block=1/episode=1/trial={i}", outlet.clock())
    time.sleep(1)
"""


def _usage(process: subprocess.Popen[str], seconds: float) -> Iterator[tuple[float, float]]:
    """Yield (percent of a core, MB) of a process, once a second."""
    watched, end = psutil.Process(process.pid), time.monotonic() + seconds
    watched.cpu_percent()
    while process.poll() is None and time.monotonic() < end:
        time.sleep(1)
        with contextlib.suppress(psutil.Error):
            yield watched.cpu_percent(), watched.memory_info().rss / 1e6


def replay(lab: Lab) -> Iterator[Row]:
    """What is replayed comes back, sample by sample, with its markers."""
    from hrcneuro.io.fif import read_raw

    lab.start("acquire", "s01").communicate()
    with lab.amplifier("--replay"):
        code, _, said = lab.record("--seconds", "40" if lab.brief else "120")
    yield "whole", code == 0, said[-200:]
    (path,) = lab.folder.glob("cache/acquire/s01/*/s01_raw.fif")
    sent = (read_raw(path).get_data(picks=["eeg", "eog"]) * 1e6).astype(np.float32).T
    streams = lab.streams()
    eeg = streams["actiCHamp"]["time_series"]
    first = next(i for i in range(len(sent)) if np.array_equal(sent[i], eeg[0, :-1]))
    n = min(len(eeg), len(sent) - first)
    yield f"{n:,} samples equal", bool(np.array_equal(eeg[:n, :-1], sent[first : first + n])), ""
    edges = np.flatnonzero(np.diff(eeg[:, -1]) > 0) + 1
    stamps = streams["hrcneuro-moves"]["time_stamps"]
    places = (stamps - streams["actiCHamp"]["time_stamps"][0]) * 1000
    away = [float(np.abs(edges - place).min()) for place in places]
    yield f"{len(away)} markers, at most {max(away):.2f} samples from the trigger's edge", max(away) <= 1, ""


def kills(lab: Lab) -> Iterator[Row]:
    """A recorder that is killed at any time: its file opens, and at most a second is lost; --resume goes on."""
    draw, times = random.Random(5), 4 if lab.brief else 30
    lost, opened, resumed = [], 0, 0
    with lab.amplifier():
        for _ in range(times):
            recorder = lab.start("record", "s01", *EEG_ONLY)
            until = time.monotonic() + 60
            while not list(lab.folder.glob("recordings/s01/*/part1.xdf")) and time.monotonic() < until:
                time.sleep(0.05)
            time.sleep(draw.uniform(0.5, 6.0))
            os.killpg(recorder.pid, signal.SIGKILL)
            killed = time.clock_gettime(time.CLOCK_MONOTONIC)
            recorder.communicate()
            eeg = lab.streams()["actiCHamp"]["time_stamps"]
            opened += 1
            lost.append(killed - float(eeg[-1]))
            code, _, _ = lab.record("--resume", "--seconds", "2", *EEG_ONLY)
            # What was killed is not whole, and says so; what was resumed is there.
            resumed += code == 1 and len(lab.streams(2)["actiCHamp"]["time_stamps"]) > 1500
            for path in lab.folder.glob("recordings/s01/*/part*.xdf"):
                path.rename(path.with_suffix(f".{time.time_ns()}"))
    yield f"{opened} of {times} files open", opened == times, ""
    yield f"at most {max(lost):.2f} s lost", max(lost) <= 1.0, "1 s allowed"
    yield (
        f"{resumed} of {times} went on with --resume, and exit code 1 says that the first part is not whole",
        resumed == times,
        "",
    )


def amplifier_dies(lab: Lab) -> Iterator[Row]:
    """An amplifier is killed and started again: the gap is marked to the sample, and nothing else is touched."""
    with lab.amplifier() as first:
        recorder = lab.start("record", "s01", "--json", "--seconds", "16", *EEG_ONLY)
        time.sleep(8)
        os.killpg(first.pid, signal.SIGKILL)
        with lab.amplifier():
            out, _ = recorder.communicate(timeout=120)
    stamps = lab.streams()["actiCHamp"]["time_stamps"]
    steps = np.diff(stamps)
    (gap,) = np.flatnonzero(steps > 0.0015)
    missing = round(float(steps[gap]) * 1000) - 1
    marks = [row[0] for row in lab.streams()["hrcneuro-recorder"]["time_series"]]
    told = [int(text.split("samples=")[1].split("/")[0]) for text in marks if text.startswith("gap/")]
    yield f"a gap of {missing} samples, marked as {told}", len(told) == 1 and abs(told[0] - missing) <= 1, ""
    yield "exit code 1", recorder.returncode == 1, str(json.loads(out)["check"])[:200]


def full_disk(lab: Lab) -> Iterator[Row]:
    """A disk fills up: it is said at once, what was written is kept, exit code 1."""
    if os.geteuid():
        yield "SKIPPED: needs root, to mount a small file system", True, ""
        return
    place = lab.folder / "recordings"
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=240M", "tmpfs", str(place)], check=True)
    try:
        with lab.amplifier():
            recorder = lab.start("record", "s01", "--json", *EEG_ONLY)
            time.sleep(12)
            fill = place / "fill"
            with contextlib.suppress(OSError), fill.open("wb") as file:
                while True:
                    file.write(bytes(1 << 20))
            filled = time.monotonic()
            out, err = recorder.communicate(timeout=60)
            took = time.monotonic() - filled
        yield "exit code 1", recorder.returncode == 1, err[-300:]
        yield "says that the disk is full", "No space left" in out + err, ""
        yield f"ended {took:.1f} s after it was full", took < 20, ""
        fill.unlink()
        kept = len(lab.streams()["actiCHamp"]["time_stamps"])
        yield f"{kept:,} samples are kept and open", kept > 1500, ""
    finally:
        subprocess.run(["umount", str(place)], check=False)


def experiment(lab: Lab) -> Iterator[Row]:
    """An experiment beside a recorder that loses its EEG pauses; with nobody at the terminal it ends, and goes on."""
    words = ["--backend", "none", "--human", "simulated", "--no-screen", *EEG_ONLY]
    # Until the first move: two processes load their libraries, the arm finds its lead, a simulated person reads.
    words += ["--set", "experiment.break_s=0.2", "--set", "experiment.pause_s=0.2", "--set", "robot.lead_s=0.035"]
    with lab.amplifier() as amp:
        recorder = lab.start("record", "s01", *EEG_ONLY)
        _until(lambda: bool(lab.parts()))
        run = lab.start("experiment", "s01", *words)
        log = lab.folder / "recordings" / "s01" / "experiment.jsonl"
        _until(lambda: run.poll() is not None or (log.exists() and '"kind":"move"' in log.read_text()))
        amp.kill()
        _, said = run.communicate(timeout=60)
        recorder.terminate()
        recorder.communicate(timeout=60)
    yield "a lost stream ends it with exit code 4", run.returncode == 4, said[-200:]
    yield "it says which", "the recorder has lost eeg" in said, said[-200:]
    kinds = [json.loads(line)["kind"] for line in log.read_text().splitlines()]
    yield "the log tells of the pause, and was closed", "pause" in kinds and kinds[-1] == "end", str(kinds[-5:])


def robot(lab: Lab) -> Iterator[Row]:
    """The robot replays a log while amplifier and recorder run, and tells the amplifier what a person would expect."""
    words = ["--backend", "ursim", "--patient"]
    for value in ("markers='lsl'", "truth=true", "recorder_wait_s=60", *(["blocks=[1]"] if lab.brief else [])):
        words += ["--set", f"robot.{value}"]
    with lab.amplifier():
        recorder = lab.start("record", "s01", "--json", "--set", "record.wait_s=120")
        _, said = lab.start("robot", "s01", *words).communicate()
        recorder.terminate()
        out, _ = recorder.communicate(timeout=120)
    checked = {one["stream"]: one for one in json.loads(out)["check"]}
    eeg, marks = checked["eeg"], checked["markers"]
    streams = lab.streams()
    moves = [move_in(row[0]) for row in streams["hrcneuro-moves"]["time_series"]]
    yield f"{eeg['samples']:,} samples, {eeg['missing']} missing", eeg["missing"] == 0 and eeg["whole"], said[-300:]
    made = pd.read_parquet(next(lab.folder.glob("recordings/s01/*/moves.parquet")))
    began = int(made["marker_s"].notna().sum())
    yield f"{marks['samples']} markers of {began} onsets", len(moves) == began and None not in moves, said[-300:]
    trials = pd.read_parquet(next(lab.folder.glob("cache/acquire/s01/*/trials.parquet")))
    where = ["practice", "block", "episode", "trial"]
    actors = trials.set_index(where)["actor"].to_dict()
    falls: dict[str, list[float]] = {"human": [], "robot": []}
    labels = [one["label"][0] for one in streams["actiCHamp"]["info"]["desc"][0]["channels"][0]["channel"]]
    c3, stamps = streams["actiCHamp"]["time_series"][:, labels.index("C3")], streams["actiCHamp"]["time_stamps"]
    for move, when in zip(moves, streams["hrcneuro-moves"]["time_stamps"], strict=True):
        onset = int(np.searchsorted(stamps, when))
        if move is not None and onset >= 600:
            fall = c3[onset - 600 : onset - 400].mean() - c3[onset - 100 : onset].mean()
            falls[actors[tuple(move[name] for name in where)]].append(float(fall))
    person, arm = (float(np.mean(falls[who])) for who in ("human", "robot"))
    yield (
        f"before the person's own moves C3 falls by {person:.1f} µV, before the robot's by {arm:.1f}",
        person > arm,
        "",
    )


def _until(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.05)


RUNS: dict[str, Callable[[Lab], Iterator[Row]]] = {
    one.__name__: one
    for one in (
        replay, clocks, timing, amplifier_dies, other_units, pulled_cable, experiment, robot, full_disk, foreign,
        labrecorder, libxdf, kills, load,
    )
}  # fmt: skip


def main() -> int:
    """Run what is asked for; return 1 where a claim does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(RUNS)}; all without")
    parser.add_argument("--brief", action="store_true")
    asked = parser.parse_args()
    bad = 0
    for name in asked.names or RUNS:
        with tempfile.TemporaryDirectory(prefix="hrcneuro-live-") as folder:
            for claim, holds, more in RUNS[name](Lab(Path(folder), brief=asked.brief)):
                bad += not holds
                print(
                    f"{'ok  ' if holds else 'BAD '} {name:15} {claim}{f'   ({more})' if more and not holds else ''}",
                    flush=True,
                )
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
