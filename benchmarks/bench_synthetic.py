"""Times a full-size synthetic subject (37 min, 30 channels, 1000 Hz) on one core, with peak memory: ``python FILE``."""

from __future__ import annotations

import resource
import time

import numpy as np
from threadpoolctl import threadpool_limits

from hrcneuro.eeg.synthetic import SyntheticParams, generate
from hrcneuro.paradigm.session import SessionParams, simulate_session

LIMIT_S, LIMIT_MB = 15.0, 2048


def main() -> None:
    trials = simulate_session(SessionParams(), rng=np.random.default_rng(1))
    with threadpool_limits(1):
        for turn in ("first (head model included)", "next"):
            start, core = time.perf_counter(), time.process_time()
            made = generate(trials, params=SyntheticParams(), sfreq=1000.0, rng=np.random.default_rng(1))
            seconds, core = time.perf_counter() - start, time.process_time() - core
            minutes = made.data_uv.shape[1] / 60e3
            size = f"synthetic subject, {minutes:.1f} min x 30 channels"
            print(f"{size}, {turn}: {core:.1f} s of one core (limit {LIMIT_S:g} s), {seconds:.1f} s on the clock")
            del made
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak {peak:.0f} MB (limit {LIMIT_MB} MB)")


if __name__ == "__main__":
    main()
