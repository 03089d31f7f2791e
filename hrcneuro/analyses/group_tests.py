"""Testing maps of all subjects against zero: what erp, ersp and rerp share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.contract import option

if TYPE_CHECKING:
    from hrcneuro.eeg.contrasts import Contrast, Floats


@dataclass(frozen=True)
class FlipOptions:
    """How maps are tested over subjects."""

    correction: str = option(
        "max", "over all points of the map: extreme statistics of sign flips, or clusters", choices=("max", "cluster")
    )
    alpha: float = option(
        published.LEVEL.value, "family-wise error, two-sided", low=0, high=1, share=True, open_low=True
    )
    cluster_alpha: float = option(
        0.05, "level of the t threshold that forms clusters", low=0, high=1, share=True, open_low=True
    )
    exact_subjects: int = option(16, "up to this many subjects all sign flips are taken", low=2, high=20)
    flips: int = option(10_000, "random sign flips beyond that", low=100)
    confidence: float = option(0.95, "level of the effect sizes' intervals", low=0.5, high=0.999, share=True)
    seed: int = option(2023, "seed of random sign flips", low=0)


def group_contrast(differences: Floats, config: FlipOptions, adjacency: Any, *, stream: tuple[str, str]) -> Contrast:
    """Return what came out of all subjects' maps; of one subject there is no test.

    Args:
        differences: One map a subject, ndarray, shape (n_subjects, ...).
        config: How they are tested.
        adjacency: For ``correction = "cluster"``: which points of a map are neighbours.
        stream: Scenario and name of the map. Each has its own stream of random flips: leaving one out changes no other.
    """
    import numpy as np

    from hrcneuro.eeg.contrasts import summarise
    from hrcneuro.eeg.permutation import cluster_test, sign_flip_test

    scenario, name = stream
    seeds = [config.seed, *scenario.encode(), 0, *name.encode()]
    common: Any = dict(alpha=config.alpha, exact_to=config.exact_subjects, count=config.flips)
    if len(differences) < 2:
        test = None
    elif config.correction == "cluster":
        seed = int(np.random.default_rng(seeds).integers(2**31))
        test = cluster_test(differences, adjacency, cluster_alpha=config.cluster_alpha, seed=seed, **common)
    else:
        test = sign_flip_test(differences, np.random.default_rng(seeds), **common)
    return summarise(differences, test, confidence=config.confidence)


def size_warnings(sizes: Iterable[int], alpha: float, *, of_one: str) -> list[str]:
    """Return sentences on tests that can never reach significance.

    Args:
        sizes: Numbers of subjects that were tested together.
        alpha: Family-wise error.
        of_one: What is said where there is one subject.
    """
    from hrcneuro.eeg.permutation import smallest_p

    sizes = set(sizes)
    return [of_one] * (1 in sizes) + [
        f"with {n} subjects the smallest p is {smallest_p(n):.3g}: nothing can be significant at {alpha:g}, the "
        "differences are descriptive"
        for n in sorted(sizes - {1})
        if smallest_p(n) > alpha
    ]
