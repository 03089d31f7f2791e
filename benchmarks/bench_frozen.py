"""What a live session asks of the frozen decoder: a chunk of 10 samples filtered and kept, and a decision; a script.

30 channels of EEG and EOG of a stream with a trigger channel beside them, 1000 Hz. Processor time of this thread, since
other work of the machine is not the decoder's. The exit code is 1 where a median is above its limit.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from _measure import options

from hrcneuro.decoding.features import WINDOWS_S
from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem, windows
from hrcneuro.eeg.causal import design

N_CHANNELS, N_KEPT, SFREQ, CHUNK = 30, 27, 1000.0, 10
CHUNK_LIMIT_US, DECISION_LIMIT_US = 100.0, 300.0


def decoder(rng: np.random.Generator) -> FrozenDecoder:
    """Return a decoder of the study's size, of random numbers."""
    problem = FrozenProblem(("RR", "RH"), "robot", rng.normal(size=N_KEPT * len(WINDOWS_S)), 0.0, 0.1, 0.0)
    names = tuple(f"E{i}" for i in range(N_CHANNELS))
    band = (0.1, 40.0)
    matrix = rng.normal(size=(N_KEPT, N_CHANNELS))
    return FrozenDecoder(
        names, SFREQ, band, design(SFREQ, *band), matrix, names[:N_KEPT], windows(SFREQ), 1000.0, {"RRvsRH": problem}
    )


def microseconds(work: Callable[[], object], times: int) -> tuple[float, float, float]:
    """Return median, p99 and the largest of the times that a work takes, µs of this thread."""
    taken = np.empty(times)
    for i in range(times):
        began = time.thread_time_ns()
        work()
        taken[i] = time.thread_time_ns() - began
    return float(np.median(taken)) / 1e3, float(np.quantile(taken, 0.99)) / 1e3, float(taken.max()) / 1e3


def main() -> int:
    """Print a line a result; return the exit code."""
    runs = 2000 if options(__doc__).repeats == 1 else 20_000
    rng = np.random.default_rng(0)
    one = decoder(rng)
    rows = one.rows(["TRIGGER", *one.channels], ["", *["uV"] * N_CHANNELS], SFREQ, beside={"TRIGGER"})
    stream = one.stream(kept_s=2.0)
    chunk = rng.normal(0, 20, (N_CHANNELS + 1, CHUNK)).astype(np.float32)
    for _ in range(400):
        stream.push(chunk[rows])
    first = stream.end - 700
    pushed = microseconds(lambda: stream.push(chunk[rows]), runs)
    first = stream.end - 700
    decided = microseconds(lambda: one.decide(stream.cut(first, one.n_times), "RRvsRH"), runs // 10)
    for name, (median, p99, most), limit in (
        (f"a chunk of {CHUNK} samples × {N_CHANNELS + 1} channels", pushed, CHUNK_LIMIT_US),
        (f"a decision: {one.n_times} samples cut, cleaned, scored", decided, DECISION_LIMIT_US),
    ):
        print(f"{name}: median {median:.0f} µs (limit {limit:.0f}), p99 {p99:.0f} µs, largest {most:.0f} µs")
    return int(pushed[0] > CHUNK_LIMIT_US or decided[0] > DECISION_LIMIT_US)


if __name__ == "__main__":
    sys.exit(main())
