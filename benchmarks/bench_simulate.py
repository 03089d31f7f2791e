"""Times SIM1-4 (26 curves) at 100 to 10,000 repetitions on one core, with the peak memory: ``python FILE [R ...]``."""

from __future__ import annotations

import resource
import sys
import time
from functools import partial

from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.rates import PAPER
from hrcneuro.learning.simulations import paper_simulations, run_curves
from hrcneuro.learning.task import JointTask

LIMITS = {100: 1.5, 10_000: 60.0}


def main(counts: list[int]) -> None:
    variants = paper_simulations(
        JointTask(),
        empirical=CoinFlips(PAPER),
        levels=(50, 60, 70, 80),
        reassign="every",
        cases=((6, 3), (10, 5), (10, 2)),
    )
    for repetitions in counts:
        times = []
        for _ in range(3 if repetitions <= 1000 else 1):
            start = time.perf_counter()
            run_curves(variants, partial(PaperLearner, alpha=0.05), repetitions=repetitions, seed=1, tau=0.1)
            times.append(time.perf_counter() - start)
        seconds = sorted(times)[len(times) // 2]
        limit = f" (limit {LIMITS[repetitions]:g} s)" if repetitions in LIMITS else ""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{len(variants)} curves x {repetitions} repetitions: {seconds:.2f} s{limit}, peak {peak:.0f} MB")


if __name__ == "__main__":
    main([int(a) for a in sys.argv[1:]] or [100, 1000, 10_000])
