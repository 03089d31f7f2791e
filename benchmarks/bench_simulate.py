"""Times SIM1-4 (26 curves) at 100 to 10,000 repetitions on one core, with the peak memory.

``python benchmarks/bench_simulate.py [--quick] [R ...]``; ``--quick`` leaves the 10,000 out and runs each once.
"""

from __future__ import annotations

import argparse
import resource
import time
from functools import partial

from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.rates import PAPER
from hrcneuro.learning.simulations import paper_simulations, run_curves
from hrcneuro.learning.task import JointTask

LIMITS = {100: 1.5, 10_000: 60.0}


def main(counts: list[int], *, quick: bool) -> None:
    variants = paper_simulations(
        JointTask(),
        empirical=CoinFlips(PAPER),
        levels=(50, 60, 70, 80),
        reassign="every",
        cases=((6, 3), (10, 5), (10, 2)),
    )
    for repetitions in counts:
        times = []
        for _ in range(1 if quick or repetitions > 1000 else 3):
            start = time.perf_counter()
            run_curves(variants, partial(PaperLearner, alpha=0.05), repetitions=repetitions, seed=1, tau=0.1)
            times.append(time.perf_counter() - start)
        seconds = sorted(times)[len(times) // 2]
        limit = f" (limit {LIMITS[repetitions]:g} s)" if repetitions in LIMITS else ""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{len(variants)} curves x {repetitions} repetitions: {seconds:.2f} s{limit}, peak {peak:.0f} MB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="100 and 1000 repetitions, one run instead of the median")
    parser.add_argument("repetitions", type=int, nargs="*", help="repetitions of each curve")
    chosen = parser.parse_args()
    main(chosen.repetitions or ([100, 1000] if chosen.quick else [100, 1000, 10_000]), quick=chosen.quick)
