"""How often each corrected test finds something where nothing is: ``FILE [STUDIES]`` simulates that many small studies.

Every study goes through the code that a real one goes through, from single trials to corrected p values: two conditions
drawn from one distribution for ERP and ERSP, four problems of noise with random labels for decoding. The family-wise
error should be 5 %; a study counts once, however many points or problems are significant.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import mne
import numpy as np
from threadpoolctl import threadpool_limits

from hrcneuro.decoding import decoders, group, problem
from hrcneuro.eeg.evoked import averages, subtract_baseline
from hrcneuro.eeg.morlet import Wavelets
from hrcneuro.eeg.morlet_means import mean_magnitudes
from hrcneuro.eeg.permutation import cluster_test, sign_flip_test

SUBJECTS, CHANNELS, SAMPLES, SFREQ = 9, 3, 64, 64.0
TIMES = np.arange(-13, SAMPLES - 13) / SFREQ
WAVELETS = Wavelets((4.0, 8.0, 16.0), (2.0, 4.0, 6.0), SFREQ, 0.5)
SCHEME = problem.Scheme(n_folds=5, n_repeats=2, n_permutations=0)


def epochs(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return noise with the slow drift and the correlated channels of EEG."""
    noise = np.cumsum(rng.standard_normal((n, CHANNELS, SAMPLES)), axis=-1) + 2 * rng.standard_normal((n, 1, SAMPLES))
    return noise + rng.standard_normal((n, CHANNELS, SAMPLES))


def masks(rng: np.random.Generator, n: int) -> np.ndarray:
    takeover = rng.permutation(n) < n // 3
    return np.stack([takeover, ~takeover])


def erp(rng: np.random.Generator) -> np.ndarray:
    """Return the differences of a study, shape (subjects, channels, samples)."""
    found = []
    for _ in range(SUBJECTS):
        means = averages(subtract_baseline(epochs(rng, 18), TIMES, (-0.2, 0.0)), masks(rng, 18))
        found.append(means[0] - means[1])
    return np.stack(found)


def ersp(rng: np.random.Generator) -> np.ndarray:
    """Return the same of mean magnitudes, shape (subjects, channels, frequencies, samples / 2)."""
    found = []
    for _ in range(SUBJECTS):
        means = mean_magnitudes(epochs(rng, 18), masks(rng, 18), WAVELETS, step=2)
        found.append(means[0] - means[1])
    return np.stack(found)


def max_t(differences: np.ndarray, rng: np.random.Generator) -> bool:
    return bool(sign_flip_test(differences, rng).significant.any())


def clusters(differences: np.ndarray, rng: np.random.Generator) -> bool:
    adjacency = mne.stats.combine_adjacency(*differences.shape[1:])
    return bool(cluster_test(differences, adjacency).significant.any())


def decode(rng: np.random.Generator) -> bool:
    """Return whether the group test finds a decodable problem among four, in 11 subjects, after Holm's correction."""
    p = []
    for _ in range(4):
        found = []
        for _ in range(11):
            labels = rng.permutation(48) < 16
            trials = problem.Trials(labels, None)
            plan = problem.draw_plan(trials, SCHEME, rng)
            scorer = decoders.rlda(rng.normal(0, 5, (48, 12)), shrinkage=0.9)
            found.append(100 * problem.decode(trials, plan, SCHEME, scorer).fold_rates.mean()["bacc"])
        p.append(group.sign_flip_p(np.array(found) - 50, rng))
    return bool((group.holm(p) < 0.05).any())


STUDIES: dict[str, Callable[[np.random.Generator], bool]] = {
    "ERP, extreme statistics": lambda rng: max_t(erp(rng), rng),
    "ERSP, extreme statistics": lambda rng: max_t(ersp(rng), rng),
    "ERP, clusters": lambda rng: clusters(erp(rng), rng),
    "decoding, sign flips and Holm": decode,
}


def main(n: int) -> None:
    print("| test | studies without effect | with a finding |\n|---|---|---|")
    for seed, (name, study) in enumerate(STUDIES.items()):
        start, rng = time.perf_counter(), np.random.default_rng(seed)
        share = np.mean([study(rng) for _ in range(n)])
        error = 100 * np.sqrt(share * (1 - share) / n)
        print(f"| {name} | {n} | {100 * share:.1f} ± {error:.1f} % |", flush=True)
        print(f"  {time.perf_counter() - start:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    with threadpool_limits(1):
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
