"""Times the closed loop over LSL on loopback: from the push of the last sample that a decision needs to the decision.

``python benchmarks/bench_online.py [--moves N]``: a sender of 30 channels and a trigger line at 1 kHz, in chunks of 10
that leave when their last sample is due, and ``hrcneuro online`` as a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))
from live_lab import ROOT, lsl_api

SFREQ, CHUNK, CHANNELS, EVERY_S = 1000.0, 10, 30, 0.75
LIMIT_P99_MS, LIMIT_SHARE, LIMIT_MB = 5.0, 0.25, 300.0


def main() -> int:
    """Measure, print a table, return 1 where a limit is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=300)
    moves = parser.parse_args().moves
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "lsl_api.cfg").write_text(lsl_api(f"bench-{os.getpid()}"))
        os.environ["LSLAPICFG"] = str(folder / "lsl_api.cfg")
        (folder / "hrcneuro.toml").write_text('[study]\nname = "bench"\nsubjects = ["s01"]\nexclude = []\n')
        labels = _decoder(folder)
        pushed, answer = _run(folder, labels, moves)
        lines = [
            json.loads(line)
            for path in folder.glob("recordings/s01/*/decisions.jsonl")
            for line in path.read_text().splitlines()
        ]
    return _table(lines, pushed, answer)


def _decoder(folder: Path) -> list[str]:
    from hrcneuro.decoding.features import WINDOWS_S
    from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem, windows
    from hrcneuro.eeg.causal import design
    from hrcneuro.io.decoders import write_decoder

    rng = np.random.default_rng(1)
    labels = [f"E{i + 1}" for i in range(CHANNELS)]
    weights = rng.normal(0, 0.1, CHANNELS * len(WINDOWS_S))
    problems = {
        name: FrozenProblem((f"{name}1", f"{name}2"), actor, weights, 0.0, 0.5, 0.0)
        for name, actor in (("HHvsHR", "human"), ("RRvsRH", "robot"))
    }
    matrix = np.eye(CHANNELS) - 1 / CHANNELS
    band = (0.1, 40.0)
    made = FrozenDecoder(
        tuple(labels), SFREQ, band, design(SFREQ, *band), matrix, tuple(labels), windows(SFREQ), 1e4, problems
    )
    (folder / "made").mkdir()
    write_decoder(made, folder / "made", about={})
    return labels


def _run(folder: Path, labels: list[str], moves: int) -> tuple[dict[float, float], dict]:
    """Send until all moves are done; return the last stamp of each chunk -> when it was pushed, and the answer."""
    from hrcneuro.live.lsl import LslOutlet
    from hrcneuro.paradigm import markers

    eeg = LslOutlet(
        "bench", "EEG", [*labels, "TRIGGER"], sfreq=SFREQ, source_id=f"bench-{os.getpid()}",
        types=["eeg"] * CHANNELS + ["stim"], units=["microvolts"] * CHANNELS + ["none"],
    )  # fmt: skip
    marks = LslOutlet("hrcneuro-moves", "Markers", ["marker"], sfreq=0, source_id=f"moves-{os.getpid()}")
    words = [sys.executable, "-m", "hrcneuro", "online", "s01", "--mode", "closed", "--decoder", "made", "--json", "-q"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    loop = subprocess.Popen(words, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True)
    rng = np.random.default_rng(2)
    noise = rng.normal(0, 15, (100 * CHUNK, CHANNELS)).astype(np.float32)
    begun, sent, done, pulse = eeg.clock(), 0, 0, -1000
    first_s = 12.0
    pushed: dict[float, float] = {}
    while loop.poll() is None and eeg.clock() - begun < first_s + moves * EVERY_S + 5.0:
        now = eeg.clock()
        if done < moves and now - begun >= first_s + done * EVERY_S:
            text = markers.of_move(
                "s01", scenario="iC", block=1, episode=1 + done // 12, trial=done % 12, practice=False,
                actor=("human", "robot")[done % 2], next="NESW"[int(rng.integers(4))],
            )  # fmt: skip
            marks.send(text, now)
            pulse, done = int((now - begun) * SFREQ) + 1, done + 1
        if now - begun >= (sent + CHUNK) / SFREQ:
            numbers = sent + np.arange(CHUNK)
            at = sent % (99 * CHUNK)
            trigger = ((numbers >= pulse) & (numbers < pulse + 10)).astype(np.float32)
            stamps = begun + numbers / SFREQ
            eeg.push(stamps, np.column_stack([noise[at : at + CHUNK], trigger]))
            pushed[float(stamps[-1])] = eeg.clock()
            sent += CHUNK
            if done == moves and now - begun > first_s + moves * EVERY_S + 2.0:
                marks.send(markers.of_end("s01"), now)
                done += 1
        time.sleep(0.0003)
    out, _ = loop.communicate(timeout=30)
    return pushed, json.loads(out)


def _table(lines: list[dict], pushed: dict[float, float], answer: dict) -> int:
    decided = [line for line in lines if line["kind"] == "move" and line["score"] is not None]
    lasts = np.array(sorted(pushed))
    of_chunk = [pushed[float(lasts[np.searchsorted(lasts, line["last_stamp"])])] for line in decided]
    stages = {
        "last needed sample's push to decision sent": [
            line["sent_s"] - when for line, when in zip(decided, of_chunk, strict=True)
        ],
        "of it: push to received": [line["pulled_s"] - when for line, when in zip(decided, of_chunk, strict=True)],
        "of it: deciding": [line["stages_ms"]["decision"] / 1e3 for line in decided],
        "of it: learning": [line["stages_ms"]["learning"] / 1e3 for line in decided],
        "onset's marker to decision sent": [line["sent_s"] - line["marker_s"] for line in decided],
    }
    print(
        f"{len(decided)} decisions, {answer['in_time']} in time, {answer['updates']} taught, causes {answer['causes']}"
    )
    print(f"{'':<44}{'median':>9}{'99 %':>9}{'most':>9}  ms")
    for name, values in stages.items():
        ms = 1e3 * np.array(values)
        print(f"{name:<44}{np.median(ms):9.2f}{np.percentile(ms, 99):9.2f}{ms.max():9.2f}")
    print(f"share of a core {100 * answer['cpu_share']:.1f} %, memory {answer['rss_mb']:.0f} MB")
    p99 = 1e3 * float(np.percentile(stages["last needed sample's push to decision sent"], 99))
    over = p99 > LIMIT_P99_MS or answer["cpu_share"] > LIMIT_SHARE or answer["rss_mb"] > LIMIT_MB
    return int(over)


if __name__ == "__main__":
    sys.exit(main())
