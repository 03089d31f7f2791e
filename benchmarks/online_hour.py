"""Whether the closed loop grows: an hour of samples on a virtual clock, in one process; exit code 1 where it does.

``python benchmarks/online_hour.py [MINUTES]``: 30 channels and a trigger line at 1000 Hz in chunks of 10, a move every
1.25 s, a block every four minutes, all decided. What the process holds is taken after five minutes and at the end.
"""

from __future__ import annotations

import gc
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from bench_online import CHANNELS, CHUNK, SFREQ, _decoder

from hrcneuro.io.decoders import read_decoder
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.online import OnlineLearner
from hrcneuro.live.online import Online
from hrcneuro.live.online_streams import find_eeg
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.live.transport import MOVES
from hrcneuro.live.virtual import VirtualNetwork, VirtualOutlet
from hrcneuro.paradigm import markers

EVERY_S, BLOCK_S, SETTLED_S = 1.25, 240.0, 300.0
GROWTH_MB = 5.0


class Session:
    """Samples and markers that come as a virtual clock moves on."""

    def __init__(self, labels: list[str]) -> None:
        names, kinds_ = [*labels, "TRIGGER"], ["eeg"] * CHANNELS + ["stim"]
        units = ["microvolts"] * CHANNELS + ["none"]
        self.eeg = VirtualOutlet("hour", "EEG", names, sfreq=SFREQ, source_id="hour", types=kinds_, units=units)
        self.moves = VirtualOutlet(MOVES, "Markers", ["marker"], sfreq=0, source_id="moves")
        self.network = VirtualNetwork(self.eeg, self.moves)
        self.noise = np.random.default_rng(2).normal(0, 10, (1000, CHANNELS)).astype(np.float32)
        self.begun, self.sent, self.moved, self.blocks = self.network.now, 0, 0, 0
        self.network.on_wait.append(self.happen)

    def happen(self, now: float) -> None:
        passed = now - self.begun
        if passed > self.blocks * BLOCK_S:
            self.blocks += 1
            self.moves.send(markers.of_block("s01", scenario="iC", block=self.blocks, practice=False), now)
        pulse = -1
        if passed > (self.moved + 1) * EVERY_S:
            where = {"scenario": "iC", "block": self.blocks, "episode": 1, "trial": self.moved, "practice": False}
            actor = ("robot", "human")[self.moved % 2]
            self.moves.send(markers.of_move("s01", actor=actor, next="NESW"[self.moved % 4], **where), now)
            self.moved, pulse = self.moved + 1, self.sent
        while self.sent + CHUNK <= passed * SFREQ:
            numbers = self.sent + np.arange(CHUNK)
            trigger = (numbers >= pulse) & (numbers < pulse + CHUNK) & (pulse >= 0)
            values = np.column_stack([self.noise[self.sent % 1000 :][:CHUNK], trigger.astype(np.float32)])
            self.eeg.push(self.begun + numbers / SFREQ, values)
            self.sent += CHUNK


def main(minutes: float = 60.0) -> int:
    """Play, and return whether it grew."""
    with tempfile.TemporaryDirectory() as name:
        labels = _decoder(Path(name))
        decoder, _ = read_decoder(Path(name) / "made")
    session, options = Session(labels), OnlineOptions(mode="closed")
    network = session.network
    loop = Online(
        network, network.clock, find_eeg(network, network.clock, network.wait, decoder, options), decoder,
        OnlineLearner(kinds(alpha=0.05, ddof=0, horizon=40.0)["paper"], tau=0.1), options, subject="s01",
        publish=lambda text, stamp: None, log=lambda line: None,
    )  # fmt: skip
    process, held, begun = psutil.Process(), 0.0, time.process_time()
    while (passed := network.now - session.begun) < 60 * minutes:
        network.wait(CHUNK / SFREQ)
        loop.step()
        if not held and passed > min(SETTLED_S, 30 * minutes):
            gc.collect()
            held = process.memory_info().rss / 1e6
    gc.collect()
    last = process.memory_info().rss / 1e6
    print(
        f"{minutes:g} minutes, {session.moved} moves, {loop.decided} decided, {loop.deciding.learner.updates} taught: "
        f"{held:.1f} MB held after {min(SETTLED_S / 60, minutes / 2):g} minutes, {last:.1f} MB at the end; "
        f"{time.process_time() - begun:.0f} s of the processor"
    )
    return int(last - held > GROWTH_MB)


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:])))
